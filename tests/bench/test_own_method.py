"""A method from a Python file runs on the reach problems, under the same judge."""

from pathlib import Path

import numpy as np
import pytest

from sidestep.bench import BenchSettings, MotionSettings, OwnMethodRunner, ProblemSettings, run_bench
from sidestep.cli.bench_output import method_or_file
from sidestep.robot import Robot

SPRING = """
def method(robot, problem):
    return lambda time, q, v: 4.0 * (problem.goal - q) - 4.0 * v
"""


def settings(path: Path, **motion: object) -> BenchSettings:
    problems = ProblemSettings(robot="planar3", obstacles=2)
    return BenchSettings(problems, count=3, method=path, motion=MotionSettings(duration=4.0, **motion))


def test_a_spring_is_integrated_and_judged(tmp_path: Path) -> None:
    path = tmp_path / "spring.py"
    path.write_text(SPRING, encoding="utf-8")
    result = run_bench(settings(path))
    document = result.to_document()
    assert document["method"] == "spring.py"
    for problem, outcome in zip(result.problems, result.outcomes, strict=True):
        # A critically damped spring of 2/s takes the straight line in joint space, so it touches what that touches.
        assert outcome.collision == problem.straight_line_blocked
        away = np.abs(problem.goal - problem.start).max()
        time = np.linspace(0.0, 4.0, 4001)
        left = away * (1.0 + 2.0 * time) * np.exp(-2.0 * time)
        arrived = time[np.argmax(left < 0.05)]
        assert outcome.time_s == pytest.approx(arrived, abs=0.01)  # semi-implicit Euler at 1 ms
    assert any(outcome.collision for outcome in result.outcomes)


def test_the_method_of_the_page_runs(tmp_path: Path) -> None:
    page = Path(__file__).parents[2] / "docs" / "how-to" / "comparing.md"
    path = tmp_path / "my_method.py"
    path.write_text(
        page.read_text(encoding="utf-8").split("```python\n")[1].split("```")[0], encoding="utf-8"
    )
    result = run_bench(settings(path))
    assert [item.success for item in result.outcomes] == [
        not p.straight_line_blocked for p in result.problems
    ]


def test_what_is_wrong_is_named(tmp_path: Path) -> None:
    robot = Robot.named("planar3")
    with pytest.raises(FileNotFoundError, match=r"there is no file '.*none\.py'"):
        OwnMethodRunner.from_file(tmp_path / "none.py", robot)
    path = tmp_path / "empty.py"
    path.write_text("x = 1\n", encoding="utf-8")
    with pytest.raises(ValueError, match=r"defines no function method\(robot, problem\)"):
        OwnMethodRunner.from_file(path, robot)
    path.write_text("def method(robot):\n    return lambda time, q, v: 0.0 * q\n", encoding="utf-8")
    with pytest.raises(
        ValueError, match=r"method must take \(robot, problem\): too many positional arguments"
    ):
        OwnMethodRunner.from_file(path, robot)
    path.write_text("def method(robot, problem):\n    return lambda time, q, v: [1.0]\n", encoding="utf-8")
    with pytest.raises(ValueError, match=r"empty\.py: step gave \[1\.0\] in problem 0, must be 3 finite"):
        run_bench(settings(path))
    with pytest.raises(ValueError, match="without --torque and --poses"):
        run_bench(settings(path, torque=True))
    with pytest.raises(ValueError, match=r"--method is 'foo'; allowed: controller, .* or a Python file"):
        method_or_file("foo")
    with pytest.raises(FileNotFoundError, match=r"there is no file 'none\.py'"):
        method_or_file("none.py")  # before the robot is prepared
