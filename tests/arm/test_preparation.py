"""Arms of descriptions that lack limits or have inertias of no body."""

import re
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

import sidestep as ss
from sidestep.cli import app
from sidestep.controller import ControllerSettings
from sidestep.robot import planar_arm


def moves(controller: ss.Controller) -> bool:
    """Whether it sets out within 20 ms: a path that a thread has found begins with no acceleration."""
    steps = [controller.step([0, 0], [0, 0], time=0.001 * n).acceleration for n in range(1, 21)]
    return bool(np.abs(steps).max() > 0.1)


def test_torque_output_asks_for_the_effort_limits_that_are_not_given() -> None:
    text = re.sub(r'effort="[^"]*"', 'effort="0"', planar_arm(2))
    with pytest.warns(
        RuntimeWarning, match=r"joint 'joint1', joint 'joint2': no effort limit is given .*torque"
    ):
        arm = ss.Arm.load(text)
    with pytest.raises(ValueError, match="arm 'planar2' has no effort limit of 'joint1', 'joint2'"):
        ss.Controller(arm, ControllerSettings(output="torque"))
    controller = ss.Controller(arm, ControllerSettings(output="acceleration"))
    controller.set_obstacles(ss.Obstacles.none())
    controller.set_goal([0.5, 0.3])
    assert moves(controller)
    given = ss.Arm.load(text, effort_limits={"joint1": 87, "joint2": 12})
    np.testing.assert_array_equal(given.limits.effort, [87.0, 12.0])
    ss.Controller(given, ControllerSettings(output="torque"))


def test_an_inertia_of_no_body_leaves_the_arm_without_dynamics() -> None:
    text = planar_arm(2).replace('ixx="', 'ixx="-')
    with pytest.warns(RuntimeWarning) as said:
        arm = ss.Arm.load(text, cache=False)
    messages = [str(item.message) for item in said]
    assert len(messages) == 2
    assert "no rigid body has such an inertia" in messages[0]
    assert "link 'link1': rotational inertia" in messages[1]
    assert "the arm has no dynamics, so correct the <inertia>" in messages[1]
    assert not arm.has_dynamics
    controller = ss.Controller(arm)
    controller.set_obstacles(ss.Obstacles.none())
    controller.set_goal([0.5, 0.3])
    assert moves(controller)


def test_the_command_takes_limits_by_joint(tmp_path: Path) -> None:
    urdf, out = tmp_path / "arm.urdf", tmp_path / "arm.arm"
    urdf.write_text(re.sub(r'(effort|velocity)="[^"]*"', r'\1="0"', planar_arm(2)))
    limits = ["--effort-limit", "joint1=87", "--effort-limit", "joint2=12.5"]
    limits += ["--velocity-limit", "joint1=2", "--velocity-limit", "joint2=3"]
    arguments = ["prepare", str(urdf), "--out", str(out), "--quiet", *limits]
    assert CliRunner().invoke(app, arguments).exit_code == 0
    arm = ss.Arm.load(out)
    np.testing.assert_array_equal(arm.limits.effort, [87.0, 12.5])
    np.testing.assert_array_equal(arm.limits.velocity, [2.0, 3.0])


def test_the_studio_takes_limits_by_joint(tmp_path: Path) -> None:
    from sidestep.studio.start import starting_scenario

    urdf = tmp_path / "arm.urdf"
    urdf.write_text(planar_arm(2))
    chosen = starting_scenario(urdf=urdf, effort_limits={"joint1": 87.0}, velocity_limits={"joint2": 1.5})
    assert chosen.robot.effort_limits == {"joint1": 87.0}
    assert chosen.robot.velocity_limits == {"joint2": 1.5}
    with pytest.raises(ValueError, match="limits of joints go with --urdf"):
        starting_scenario(robot="planar2", effort_limits={"joint1": 87.0})


@pytest.mark.parametrize("text", ["joint1", "=3", "joint1=fast", "joint1="])
def test_a_limit_that_is_written_wrong_is_named(tmp_path: Path, text: str) -> None:
    from sidestep.cli.limit_options import by_joint

    with pytest.raises(
        ValueError, match=re.escape(f"--effort-limit is {text!r}; allowed: JOINT=VALUE, for example")
    ):
        by_joint([text], "--effort-limit")
