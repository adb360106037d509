"""Names of other packages of robot descriptions."""

import sys
import types
from collections.abc import Iterator
from pathlib import Path

import pytest

import sidestep as ss
from sidestep.robot import Robot, planar_arm
from sidestep.robot.descriptions import described

MJCF = """<mujoco model="theirs"><worldbody><body name="a"><joint name="j1" axis="0 0 1" range="-90 90"/>
    <geom type="box" size="0.1 0.1 0.2"/></body></worldbody>
    <actuator><velocity joint="j1" kv="1" ctrlrange="-1 1" forcerange="-5 5"/></actuator></mujoco>"""

BODY = '<body name="b"><geom size="0.1"/></body>'


@pytest.fixture
def packages(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A stand-in of each package on sys.path; robot_descriptions' own modules download when imported."""
    (tmp_path / "panda.xml").write_text(MJCF)
    (tmp_path / "planar.urdf").write_text(planar_arm(2))
    package = tmp_path / "path" / "robot_descriptions"
    package.mkdir(parents=True)
    (package / "__init__.py").write_text("")
    (package / "panda_mj_description.py").write_text(f"MJCF_PATH = {str(tmp_path / 'panda.xml')!r}\n")
    (package / "planar_description.py").write_text(
        f"REPOSITORY_PATH = {str(tmp_path)!r}\nURDF_PATH = {str(tmp_path / 'planar.urdf')!r}\n"
    )
    (package / "offline_description.py").write_text("raise OSError('no network')\n")
    (package / "loaders.py").write_text("raise OSError('not asked for')\n")
    (tmp_path / "path" / "mujoco_menagerie.py").write_text(
        f"""
class Model:
    default_model = "panda"
    def xml(self, entry):
        assert entry == "panda"
        return {str(tmp_path)!r} + "/panda.xml"
def names(): return ["franka_emika_panda", "fr3"]
def get(name): return Model()
"""
    )
    for name in [key for key in sys.modules if key.startswith(("robot_descriptions", "mujoco_menagerie"))]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.syspath_prepend(tmp_path / "path")
    monkeypatch.setenv("SIDESTEP_CACHE_DIR", str(tmp_path / "cache"))
    yield tmp_path
    for name in [key for key in sys.modules if key.startswith(("robot_descriptions", "mujoco_menagerie"))]:
        del sys.modules[name]


@pytest.mark.parametrize("name", ["panda_mj_description", "franka_emika_panda"])
def test_mjcf_by_name(packages: Path, name: str) -> None:
    robot = Robot.named(name)
    assert (robot.name, robot.coordinate_names) == (name, ["j1"])


def test_urdf_by_name_with_locks(packages: Path) -> None:
    assert Robot.named("planar_description", locked={"joint2": 0.5}).held == {"joint2": 0.5}


def test_arm_by_name_takes_every_option_and_pairs_of_the_description(
    packages: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Up to the preparation, which takes minutes."""
    seen = []

    def prepare(robot: Robot, *, allowed: object, source: str, **_: object) -> ss.Arm:
        seen.append((robot.name, robot.limits.velocity.tolist(), allowed, source))
        return ss.Arm.load("planar2")

    monkeypatch.setattr("sidestep.arm.preparation.prepare", prepare)
    panda = packages / "panda.xml"
    touching = '<contact><exclude body1="a" body2="b"/></contact></mujoco>'
    panda.write_text(panda.read_text().replace("</mujoco>", touching).replace("</body>", BODY + "</body>", 1))
    ss.Arm.load("panda_mj_description", velocity_limits=0.5, cache=False)
    ss.Arm.load(panda, velocity_limits=0.5, allowed=[("world", "a")], cache=False)
    assert seen == [
        ("panda_mj_description", [0.5], (("a", "b"),), "panda_mj_description"),
        ("theirs", [0.5], (("a", "b"), ("world", "a")), "panda.xml"),
    ]


def test_a_failed_download_is_told(packages: Path) -> None:
    with pytest.raises(FileNotFoundError, match=r"cannot give 'offline_description': OSError: no network"):
        Robot.named("offline_description")


def test_shipped_names_are_never_theirs(packages: Path) -> None:
    assert described("fr3") is None
    assert described("loaders") is None
    assert Robot.named("planar2").num_coordinates == 2


def test_an_unknown_name_lists_the_shipped_and_names_the_packages(monkeypatch: pytest.MonkeyPatch) -> None:
    text = r"known: fr3, .*planar3; .*install robot_descriptions or mujoco_menagerie"
    for module in ("robot_descriptions", "mujoco_menagerie"):
        monkeypatch.setitem(sys.modules, module, None)
    with pytest.raises(ValueError, match=text):
        ss.Arm.load("panda_mj_description")
    monkeypatch.setitem(sys.modules, "mujoco_menagerie", types.ModuleType("mujoco_menagerie"))
    with pytest.raises(ValueError, match=text):
        Robot.named("franka_emika_panda")
