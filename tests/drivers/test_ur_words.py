"""What a UR says of itself, in words."""

import numpy as np
import pytest

from sidestep import Arm
from sidestep.drivers.ur_words import FREEDRIVE, JOINTS, PROGRAM_RUNNING, SHIPPED, Status, limits_of


@pytest.mark.parametrize(
    ("status", "words"),
    [
        (Status(safety=1, mode=7, bits=PROGRAM_RUNNING), ""),
        (Status(safety=2, mode=7, bits=0), ""),  # reduced: slower, but it moves
        (
            Status(safety=3, mode=7, bits=0),
            "safety mode 3: PROTECTIVE_STOP; find out why, then call recover()",
        ),
        (Status(safety=5, mode=7, bits=0), "safety mode 5: SAFEGUARD_STOP; it ends at the safeguard"),
        (Status(safety=99, mode=7, bits=0), "safety mode 99: unknown"),
        (Status(safety=1, mode=5, bits=0), "robot mode 5: IDLE; switch on and release the brakes"),
        (Status(safety=1, mode=7, bits=FREEDRIVE), "the freedrive button is pressed"),
    ],
)
def test_why_it_rests(status: Status, words: str) -> None:
    assert status.why_it_rests() == words


def test_whether_a_program_runs() -> None:
    assert Status(1, 7, PROGRAM_RUNNING).is_running_a_program
    assert not Status(1, 7, FREEDRIVE).is_running_a_program


@pytest.mark.parametrize(("model", "name"), SHIPPED.items())
def test_shipped_arms_are_within_what_the_robot_permits(model: str, name: str) -> None:
    arm, robot = Arm.load(name), limits_of(model)
    assert robot is not None
    assert tuple(arm.robot.coordinate_names) == JOINTS
    assert (arm.limits.velocity <= robot.velocity).all()
    assert (arm.limits.upper <= robot.upper + 1e-9).all()
    assert (arm.limits.effort <= robot.effort).all()


def test_limits_are_those_of_the_safety_system() -> None:
    limits = limits_of("UR10")
    assert limits is not None
    np.testing.assert_allclose(np.degrees(limits.velocity), [131, 131, 191, 191, 191, 191])
    assert limits_of("UR20") is None
