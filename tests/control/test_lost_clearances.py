"""Arms that start in contact: folded into themselves, or inside a ball."""

from typing import Any

import numpy as np
import pytest

import sidestep as ss
from sidestep._core import ProgramStatus, program_status
from sidestep.control import Clearances, MotionProgram

PERIOD = 0.001
FOLDED = {  # of a UR10, two links 15 cm inside each other
    "a way out": [-5.86, -2.74, 3.13, -1.49, 4.09, 4.55],
    "none": [0.68, 5.35, -3.13, -4.24, 2.77, -1.33],
}
FALLBACKS = {ProgramStatus.fallback_solver, ProgramStatus.fallback_invalid_input}
HARMLESS = {
    ProgramStatus.ok,
    ProgramStatus.limited,
    ProgramStatus.relaxed,
    ProgramStatus.relaxed_safety,
}


class Motion:
    """What a controller's commands do to an arm, state by state; the status is checked against the clearance."""

    def __init__(self, controller: ss.Controller, robot: ss.Robot, q: np.ndarray, steps: int) -> None:
        limits = robot.limits
        v = np.zeros(len(q))
        self.clearances = np.empty(steps)
        self.speeds, self.accelerations = np.empty(steps), np.empty(steps)
        self.programs: set[ProgramStatus] = set()
        self.overrun = 0.0
        for k in range(steps):
            command = controller.step(q, v)
            if command.clearance < 0.0:
                assert program_status(controller) not in HARMLESS, (k, command.clearance)
                assert command.status == ss.SafetyStatus.clearance_lost
            v = v + PERIOD * command.acceleration
            q = q + PERIOD * v
            self.clearances[k] = command.clearance
            self.speeds[k] = np.abs(v).max()
            self.accelerations[k] = np.abs(command.acceleration).max()
            self.overrun = max(self.overrun, np.max(np.abs(v) / limits.velocity))
            self.programs.add(program_status(controller))
        assert not self.programs & FALLBACKS


@pytest.mark.parametrize("output", ["torque", "acceleration"])
@pytest.mark.parametrize("start", FOLDED)
def test_an_arm_folded_into_itself_gets_out_or_comes_to_rest(start: str, output: str) -> None:
    arm = ss.Arm.load("ur10")
    settings = ss.ControllerSettings(synchronous=True, output=output)
    controller = ss.Controller(arm, settings)
    controller.set_obstacles(ss.Obstacles.none())
    motion = Motion(controller, ss.Robot.named("ur10"), np.array(FOLDED[start]), 3000)
    allowed = settings.velocity_overrun if output == "torque" else 1.0
    assert motion.clearances[0] < -0.14
    assert motion.overrun <= allowed * (1.0 + 1e-6)
    if start == "a way out":
        assert motion.clearances[-1] > 0.005
    else:
        assert motion.clearances[-1] > motion.clearances[0]
    assert motion.speeds[-500:].max() < 0.05
    assert motion.accelerations[-500:].max() < 0.5


@pytest.mark.parametrize("output", ["torque", "acceleration"])
@pytest.mark.parametrize(("link", "gets_out"), [("fr3_rightfinger", True), ("fr3_link4", False)])
def test_an_arm_engulfed_by_a_ball_gets_out_or_comes_to_rest(link: str, gets_out: bool, output: str) -> None:
    """40 cm around the hand, of which it can move out, or around an elbow that cannot leave."""
    arm, robot = ss.Arm.load("fr3"), ss.Robot.named("fr3")
    at = robot.pose(robot.neutral, link)[:3, 3]
    engulfed = ss.Controller(arm, ss.ControllerSettings(synchronous=True, output=output))
    engulfed.set_obstacles(ss.Obstacles([at], [0.4]))
    motion = Motion(engulfed, robot, robot.neutral, 4000)
    assert motion.clearances[0] < -0.4
    if gets_out:
        assert motion.clearances[-1] > 0.0
    else:
        assert motion.clearances[-1] > motion.clearances[0]
    assert motion.speeds[-500:].max() < 0.05
    assert motion.accelerations[-500:].max() < 0.5


def test_a_clearance_that_no_joint_changes_is_told() -> None:
    robot = ss.Robot.named("planar3")
    lost = Clearances(values=[-1.0], rates=[0.0], curvatures=[0.0], gradients=np.zeros((1, 3)), nearest=[4])
    zero = np.zeros(3)
    for solution in (
        MotionProgram(robot, by_torque=False).solve(zero, zero, zero, clearances=lost),
        MotionProgram(robot).solve(zero, zero, zero, np.eye(3), zero, clearances=lost),
    ):
        assert solution.status == ProgramStatus.clearance_lost
        assert (solution.least_clearance, solution.least_coordinate, solution.least_nearest) == (-1.0, 0, 4)


def test_a_way_out_comes_before_the_margins_of_others() -> None:
    """Of a Puma: two links 2.3 mm inside each other; two others, 1.4 mm apart, come 12 mm/rad nearer as these part."""
    robot = ss.Robot.named("planar3")
    zero = np.zeros(3)

    def lost(depth: float, other: float, margin: float) -> Clearances:
        gradients = np.array([[0.469, 0.0, 0.0], [-0.012, 0.0, 0.0]])
        values, margins = [-depth, other], [margin, margin]
        rest: dict[str, Any] = {"rates": [0.0] * 2, "curvatures": [0.0] * 2, "nearest": [0, 1]}
        return Clearances(values=values, gradients=gradients, margins=margins, **rest)

    # Unless it is about to be lost in its turn, or is seen: then its margin covers errors.
    for other, margin, sign in ((0.0014, 0.025, 1.0), (0.0002, 0.025, -1.0), (0.0014, np.inf, -1.0)):
        clearances = lost(0.0023, other, margin)
        filtered = MotionProgram(robot, by_torque=False).solve(zero, zero, zero, clearances=clearances)
        solved = MotionProgram(robot).solve(zero, zero, zero, np.eye(3), zero, clearances=clearances)
        assert filtered.status == solved.status == ProgramStatus.clearance_lost
        assert sign * filtered.acceleration[0] > 1.0
        assert sign * solved.acceleration[0] > 1.0
