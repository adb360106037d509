"""What is taken away from the studio is what was there."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from sidestep import GeometricSystem, Robot, Scenario, presets
from sidestep.scenario.assembly import assemble
from sidestep.scenario.scenario import RobotChoice
from sidestep.studio import messages as m
from sidestep.studio.export import python_snippet, save_scenario, scenario_now
from sidestep.studio.methods import METHODS, build_system
from sidestep.studio.session import Session
from sidestep.studio.things import CLOUD_LIMIT, cloud, scattered, thinned

SPRING = {"stiffness": 3.0, "damping": 2.0}


@pytest.mark.parametrize("name", ["thesis", "unswitched", "sigmoid", "binary", "harmonic_only"])
def test_the_snippet_makes_the_same_system(name: str) -> None:
    robot = Robot.named("planar2")
    numbers = {**METHODS[name].defaults, **SPRING}
    variables: dict[str, object] = {}
    exec(python_snippet(RobotChoice(name="planar2"), name, numbers), variables)
    made, system = variables["system"], build_system(METHODS[name], robot, body_of(robot), numbers)
    assert isinstance(made, GeometricSystem)
    q, v, goal = np.array([0.3, 0.4]), np.array([0.2, -0.1]), np.array([1.0, 0.5])
    obstacles = ball()
    np.testing.assert_array_equal(
        made.acceleration(q, v, goal, obstacles).acceleration,
        system.acceleration(q, v, goal, obstacles).acceleration,
    )


def test_the_snippet_of_barriers_has_their_numbers(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[presets.Barriers] = []
    monkeypatch.setattr(presets, "barrier_system", lambda robot, numbers: asked.append(numbers))
    exec(
        python_snippet(RobotChoice(name="planar2"), "barrier", {**METHODS["barrier"].defaults, **SPRING}), {}
    )
    assert asked == [presets.Barriers(stiffness=3.0, damping=2.0)]


def test_the_saved_scenario_runs_the_method_that_was_chosen(
    make_session: Callable[..., Session], scenario: Scenario, tmp_path: Path
) -> None:
    session = make_session(scenario, method="thesis", numbers={"thesis": SPRING})
    path = save_scenario(scenario_now(session.snapshot(), name="mine"), tmp_path)
    parts = assemble(Scenario.load(path))
    system = build_system(
        METHODS["thesis"], parts.robot, parts.body, {**METHODS["thesis"].defaults, **SPRING}
    )
    step, again = (
        s.acceleration(parts.start, parts.start, parts.goal, ball()) for s in (parts.system, system)
    )
    np.testing.assert_array_equal(step.acceleration, again.acceleration)
    # and loaded again it has the same numbers
    assert (
        make_session(Scenario.load(path)).snapshot().numbers["thesis"] == session.snapshot().numbers["thesis"]
    )


def test_the_file_says_when_barriers_move_the_arm(
    make_session: Callable[..., Session], scenario: Scenario, tmp_path: Path
) -> None:
    session = make_session(scenario, numbers={"barrier": SPRING})
    loaded = Scenario.load(save_scenario(scenario_now(session.snapshot(), name="mine"), tmp_path))
    assert loaded.method == "barrier"
    session = make_session(scenario)
    session.handle(m.SetNumbers("barrier", SPRING))
    session.handle(m.Load(loaded))  # it has no numbers of barriers: they stay
    assert session.snapshot().numbers["barrier"]["stiffness"] == 3.0
    session.handle(m.SetMethod("unswitched"))
    assert scenario_now(session.snapshot(), name="mine").method == "written"


def test_a_cloud_is_saved_beside_its_scenario(
    make_session: Callable[..., Session], scenario: Scenario, tmp_path: Path
) -> None:
    points = scattered(0.2, seed=1)
    source = tmp_path / "somewhere" / "cloud.npy"
    source.parent.mkdir()
    np.save(source, points)
    session = make_session(scenario)
    session.handle(m.AddThing(cloud("wall", np.array([-0.9, 0.0, 0.0]), source, 0.01)))
    assert len(session._obstacles()) == 1 + len(points)
    np.testing.assert_allclose(
        session._obstacles().points[1:], points + np.array([-0.9, 0.0, 0.0]), atol=1e-12
    )
    folder = tmp_path / "saved"
    folder.mkdir()
    path = save_scenario(scenario_now(session.snapshot(), name="mine"), folder)
    source.unlink()
    loaded = Scenario.load(path)
    assert loaded.obstacles[1].shape.file == "mine-cloud.npy"
    np.testing.assert_array_equal(make_session(loaded).snapshot().things[1].cloud, points)


def test_a_large_cloud_is_thinned() -> None:
    points = np.random.default_rng(0).uniform(0.0, 1.0, (5000, 3))
    thin = thinned(points)
    assert 0.3 * CLOUD_LIMIT < len(thin) <= CLOUD_LIMIT
    np.testing.assert_array_equal(thinned(points[:100]), points[:100])


def test_a_pose_goal_cannot_be_saved(make_session: Callable[..., Session], scenario: Scenario) -> None:
    session = make_session(scenario)
    session.handle(m.SetPoseGoal(session.robot.pose(np.array([0.1, 0.2]), session.tip)))
    with pytest.raises(ValueError, match="a scenario file has a configuration as its goal"):
        scenario_now(session.snapshot(), name="mine")


def body_of(robot: Robot) -> object:
    from sidestep import Body
    from sidestep.studio.methods import THESIS_COMPONENTS

    return Body.fit(robot, components=THESIS_COMPONENTS)


def ball() -> object:
    from sidestep import Obstacles

    return Obstacles([[0.8, 0.6, 0.0]], radii=0.05)
