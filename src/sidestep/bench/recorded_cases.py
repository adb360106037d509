"""What is recorded: a short motion of every kind."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

from sidestep.arm import Arm
from sidestep.bench import recorded_motions as motions
from sidestep.bench import recorded_real_time as real_time
from sidestep.bench.motion import ControllerRunner, MotionSettings
from sidestep.bench.problems import ProblemGenerator, ProblemSettings
from sidestep.robot import Robot

REACH_SECONDS = 2.5  # [s] of a reach problem: most arms are past the obstacles then

REACH_ROBOTS = ("fr3", "ur10", "iiwa", "xarm7")
SCENARIOS = ("thesis-6.2.2", "thesis-6.2.3", "thesis-6.2.4", "table", "planar-several")


@dataclass(frozen=True)
class Case:
    """Something to record.

    Attributes:
        name: of its folder. run: makes controllers and moves them.
    """

    name: str
    run: Callable[[], None]


def cases() -> list[Case]:
    """All there are: reach problems, poses, what moves, scenarios, inputs, outputs, held objects, real time."""
    reach = [Case(f"reach-{name}", partial(_reach, name)) for name in REACH_ROBOTS]
    return [
        *reach,
        Case("reach-torque", partial(_reach, "fr3", torque=True)),
        Case("reach-poses", partial(_reach, "fr3", poses=True)),
        Case("reach-moving", partial(_reach, "fr3", moving=0.2)),
        Case("dynamic", _dynamic),
        *(Case(name, partial(_scenario, name)) for name in SCENARIOS),
        *(
            Case(f"drive-{name}-{output}", partial(motions.drive, name, output))
            for name in ("fr3", "panda", "ur10")
            for output in ("acceleration", "torque")
        ),
        Case("twist", motions.twist),
        Case("trajectory", motions.trajectory),
        Case("moving-goal", motions.moving_goal),
        Case("position-output", partial(motions.disturbed, "position")),
        Case("velocity-output", partial(motions.disturbed, "velocity")),
        Case("noisy-torque", partial(motions.disturbed, "torque")),
        Case("impedance", motions.impedance),
        Case("speed-limits", motions.speed_limits),
        Case("bad-states", motions.bad_states),
        Case("attach", motions.attach),
        Case("real-time", real_time.among_balls),
        Case("real-time-poses", real_time.to_a_pose),
        Case("real-time-attach", real_time.with_a_held_object),
    ]


def _reach(name: str, *, torque: bool = False, poses: bool = False, moving: float = 0.0) -> None:
    """Reach problems as `sidestep bench reach` has them, without its judge."""
    robot, arm = Robot.named(name), Arm.load(name)
    generator = ProblemGenerator(ProblemSettings(robot=name, moving=moving))
    motion = MotionSettings(duration=REACH_SECONDS, torque=torque, poses=poses)
    for index in range(3):
        ControllerRunner(robot, arm).move(generator.problem(index), motion)


def _dynamic() -> None:
    """One problem of each kind of `sidestep bench dynamic`."""
    from sidestep.bench.dynamic import run_dynamic
    from sidestep.bench.scenes import SceneSettings

    run_dynamic(SceneSettings(robot="fr3", motion=MotionSettings(duration=REACH_SECONDS)), count=1)


def _scenario(name: str) -> None:
    from dataclasses import replace

    from sidestep.scenario import Scenario, run_scenario

    scenario = Scenario.load(name)
    simulation = replace(scenario.simulation, mode="kinematic", duration=REACH_SECONDS)
    run_scenario(replace(scenario, method="controller", simulation=simulation))
