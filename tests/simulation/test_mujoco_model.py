"""The MuJoCo model against Pinocchio and against closed forms."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest
from scipy.special import ellipk
from stand_ins import PENDULUM, Holding, InverseDynamics, Spring, simulate

from sidestep import Robot, SceneObject, Simulation
from sidestep._core import Obstacles
from sidestep.simulation import Arrival, build_model

MIMIC = """
<robot name="mimic">
  <link name="base"/>
  <joint name="leader" type="revolute">
    <parent link="base"/><child link="a"/><axis xyz="0 1 0"/>
    <limit lower="-2" upper="2" velocity="5" effort="40"/>
  </joint>
  <link name="a"><inertial><origin xyz="0.2 0 0"/><mass value="2"/>
    <inertia ixx="0.02" ixy="0" ixz="0" iyy="0.03" iyz="0" izz="0.03"/></inertial></link>
  <joint name="follower" type="revolute">
    <parent link="a"/><child link="b"/><origin xyz="0.4 0 0"/><axis xyz="0 1 0"/>
    <mimic joint="leader" multiplier="-0.5" offset="0.3"/>
    <limit lower="-2" upper="2" velocity="5" effort="40"/>
  </joint>
  <link name="b"><inertial><origin xyz="0.15 0 0"/><mass value="1"/>
    <inertia ixx="0.01" ixy="0" ixz="0" iyy="0.02" iyz="0" izz="0.02"/></inertial></link>
</robot>
"""


def _robot(name: str) -> Robot:
    return Robot.from_urdf(MIMIC) if name == "mimic" else Robot.named(name)


@pytest.mark.parametrize("name", ["fr3_arm", "fr3", "ur5", "planar3", "mimic"])
def test_mass_matrix_and_bias_agree_with_pinocchio(name: str) -> None:
    robot = _robot(name)
    built = build_model(robot)
    data = mujoco.MjData(built.model)
    rng = np.random.default_rng(0)
    for _ in range(20):
        q, v = robot.random_configuration(rng), rng.normal(size=robot.num_coordinates)
        built.set_state(data, q, v)
        mujoco.mj_forward(built.model, data)
        np.testing.assert_allclose(built.state(data)[0], q, atol=1e-12)
        # the two libraries sum in different orders: rounding of entries up to about 100
        np.testing.assert_allclose(built.mass_matrix(data), robot.mass_matrix(q), atol=1e-10)
        np.testing.assert_allclose(built.bias(data), robot.bias(q, v), atol=1e-10)


def test_position_limits_are_in_radians_and_enforced() -> None:
    built = build_model(Robot.named("fr3_arm"))
    limits = Robot.named("fr3_arm").limits
    stops = np.column_stack([limits.lower - 1e-3, limits.upper + 1e-3])
    np.testing.assert_allclose(built.model.jnt_range, stops)
    assert built.model.jnt_limited.all()
    np.testing.assert_allclose(built.model.actuator_ctrlrange[:, 1], limits.effort)
    assert not built.model.dof_damping.any()
    assert not built.model.dof_frictionloss.any()


def test_pendulum_period() -> None:
    robot = Robot.from_urdf(PENDULUM)
    angle = 0.5
    run = simulate(
        Simulation(robot),
        Spring(),
        Holding(compensate=False),
        np.array([angle]),
        np.zeros(1),
        8.0,
        Obstacles.none(),
        arrival=None,
    )
    mass, length, about_com, g = 1.5, 0.4, 0.02, 9.81
    small = 2 * np.pi * np.sqrt((about_com + mass * length**2) / (mass * g * length))
    exact = small * 2 / np.pi * ellipk(np.sin(angle / 2) ** 2)
    q = run.q[:, 0]
    k = np.flatnonzero((q[:-1] > 0) & (q[1:] <= 0))  # downward crossings, one per period
    crossings = run.time[k] + run.timestep * q[k] / (q[k] - q[k + 1])
    # semi-implicit Euler shifts the frequency by (w dt)^2 / 24 = 1e-6 relative, crossings are linear in 1 ms
    np.testing.assert_allclose(np.diff(crossings), exact, rtol=2e-5)


@pytest.mark.parametrize("name", ["fr3_arm", "mimic"])
def test_gravity_compensation_holds_still(name: str) -> None:
    robot = _robot(name)
    q = np.deg2rad([0, 45, 0, -66, 0, 66, 45]) if name == "fr3_arm" else np.array([0.4])
    run = simulate(
        Simulation(robot), Spring(), Holding(compensate=True), q, q, 1.0, Obstacles.none(), arrival=None
    )
    assert len(run) == 1000
    # rounding only for the tree; the mimic equality is MuJoCo's soft constraint and sags under gravity
    assert np.abs(run.q - q).max() < (1e-9 if name == "fr3_arm" else 1e-2)


def test_achieved_is_the_wanted_acceleration_under_inverse_dynamics() -> None:
    robot = Robot.named("ur5")
    goal = robot.neutral + 0.4
    run = simulate(Simulation(robot), Spring(), InverseDynamics(), robot.neutral, goal, 0.5, Obstacles.none())
    # semi-implicit Euler applies M^-1 (torque - h) unchanged; what is left is rounding divided by 1 ms
    np.testing.assert_allclose(run.achieved, run.wanted, atol=1e-8)


def test_substeps_hold_the_torque() -> None:
    robot = Robot.from_urdf(PENDULUM)
    args = (Spring(), InverseDynamics(), np.array([0.5]), np.zeros(1), 2.0, Obstacles.none())
    coarse, fine = simulate(Simulation(robot), *args), simulate(Simulation(robot, substeps=8), *args)
    assert len(coarse) == len(fine) == 2000
    # the torque is held for 1 ms: gravity moves on meanwhile, by less than v g/l dt = 0.03 rad/s^2
    np.testing.assert_allclose(fine.achieved, fine.wanted, atol=0.03)
    np.testing.assert_allclose(fine.q, coarse.q, atol=1e-3)


def test_robot_without_mass_is_refused() -> None:
    urdf = PENDULUM.replace('<mass value="1.5"/>', '<mass value="0"/>')
    with pytest.raises(ValueError, match=r"pivot.*without mass"):
        build_model(Robot.from_urdf(urdf))


def test_inertia_that_no_body_has_is_refused() -> None:
    urdf = PENDULUM.replace('ixx="0.01"', 'ixx="0.5"')
    with pytest.raises(ValueError, match=r"bob.*principal inertias.*sum of the other two"):
        build_model(Robot.from_urdf(urdf))


@pytest.mark.parametrize("timestep", [0.0, -1e-3, float("nan"), float("inf")])
def test_bad_timestep(timestep: float) -> None:
    with pytest.raises(ValueError, match="timestep must be positive"):
        build_model(Robot.from_urdf(PENDULUM), timestep=timestep)


def test_two_objects_of_one_name() -> None:
    ball = SceneObject.ball("a", [0, 0, 1], radius=0.1)
    with pytest.raises(ValueError, match="two objects of the scene are named 'a'"):
        build_model(Robot.from_urdf(PENDULUM), [ball, ball])


def test_arrival_stops_the_run() -> None:
    robot = Robot.from_urdf(PENDULUM)
    rule = Arrival(position=0.01, speed=0.01, hold=0.1)
    run = simulate(
        Simulation(robot),
        Spring(9.0, 6.0),
        InverseDynamics(),
        np.array([0.5]),
        np.zeros(1),
        9.0,
        Obstacles.none(),
        arrival=rule,
    )
    assert run.arrived
    # critically damped: q = 0.5 (1 + 3t) exp(-3t), |v| = 4.5 t exp(-3t); the later of the two conditions
    t = np.arange(0.0, 9.0, 1e-3)
    near = (0.5 * (1 + 3 * t) * np.exp(-3 * t) < 0.01) & (4.5 * t * np.exp(-3 * t) < 0.01)
    expected = t[np.flatnonzero(~near)[-1] + 1]
    assert run.time_to_goal == pytest.approx(expected, abs=0.01)  # semi-implicit Euler at 1 ms
    assert run.time[-1] == pytest.approx(run.time_to_goal + 0.1, abs=2e-3)  # one period of rounding each way
