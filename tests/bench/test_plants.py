"""What the benchmarks of plants, servers and policies are made of: benchmarks/plant.py and others."""

from __future__ import annotations

import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import mujoco
import numpy as np
import pytest

import sidestep as ss
from sidestep.drivers.franka_server import arm_alone
from sidestep.robot import tip_of
from sidestep.simulation.model import build_model

sys.path.insert(0, str(Path(__file__).parents[2] / "benchmarks"))
from plant import Plant, SimulatedArm, add_payload, combined, dynamics
from plants import figures
from policy import Policy

sys.path.remove(
    str(Path(__file__).parents[2] / "benchmarks")
)  # its studio.py would hide the folder of tests of that name

GRAVITY = 9.81  # [m/s^2] of MuJoCo


class Constant:
    """A controller that asks for the same all the time."""

    def __init__(self, robot: ss.Robot, torque: np.ndarray) -> None:
        self.torque, self.zero, self.seen = torque, np.zeros(robot.num_coordinates), []

    def step(self, q: np.ndarray, v: np.ndarray) -> Any:
        self.seen.append((q, v))
        return SimpleNamespace(torque=self.torque, acceleration=self.zero)


def test_bodies_are_combined_about_their_common_centre() -> None:
    point = np.zeros((3, 3))
    mass, com, inertia = combined([(1.0, np.array([1.0, 0, 0]), point), (3.0, np.array([-1.0, 0, 0]), point)])
    assert mass == 4.0
    np.testing.assert_allclose(com, [-0.5, 0.0, 0.0], atol=1e-15)
    np.testing.assert_allclose(inertia, np.diag([0.0, 3.0, 3.0]), atol=1e-15)  # 1.5^2 + 3 * 0.5^2


def test_a_payload_weighs_at_the_tip_as_the_jacobian_says() -> None:
    robot = ss.Robot.named("fr3")
    q = robot.random_configuration(np.random.default_rng(0))
    built, loaded = build_model(robot, visuals=False), build_model(robot, visuals=False)
    add_payload(loaded, robot, 2.0)
    zero = np.zeros_like(q)
    M, bias = dynamics(built, mujoco.MjData(built.model), q, zero)
    heavier, more = dynamics(loaded, mujoco.MjData(loaded.model), q, zero)
    J = robot.jacobian(q, tip_of(robot))
    np.testing.assert_allclose(more - bias, 2.0 * GRAVITY * J[2], atol=1e-9)
    ball = 0.4 * 2.0 * 0.05**2 * J[3:].T @ J[3:]  # of even density
    np.testing.assert_allclose(heavier - M, 2.0 * J[:3].T @ J[:3] + ball, atol=1e-9)


def test_commands_come_late_and_motors_give_their_share() -> None:
    robot = ss.Robot.named("fr3")
    q = np.array([0.0, -0.3, 0.0, -1.8, 0.0, 1.5, 0.0])
    arm = SimulatedArm(robot, (), Plant(torque_share=0.6, delay=0.005))
    motion = arm.drive(Constant(robot, robot.limits.effort), q, 0.02, seed=0)
    _, gravity = arm.told_dynamics(q, np.zeros_like(q))
    np.testing.assert_allclose(motion.applied[:5], np.tile(gravity, (5, 1)))
    np.testing.assert_allclose(motion.applied[5:], np.tile(0.6 * robot.limits.effort, (15, 1)))


def test_physics_that_diverge_are_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)  # MuJoCo writes its warnings where it runs
    robot = ss.Robot.named("fr3")
    arm = SimulatedArm(robot, (), Plant(push=1e14, push_time=0.05, push_every=1e-3))
    with pytest.raises(RuntimeError, match=r"the physics diverged at 0\.05"):
        arm.drive(Constant(robot, np.zeros(7)), robot.neutral, 0.2, seed=0)


def test_encoders_are_off_and_the_truth_is_kept() -> None:
    robot = ss.Robot.named("fr3")
    q = np.array([0.0, -0.3, 0.0, -1.8, 0.0, 1.5, 0.0])
    controller = Constant(robot, np.zeros(7))
    arm = SimulatedArm(robot, (), Plant(encoder_offset=0.01, rate=250.0))
    motion = arm.drive(controller, q, 0.04, seed=0)
    assert len(controller.seen) == 10
    np.testing.assert_allclose(motion.q[0], q)
    assert motion.q.shape == (40, 7)
    np.testing.assert_allclose(np.abs(controller.seen[3][0] - motion.q[12]), 0.01, atol=1e-12)


@pytest.mark.parametrize("output", ["position", "velocity"])
def test_a_drive_holds_the_arm_where_it_is_told(output: str) -> None:
    robot = ss.Robot.named("ur10")
    q = np.array([0.0, -1.0, 1.0, 0.3, 0.2, 0.1])
    controller = Constant(robot, np.zeros(6))
    held = SimpleNamespace(
        position=q, velocity=np.zeros(6), torque=controller.torque, acceleration=controller.zero
    )
    controller.step = lambda q, v: held  # type: ignore[method-assign]
    motion = SimulatedArm(robot, (), Plant(payload=0.5), output).drive(controller, q, 1.0, seed=0)
    # The integral takes up the payload: positions come back; under velocity what moved meanwhile stays.
    assert np.abs(motion.q[-1] - q).max() < {"position": 1e-5, "velocity": 0.02}[output]
    assert np.abs(motion.v[-1]).max() < 1e-5


def test_figures_say_by_how_much_limits_are_exceeded() -> None:
    limits = SimpleNamespace(
        lower=np.array([-1.0]),
        upper=np.array([1.0]),
        velocity=np.array([2.0]),
        acceleration=np.array([10.0]),
        effort=np.array([5.0]),
        jerk=np.array([100.0]),
    )
    motion = SimpleNamespace(
        q=np.array([[0.0], [1.25]]),
        v=np.array([[2.5], [2.495]]),
        acceleration=np.array([[1.0], [1.0], [3.0]]),
        torque=np.array([[4.0], [4.0], [1.0]]),
        period=0.01,
    )
    found = figures(limits, motion, np.array([3.0]))
    assert found["position_excess_rad"] == 0.25
    assert found["velocity_excess"] == 0.25
    assert found["acceleration_ratio"] == pytest.approx(0.5)
    assert found["jerk"] == pytest.approx(200.0)
    assert found["jerk_ratio"] == pytest.approx(2.0)
    assert found["torque_rate"] == pytest.approx(300.0)
    assert "torque_rate_ratio" not in found  # no such limit is told


def test_an_arm_alone_has_no_hand() -> None:
    text = """<mujoco><compiler meshdir="assets"/><worldbody><body name="link"><body name="hand"/></body></worldbody>
        <actuator><position name="a"/><general name="hand"/></actuator><tendon/><keyframe/></mujoco>"""
    found = arm_alone(text, Path("/meshes"))
    assert "hand" not in found
    assert "tendon" not in found
    assert "keyframe" not in found
    assert 'name="a"' in found
    assert 'meshdir="/meshes"' in found


def test_a_policy_goes_at_its_speed_and_waits_for_the_arm() -> None:
    policy = Policy(np.zeros(2), np.array([[1.0, 0.5], [1.0, 0.0]]), 0.5)
    np.testing.assert_allclose(policy.at(np.array([0.0, 1.0, 2.0, 2.5, 9.0])).T[0], [0.0, 0.5, 1.0, 1.0, 1.0])
    for _ in range(200):
        policy.chunk(np.zeros(2))
    assert 0.5 <= policy.at(np.array([policy.time]))[0].max() < 0.52  # half a radian ahead, no farther
