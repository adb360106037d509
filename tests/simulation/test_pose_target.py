"""Poses as goals of runs."""

import numpy as np
import pytest

from sidestep import Obstacles, Robot
from sidestep.math.pose import pose_at
from sidestep.simulation import Arrival, run_kinematically
from sidestep.simulation.pose_target import IkSolution, PoseTarget, solve_ik
from sidestep.system import GeometricSystem
from sidestep.thesis.adapter import SystemAdapter

START = np.array([0.0, -0.3, 0.0, -2.2, 0.0, 2.0, 0.8])
TIP = "fr3_hand_tcp"


@pytest.fixture(scope="module")
def arm() -> Robot:
    return Robot.named("fr3")


def target(arm: Robot) -> np.ndarray:
    """20 cm in front of the start."""
    return pose_at([0.2, 0.0, 0.0]) @ arm.pose(START, TIP)


def test_a_posture_has_the_pose_within_the_limits(arm: Robot) -> None:
    rng = np.random.default_rng(0)
    lower, upper = arm.limits.lower, arm.limits.upper
    for _ in range(20):
        pose = arm.pose(rng.uniform(lower, upper), TIP)
        posture = solve_ik(arm, TIP, pose, START, starts=40)
        assert posture.found
        np.testing.assert_allclose(
            arm.pose(posture.q, TIP), pose, atol=1e-6
        )  # accuracy 1e-7, as a rotation too
        assert ((posture.q >= lower) & (posture.q <= upper)).all()


def test_out_of_reach_the_nearest_posture_is_found_and_what_lacks_is_said(arm: Robot) -> None:
    pose = pose_at([3.0, 0.0, 0.5]) @ arm.pose(START, TIP)
    posture = solve_ik(arm, TIP, pose, START, starts=3)
    assert not posture.found
    assert 2.0 < posture.distance < 3.0  # [m] the arm is 0.86 m long, and was half stretched
    aim = PoseTarget(arm, TIP, pose)
    assert aim.errors(posture.q) == (
        pytest.approx(posture.distance, abs=1e-9),
        pytest.approx(posture.angle, abs=1e-7),  # an angle by its cosine, near zero
    )
    assert posture.in_words("on the way, 1.00 rad from the goal") == (
        f"out of reach: the nearest posture found is {100 * posture.distance:.1f} cm and "
        f"{np.rad2deg(posture.angle):.0f}° from the pose; on the way, 1.00 rad from there"
    )
    assert IkSolution(START).in_words("arriving") == "arriving"


def test_an_arm_of_seven_joints_comes_to_a_pose_in_seconds(arm: Robot) -> None:
    """20 cm forwards the joints move the hand little: the pull of the pose alone takes over 12 s."""
    system = GeometricSystem([], robot=arm, stiffness=4.0, damping=4.0)
    pose = target(arm)
    aim = PoseTarget(arm, TIP, pose)
    driver = SystemAdapter(system, solve_ik(arm, TIP, pose, START).q, Obstacles.none())
    arrival = Arrival(speed=np.inf, hold=0.0)
    run = run_kinematically(arm, driver, START, aim, 12.0, timestep=0.01, arrival=arrival)
    assert run.time_to_goal is not None
    assert run.time_to_goal < 5.0  # as a configuration: e(t) = (1 + 2 t) exp(-2 t)
    assert aim.errors(START) == (pytest.approx(0.2, abs=1e-9), pytest.approx(0.0, abs=1e-7))
