"""`sidestep show --json`: what was read, by value; and how bad files end."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from sidestep import cli

# A base, a turning link, an endless one, a slide and a follower. The box on the slide reaches down to the base, which
# it does not adjoin: at the middle of the slide, 0.2 m, it overlaps the base's box by 0.05 m.
ROBOT = """\
<robot name="small">
  <link name="base">
    <inertial><mass value="3"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>
    <collision><geometry><box size="0.2 0.2 0.2"/></geometry></collision>
  </link>
  <link name="arm">
    <inertial><mass value="1.5"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>
    <visual><geometry><sphere radius="0.01"/></geometry></visual>
  </link>
  <link name="wrist"/>
  <link name="finger">
    <collision><origin xyz="0 0 -0.1"/><geometry><box size="0.1 0.1 0.1"/></geometry></collision>
  </link>
  <link name="other"/>
  <joint name="turn" type="revolute">
    <parent link="base"/><child link="arm"/><axis xyz="0 0 1"/>
    <limit lower="-1" upper="2" velocity="3" effort="40"/>
  </joint>
  <joint name="roll" type="continuous">
    <parent link="arm"/><child link="wrist"/><axis xyz="0 0 1"/><limit velocity="4" effort="0"/>
  </joint>
  <joint name="slide" type="prismatic">
    <parent link="wrist"/><child link="finger"/><axis xyz="0 0 1"/>
    <limit lower="0.1" upper="0.3" velocity="0.5" effort="20"/>
  </joint>
  <joint name="follow" type="prismatic">
    <parent link="wrist"/><child link="other"/><axis xyz="0 1 0"/>
    <limit lower="-1" upper="1" velocity="0.5" effort="20"/><mimic joint="slide" multiplier="-2" offset="0.1"/>
  </joint>
</robot>
"""


@pytest.fixture
def small(tmp_path: Path) -> Path:
    path = tmp_path / "small.urdf"
    path.write_text(ROBOT)
    return path


@pytest.fixture
def show(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Callable[..., Any]:
    """Runs the command: the document, or the exit code and what stands on stderr."""

    def call(*arguments: str | Path) -> Any:
        monkeypatch.setattr(sys, "argv", ["sidestep", "show", *map(str, arguments), "--json", "-"])
        with pytest.raises(SystemExit) as caught:
            cli.main()
        captured = capsys.readouterr()
        return (caught.value.code, captured.err) if caught.value.code else json.loads(captured.out)

    return call


def test_the_document_has_every_limit_with_its_unit(show: Callable[..., Any], small: Path) -> None:
    found = show(small)
    assert (found["kind"], found["name"], found["base"], found["num_coordinates"]) == (
        "URDF",
        "small",
        "base",
        3,
    )
    # acceleration 10 and jerk 1000 are the defaults: URDF has neither
    assert found["joints"] == [
        joint("turn", "revolute", "rad", lower=-1.0, upper=2.0, velocity=3.0, effort=40.0),
        joint("roll", "continuous", "rad", lower=None, upper=None, velocity=4.0, effort=None),
        joint("slide", "prismatic", "m", lower=0.1, upper=0.3, velocity=0.25, effort=20.0),
    ]
    assert found["default_acceleration_and_jerk"] is True
    assert found["mimic"] == [{"joint": "follow", "follows": "slide", "multiplier": -2.0, "offset": 0.1}]
    assert (found["mass_kg"], found["moving_mass_kg"]) == (4.5, 1.5)


def joint(name: str, kind: str, unit: str, **limits: float | None) -> dict[str, Any]:
    rest = {"acceleration": 10.0, "jerk": 1000.0, "effort_rate": None}
    return {"name": name, "kind": kind, "unit": unit, **limits, **rest}


def test_the_document_has_links_warnings_and_what_touches(show: Callable[..., Any], small: Path) -> None:
    found = show(small)
    links = {link.pop("name"): link for link in found["links"]}
    assert list(links) == ["base", "arm", "wrist", "finger", "other"]
    assert links["base"] == {"moved_by": None, "mass_kg": 3.0, "visual": [], "collision": ["box"]}
    assert links["arm"] == {"moved_by": "turn", "mass_kg": 1.5, "visual": ["sphere"], "collision": []}
    (warning,) = found["warnings"]
    assert "joint 'roll': no effort limit is given" in warning
    assert found["touching"]["configuration"] == pytest.approx([0.5, 0.0, 0.2])
    pairs = {tuple(item["links"]): item["reason"] for item in found["touching"]["left_out"]}
    assert pairs["base", "arm"] == "adjacent"
    assert found["touching"]["pairs"] == [["base", "finger"]]


def test_options_are_those_of_other_commands(show: Callable[..., Any], small: Path) -> None:
    found = show(small, "--locked", "slide=0.15", "--velocity-limit", "turn=1", "--effort-limit", "roll=5")
    assert found["locked"] == pytest.approx({"slide": 0.15, "follow": -0.2})
    assert [item["velocity"] for item in found["joints"]] == [1.0, 4.0]
    assert found["joints"][1]["effort"] == 5.0
    assert found["warnings"] == []
    assert show(small, "--tip", "arm")["tip"] == "arm"
    assert len(show(small, "--tip", "arm")["joints"]) == 1


def test_a_named_robot_and_its_arm_file_are_read_alike(show: Callable[..., Any]) -> None:
    from sidestep.shipped_arms import shipped_file

    named, of_file = show("planar2"), show(shipped_file("planar2"))
    assert (named["kind"], of_file["kind"]) == ("named robot", "arm file")
    for key in ("name", "joints", "tip", "base", "moving_mass_kg"):
        assert of_file[key] == named[key]
    assert named["moving_mass_kg"] == pytest.approx(1.728)  # two links of 0.864 kg
    assert of_file["touching"]["reason"] == "there are no meshes to measure on"


def test_postures_of_an_mjcf_are_in_the_document(show: Callable[..., Any], tmp_path: Path) -> None:
    text = """<mujoco><worldbody><body name="a"><joint name="j" axis="0 0 1" range="-90 90"/>
      <geom type="sphere" size="0.1"/></body></worldbody><keyframe><key name="home" qpos="0.25"/></keyframe></mujoco>"""
    (tmp_path / "arm.xml").write_text(text)
    found = show(tmp_path / "arm.xml")
    assert (found["kind"], found["postures"]) == ("MJCF", {"home": [0.25]})
    assert found["joints"][0]["upper"] == pytest.approx(np.pi / 2)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("<robot name='x'><link name='a'/></robot>", "no movable joint"),
        ("<sdf/>", "it is SDF"),
        ("", "bad.urdf"),
    ],
)
def test_a_bad_file_is_one_line_and_exit_code_2(
    show: Callable[..., Any], tmp_path: Path, text: str, said: str
) -> None:
    (tmp_path / "bad.urdf").write_text(text)
    code, error = show(tmp_path / "bad.urdf")
    assert code == 2
    assert len(error.strip().splitlines()) == 1
    assert said in error


def test_options_that_do_not_suit_the_source_are_refused(show: Callable[..., Any]) -> None:
    from sidestep.shipped_arms import shipped_file

    code, error = show(shipped_file("planar2"), "--tip", "tip")
    assert (code, "tip cannot be given for arm file" in error) == (2, True)
    code, error = show("planar2", "--tip", "tip")
    assert (code, "tip cannot be given for robot 'planar2'" in error) == (2, True)
