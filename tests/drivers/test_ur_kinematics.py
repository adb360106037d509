"""Whether a robot and an arm are the same."""

import numpy as np
import pytest

from sidestep import Arm
from sidestep.drivers.ur_kinematics import check_kinematics
from sidestep.drivers.ur_stand_in.tip import tip_pose


@pytest.fixture(scope="module")
def arm() -> Arm:
    return Arm.load("ur5")


def test_a_robot_with_its_own_calibration_agrees(arm: Arm) -> None:
    rng = np.random.default_rng(7)

    def flange_at(posture: list[float]) -> list[float]:
        pose = tip_pose(arm, np.array(posture))
        pose[:3] += rng.uniform(-0.003, 0.003, size=3)  # [m] as calibrations differ
        return list(pose)

    check_kinematics(flange_at, arm.robot, 0.01)
    with pytest.raises(ValueError, match=r"the arm 'ur5' at \[.*\] m: it is another arm"):
        check_kinematics(flange_at, arm.robot, 0.001)


def test_an_e_series_is_another_arm(arm: Arm) -> None:
    """A UR5e's base is 73 mm higher than a UR5's: d1 is 0.1625 and 0.089159 m."""

    def flange_at(posture: list[float]) -> list[float]:
        return list(tip_pose(arm, np.array(posture)) + 0.0733 * np.eye(6)[2])

    with pytest.raises(ValueError, match="the shipped ur5 and ur10 are of the CB3 series"):
        check_kinematics(flange_at, arm.robot, 0.01)


def test_an_arm_without_the_links_of_a_ur_says_so() -> None:
    with pytest.raises(ValueError, match=r"arm 'planar3' lacks \['tool0'\]"):
        check_kinematics(lambda posture: [0.0] * 6, Arm.load("planar3").robot, 0.01)
