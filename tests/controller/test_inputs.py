"""Velocities, twists and trajectories from Python: shapes, errors, what the answer says."""

import numpy as np
import pytest

import sidestep as ss
from sidestep.controller import InputSettings, TrajectoryBehaviour

ARM = ss.Arm.load("fr3")
NV = ARM.num_coordinates


def controller(**settings: object) -> ss.Controller:
    made = ss.Controller(ARM, ss.ControllerSettings(synchronous=True, **settings))  # type: ignore[arg-type]
    made.set_obstacles(ss.Obstacles.none())
    return made


def run(c: ss.Controller, steps: int) -> tuple[np.ndarray, np.ndarray, ss.controller.Command]:
    record = ss.controller.integrate(c, ARM.neutral, np.zeros(NV), steps=steps)
    return record.last_q, record.last_v, c.command


def test_a_velocity_is_followed_without_a_goal_until_commands_stop() -> None:
    c = controller(inputs=InputSettings(timeout=0.5))
    wanted = np.array([0.2, 0.0, 0.0, 0.1, 0.0, 0.0, -0.3])
    c.set_velocity(wanted)
    _, v, command = run(c, 480)
    assert np.abs(v - wanted).max() < 2e-3
    assert command.activity == ss.Activity.moving
    assert "velocity" in c.explain()
    c.set_velocity(wanted)
    _, v, command = run(c, 1200)
    assert np.abs(v).max() < 1e-3
    assert command.activity == ss.Activity.no_goal


@pytest.mark.parametrize("local", [False, True])
def test_a_twist_has_the_rows_of_the_jacobian(local: bool) -> None:
    c = controller()
    twist = np.array([0.05, -0.04, 0.03, 0.1, 0.05, -0.1])
    c.set_twist("fr3_hand_tcp", twist, local)
    q, v, _ = run(c, 240)
    got = ARM.robot.jacobian(q, "fr3_hand_tcp") @ v
    if local:
        R = ARM.robot.pose(q, "fr3_hand_tcp")[:3, :3]
        got = np.concatenate([R.T @ got[:3], R.T @ got[3:]])
    assert np.linalg.norm(got - twist) < 0.02 * np.linalg.norm(twist)


@pytest.mark.parametrize("behaviour", ["keep_path", TrajectoryBehaviour.steer])
def test_a_trajectory_has_a_row_for_each_time(behaviour: str | TrajectoryBehaviour) -> None:
    c = controller()
    times = np.linspace(0.0, 1.0, 21)
    q = ARM.neutral + np.outer(0.5 - 0.5 * np.cos(np.pi * times), 0.2 * np.ones(NV))
    c.set_trajectory(q, times, behaviour=behaviour)
    record = ss.controller.integrate(c, ARM.neutral, np.zeros(NV), steps=1200)
    assert np.abs(record.q[500] - q[10]).max() < 0.02
    assert np.abs(record.last_q - q[-1]).max() < 1e-3
    assert c.command.activity == ss.Activity.arrived
    assert c.command.deviation < 1e-3
    assert c.command.delay < 0.1


def test_what_is_wrong_is_named() -> None:
    c = controller()
    with pytest.raises(ValueError, match=r"v .*\(3,\)|v has .*7"):
        c.set_velocity(np.zeros(3))
    with pytest.raises(ValueError, match=r"joint 'fr3_joint1' is nan"):
        c.set_velocity(np.full(NV, np.nan))
    with pytest.raises(ValueError, match=r"no link 'hand'; its links are: .*fr3_hand_tcp"):
        c.set_twist("hand", np.zeros(6))
    with pytest.raises(ValueError, match=r"behaviour is 'wait', must be one of: keep_path, steer"):
        c.set_trajectory(ARM.neutral[None], [0.0], behaviour="wait")
    with pytest.raises(ValueError, match=r"joint 'fr3_joint4' of sample 1 is 3.0.*allowed: -3.0"):
        c.set_trajectory([ARM.neutral, np.where(np.arange(NV) == 3, 3.0, ARM.neutral)], [0.0, 1.0])
    with pytest.raises(ValueError, match=r"time 1 is 0.0"):
        c.set_trajectory(np.array([ARM.neutral, ARM.neutral + 0.01]), [0.0, 0.0])
    with pytest.raises(ValueError, match=r"controller: inputs.lead is 0 rad, allowed: 0.001"):
        controller(inputs=InputSettings(lead=0.0))
