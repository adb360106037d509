"""benchmarks/arms.py: the table of robot descriptions, and what it is made of."""

from __future__ import annotations

import importlib
import json
import os
import subprocess
import sys
from pathlib import Path, PurePath

import pytest

import sidestep as ss
from sidestep.robot import planar_arm

BENCHMARKS = Path(__file__).parents[2] / "benchmarks"
sys.path.insert(0, str(BENCHMARKS))
check = importlib.import_module("arm_check")
files = importlib.import_module("arm_files")
guarded = importlib.import_module("guarded")
sys.path.remove(str(BENCHMARKS))  # its studio.py would hide the folder of tests of that name

MJCF = """<mujoco model="mj"><worldbody><body name="a"><joint name="j1" axis="0 0 1" range="-90 90"/><geom size="0.1"/>
<body name="b" pos="0 0 1"><joint name="j2" axis="0 1 0" range="-90 90"/><geom size="0.1"/></body></body></worldbody>
</mujoco>"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A URDF of an arm with 4 joints, twice, one of MuJoCo, one that is broken, and files that are none."""
    texts = {
        "panda/arm.urdf": planar_arm(4),
        "panda/copy.urdf": planar_arm(4),
        "two.xml": MJCF,
        "broken.urdf": planar_arm(2)[:-20],
        "package.xml": "<package><name>arm</name></package>",
        "readme.txt": "nothing",
    }
    for name, text in texts.items():
        (tmp_path / "files" / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / "files" / name).write_text(text)
    return tmp_path / "files"


def run(*arguments: object) -> subprocess.CompletedProcess[str]:
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(path for path in sys.path if path)}
    return subprocess.run(
        [sys.executable, str(BENCHMARKS / "arms.py"), *map(str, arguments)],
        capture_output=True,
        text=True,
        env=environment,
        check=False,
    )


def test_a_folder_gives_a_row_for_every_file(folder: Path, tmp_path: Path) -> None:
    done = run(folder, "--json", tmp_path / "out.json")
    assert done.returncode == 0, done.stderr
    document = json.loads((tmp_path / "out.json").read_text())
    rows = {row["path"]: row for row in document["files"]}
    assert sorted(rows) == ["broken.urdf", "panda/arm.urdf", "panda/copy.urdf", "two.xml"]
    assert rows["broken.urdf"]["cause"] == "not well-formed XML"
    arm = rows["panda/arm.urdf"]
    assert (arm["maker"], arm["arm"], arm["joints"], arm["chains"]) == ("Franka Robotics", "panda", 4, 1)
    assert (arm["format"], arm["reference"], rows["two.xml"]["reference"]) == ("URDF", "Pinocchio", "MuJoCo")
    assert arm["kinematics_error"] < 1e-12
    assert rows["two.xml"]["kinematics_error"] < 1e-12
    assert rows["two.xml"]["chains"] == 0  # two joints are no arm
    summary = document["summary"]
    assert (summary["files"], summary["load"], summary["equal"], summary["robots"]) == (4, 3, 3, 2)
    assert (summary["arms"], summary["arm_makers"]) == (1, ["Franka Robotics"])
    assert summary["causes"] == {"not well-formed XML": 1}
    assert "| Franka Robotics | panda | 4 | 1 | URDF | 2 | equal |" in done.stdout
    assert "| not well-formed XML | 1 | broken.urdf |" in done.stdout


@pytest.mark.slow
def test_an_arm_is_prepared_with_an_empty_cache_and_runs_problems(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A draft, where there are drafts; the preparation itself is replaced by a shipped arm."""
    monkeypatch.setenv("SIDESTEP_CACHE_DIR", "elsewhere")
    arm, asked = ss.Arm.load("fr3"), []

    def load(source: Path, *, draft: bool = False) -> ss.Arm:
        asked.append((source, draft, os.environ["SIDESTEP_CACHE_DIR"]))
        return arm

    monkeypatch.setattr(ss.Arm, "load", load)
    row = check.prepare(tmp_path / "arm.urdf", tmp_path / "cache", 1)
    assert asked == [(tmp_path / "arm.urdf", True, str(tmp_path / "cache"))]
    assert row["draft"]
    assert row["prepare_s"] >= 0.0
    counts = {"problems": 1, "success": 1, "contacts": 0, "limit_violations": 0, "under_way": 0}
    assert row["reach"] == counts | {"limits_broken": []}

    def fail(source: Path) -> ss.Arm:
        raise ValueError("no shape")

    monkeypatch.setattr(ss.Arm, "load", fail)
    assert check.prepare(tmp_path, tmp_path, 1) == {"not_prepared": "ValueError: no shape"}


def test_other_kinematics_are_seen(folder: Path) -> None:
    path = folder / "panda" / "arm.urdf"
    longer = ss.Robot.from_urdf(path.read_text().replace('xyz="0.5 0 0"', 'xyz="0.6 0 0"', 1))
    assert check.pinocchio_difference(path, longer) > 0.05
    text = MJCF.replace('pos="0 0 1"', 'pos="0 0 1.1"')
    higher = ss.Robot.from_urdf(text, velocity_limits=1.0, effort_limits=1.0)
    assert check.mujoco_difference(folder / "two.xml", higher) == pytest.approx(0.1)


def test_pinocchio_is_given_a_skeleton_of_what_it_refuses(folder: Path) -> None:
    path = folder / "panda" / "arm.urdf"
    path.write_text(path.read_text().replace('xyz="0.5 0 0"', 'xyz="0.5, 0 0"', 1))
    row = check.check(path)
    assert row["loads"]
    assert row["kinematics_error"] < 1e-12


def test_a_crash_and_a_hang_end_no_run(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(BENCHMARKS)  # where the process finds what it runs
    process = guarded.GuardedProcess(20.0)
    try:
        with pytest.raises(guarded.CrashedError, match="ended with code -6"):
            process.call(os.abort)
        with pytest.raises(guarded.CrashedError, match="ZeroDivisionError"):
            process.call(divmod, 1, 0)
        assert process.call(divmod, 7, 2) == (3, 1)
        process.seconds = 0.1
        with pytest.raises(TimeoutError, match=r"longer than 0\.1 s"):
            process.call(sum, range(10**12))
        process.seconds = 20.0
        assert process.call(divmod, 7, 2) == (3, 1)
    finally:
        process.close()


def test_makers_are_told_from_names() -> None:
    for path, expected in (
        ("ur_description/urdf/ur5_robot.urdf", ("Universal Robots", "ur5")),
        ("robots/arx5/robot.xml", ("ARX", "arx5")),
        ("mjcf_models/tiagobase_panda_scene.xml", ("PAL Robotics", "tiagobase")),
        ("franka_description/hand.urdf", ("Franka Robotics", "franka")),
        ("panda/hand.urdf", ("Franka Robotics", "panda")),
        ("suite/walker.xml", ("", "")),
    ):
        assert files.maker_and_arm(PurePath(path)) == expected
    assert files.maker_and_arm(PurePath("scene.xml"), "MuJoCo Model", "fr3_joint1") == (
        "Franka Robotics",
        "fr3",
    )


def test_packages_are_found_in_wheels_by_their_record(tmp_path: Path) -> None:
    for name in ("ours", "theirs"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "arm.urdf").write_text(planar_arm(2))
    (tmp_path / "my_arms-1.0.data").mkdir()
    (tmp_path / "my_arms-1.0.dist-info").mkdir()
    (tmp_path / "my_arms-1.0.dist-info" / "RECORD").write_text(
        "ours/arm.urdf,sha256=0,1\nours/__init__.py,,\n"
    )
    (tmp_path / "source" / "more_arms-2.0").mkdir(parents=True)
    (tmp_path / "source" / "more_arms-2.0" / "arm.urdf").write_text(planar_arm(2))
    assert files.files_of_package("my-arms", [tmp_path]) == [tmp_path.resolve() / "ours" / "arm.urdf"]
    assert files.files_of_package("more.arms", [tmp_path]) == [
        tmp_path.resolve() / "source" / "more_arms-2.0" / "arm.urdf"
    ]
    assert files.files_of_package("not-there", [tmp_path]) is None


def test_errors_are_grouped() -> None:
    for text, cause in (
        ("x has no body that moves by a hinge or slide joint: it is no arm", "not an arm: no moving joint"),
        ("x is refused by MuJoCo: Error: Error opening file 'a.stl'", "missing file of an MJCF"),
        ("x is refused by MuJoCo: XML Error: Schema violation", "refused by MuJoCo itself"),
        ("link 'a' refers to 'a.stl', which does not exist; searched in: /", "missing mesh"),
        ("joint 'a' mimics 'b', which does not exist", "link or joint that does not exist"),
        ("something new", "other: ValueError"),
    ):
        assert check.cause_of(ValueError(text)) == cause
