"""Recordings of short motions of every kind: what a change of the controller's code is compared by."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from time import sleep
from typing import Any

import numpy as np
import numpy.typing as npt

from sidestep._core import (
    Controller,
    ControllerSettings,
    JointGoal,
    Obstacles,
    PoseGoal,
    RealTimeRun,
    ReplayResult,
    SpeedLimitSettings,
    TrackingSettings,
)
from sidestep._core import (
    replay as replay_one,
)
from sidestep.arm import Arm
from sidestep.bench.motion import ControllerMover, MotionSettings
from sidestep.bench.parallel import Progress
from sidestep.bench.problems import ProblemGenerator, ProblemSettings
from sidestep.obstacles import Box, Cylinder, obstacles_from_shapes
from sidestep.robot import Robot

Array = npt.NDArray[np.float64]

FOLDER_VARIABLE = "SIDESTEP_RECORD"  # names the folder in which every controller of a program is recorded
SUFFIX = ".step"
REACH_SECONDS = 2.5  # [s] of a reach problem: most arms are past the obstacles then
RUN_SECONDS = 1.5  # [s] of the other motions
REAL_TIME_STEPS = 2000
SEEN_EVERY = 33  # [steps] between two sets of moving obstacles, as from a camera at 30 Hz
NOISE = 1e-4  # [rad] standard deviation of measured positions, where a run has any

REACH_ROBOTS = ("fr3", "ur10", "iiwa", "xarm7")
SCENARIOS = ("thesis-6.2.2", "thesis-6.2.3", "thesis-6.2.4", "table", "planar-several")


@contextmanager
def recording_to(folder: Path) -> Iterator[None]:
    """Every controller that is made in the block, here and in processes started there, is recorded in the folder."""
    before = os.environ.get(FOLDER_VARIABLE)
    os.environ[FOLDER_VARIABLE] = str(folder)
    try:
        yield
    finally:
        if before is None:
            del os.environ[FOLDER_VARIABLE]
        else:
            os.environ[FOLDER_VARIABLE] = before


@dataclass(frozen=True)
class Case:
    """Something to record.

    Attributes:
        name: of its folder. run: makes controllers and moves them. needs: a package that it cannot do without.
    """

    name: str
    run: Callable[[], None]
    needs: str | None = None


def record_all(
    folder: Path, *, only: Sequence[str] = (), progress: Progress | None = None
) -> tuple[list[Path], list[str]]:
    """Records short motions of every kind.

    Args:
        folder: must be new, or have no recordings.
        only: names of cases to record, see `cases`; all if there are none.
        progress: told of how many are done, of all, and a word about the last one.

    Returns:
        The recordings; and what was left out, with the reason.

    Raises:
        ValueError: an unknown case; the folder has recordings already.
    """
    chosen = cases()
    if unknown := sorted(set(only) - {case.name for case in chosen}):
        raise ValueError(f"no case {unknown[0]!r}; there are: {', '.join(case.name for case in chosen)}")
    if next(folder.rglob(f"*{SUFFIX}"), None) is not None:
        raise ValueError(f"{folder} has recordings already; name a new folder")
    chosen = [case for case in chosen if not only or case.name in only]
    left_out = []
    for done, case in enumerate(chosen):
        if progress is not None:
            progress(done, len(chosen), case.name)
        with recording_to(folder / case.name):
            try:
                case.run()
            except ImportError as error:
                left_out.append(f"{case.name}: {error}")
    if progress is not None:
        progress(len(chosen), len(chosen), "done")
    return sorted(folder.rglob(f"*{SUFFIX}")), left_out


def replay_all(
    paths: Sequence[Path], *, jobs: int, progress: Progress | None = None
) -> list[tuple[Path, ReplayResult]]:
    """Replays recordings, in threads.

    Args:
        paths: of files, or of folders with any below them. jobs: threads.
        progress: told of how many are done, of all, and a word about the last one.

    Raises:
        OSError: one cannot be read. ValueError: one is no recording; there is none.
    """
    files: list[Path] = []
    for path in paths:
        files += sorted(path.rglob(f"*{SUFFIX}")) if path.is_dir() else [path]
    if not files:
        raise ValueError(f"{', '.join(map(str, paths))}: there is no recording (*{SUFFIX})")
    results = []
    with ThreadPoolExecutor(max_workers=jobs) as pool:
        for path, result in zip(files, pool.map(replay_one, files), strict=True):
            results.append((path, result))
            if progress is not None:
                progress(len(results), len(files), f"{path.name}: {'equal' if result.equal else 'not equal'}")
    return results


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
            Case(f"drive-{name}-{output}", partial(_drive, name, output))
            for name in ("fr3", "panda", "ur10")
            for output in ("acceleration", "torque")
        ),
        Case("twist", _twist),
        Case("trajectory", _trajectory),
        Case("moving-goal", _moving_goal),
        Case("position-output", partial(_disturbed, "position")),
        Case("velocity-output", partial(_disturbed, "velocity")),
        Case("noisy-torque", partial(_disturbed, "torque")),
        Case("impedance", _impedance),
        Case("speed-limits", _speed_limits),
        Case("bad-states", _bad_states),
        Case("attach", _attach),
        Case("real-time", _real_time),
        Case("real-time-poses", _real_time_poses),
        Case("real-time-attach", _real_time_attach),
    ]


def _steps(seconds: float, period: float = 0.001) -> int:
    return round(seconds / period)


def _reach(name: str, *, torque: bool = False, poses: bool = False, moving: float = 0.0) -> None:
    """Reach problems as `sidestep bench reach` has them, without its judge."""
    robot, arm = Robot.named(name), Arm.load(name)
    generator = ProblemGenerator(ProblemSettings(robot=name, moving=moving))
    motion = MotionSettings(duration=REACH_SECONDS, torque=torque, poses=poses)
    for index in range(3):
        ControllerMover(robot, arm).move(generator.problem(index), motion)


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


def _drive(name: str, output: str) -> None:
    """Random velocities among 25 balls, of which half move; the state is that of an ideal robot."""
    arm, rng = Arm.load(name), np.random.default_rng(7)
    controller = _controller(arm, output=output)
    nv, q, v = arm.num_coordinates, arm.neutral, np.zeros(arm.num_coordinates)
    velocities = np.where(np.arange(25)[:, None] % 2 == 0, rng.normal(0.0, 0.2, (25, 3)), 0.0)
    points = rng.uniform(-0.9, 0.9, (25, 3)) + np.array([0.0, 0.0, 0.4])
    points = points[np.linalg.norm(points[:, :2], axis=1) > 0.35]
    velocities = velocities[: len(points)]
    limits = np.minimum(arm.robot.limits.velocity, 2.0)
    for k in range(_steps(RUN_SECONDS)):
        if k % 250 == 0:
            controller.set_velocity(rng.uniform(-1.0, 1.0, nv) * limits)
        if k % SEEN_EVERY == 0:
            controller.set_obstacles(
                Obstacles(points + 0.001 * k * velocities, radii=0.06, velocities=velocities)
            )
        q, v = _ideal(controller, q, v)


def _controller(arm: Arm, **settings: Any) -> Controller:
    return Controller(arm, ControllerSettings(synchronous=True, **settings))


def _ideal(controller: Controller, q: Array, v: Array) -> tuple[Array, Array]:
    """State after a step of a robot that does what it is told."""
    command = controller.step(q, v)
    if controller.settings.output.name in ("position", "velocity"):
        return command.position, command.velocity
    v = v + controller.settings.period * command.acceleration
    return q + controller.settings.period * v, v


def _ready() -> tuple[Arm, Array, Array]:
    return Arm.load("fr3"), np.array([0.0, -0.4, 0.0, -2.2, 0.0, 1.9, 0.785]), np.zeros(7)


def _table() -> Obstacles:
    return obstacles_from_shapes([Box((0.6, 0.8, 0.04), pose=_at(0.55, 0.0, 0.1), name="table")])


def _at(x: float, y: float, z: float) -> Array:
    X = np.eye(4)
    X[:3, 3] = x, y, z
    return X


def _twist() -> None:
    arm, q, v = _ready()
    controller = _controller(arm)
    controller.set_obstacles(_table())
    for k in range(_steps(RUN_SECONDS)):
        if k % 100 == 0:
            angle = 0.01 * k
            controller.set_twist(
                "fr3_hand",
                [0.15 * np.cos(angle), 0.15 * np.sin(angle), -0.1, 0.0, 0.3, 0.0],
                local=k % 200 == 0,
            )
        q, v = _ideal(controller, q, v)


def _trajectory() -> None:
    arm, q, v = _ready()
    times = np.linspace(0.2, 1.2, 11)
    rows = q + 0.5 * np.sin(2.0 * times)[:, None] * np.array([1.0, 0.3, 0.0, 0.2, 0.0, 0.0, 1.0])
    for behaviour in ("keep_path", "steer"):
        controller = _controller(arm)
        controller.set_obstacles(_table())
        controller.set_trajectory(rows, times, behaviour)
        at, moving = q, v
        for _ in range(_steps(RUN_SECONDS)):
            at, moving = _ideal(controller, at, moving)


def _moving_goal() -> None:
    arm, q, v = _ready()
    controller = _controller(arm)
    controller.set_obstacles(_table())
    hand = arm.robot.pose(q, "fr3_hand")
    for k in range(_steps(RUN_SECONDS)):
        if k == 0:
            controller.set_goal(JointGoal(q, velocity=np.full(7, 0.1)))
        if k == 500:
            controller.set_goal(PoseGoal(arm.robot, "fr3_hand", hand, twist=[0.1, 0.05, 0.0, 0.0, 0.0, 0.2]))
        if k == 1000:
            controller.clear_goal()
        q, v = _ideal(controller, q, v)


def _disturbed(output: str) -> None:
    """A goal, measured states with noise and one push; with torque the arm's own mass matrix and bias."""
    arm, q, v = _ready()
    controller, rng = _controller(arm, output=output), np.random.default_rng(3)
    controller.set_obstacles(_table())
    controller.set_goal(q + np.array([0.6, 0.2, 0.0, 0.3, 0.0, 0.2, 0.0]))
    for k in range(_steps(RUN_SECONDS)):
        push = 0.02 if 700 <= k < 720 else 0.0
        seen = q + rng.normal(0.0, NOISE, 7) + push
        if output == "torque" and k % 2 == 0:
            command = controller.step(seen, v, arm.mass_matrix(q), arm.bias(q, v))
        else:
            command = controller.step(seen, v)
        if output == "torque":
            v = v + 0.001 * command.acceleration
            q = q + 0.001 * v
        else:
            q, v = command.position, command.velocity


def _impedance() -> None:
    arm, q, v = _ready()
    controller = _controller(arm, output="torque", tracking=TrackingSettings(stiffness=0.5))
    controller.set_goal(q + 0.2)
    for _ in range(_steps(RUN_SECONDS)):
        q, v = _ideal(controller, q, v)


def _speed_limits() -> None:
    arm, q, v = _ready()
    controller = _controller(arm, speed_limits=SpeedLimitSettings())
    controller.set_obstacles(_table())
    controller.set_goal(q + np.array([1.0, 0.3, 0.0, 0.2, 0.0, 0.0, 0.0]))
    for _ in range(_steps(RUN_SECONDS)):
        q, v = _ideal(controller, q, v)


def _bad_states() -> None:
    """Values that are not finite, a leap, and a stale scene."""
    arm, q, v = _ready()
    controller = _controller(arm, obstacle_timeout=0.5)
    controller.set_obstacles(_table())
    controller.set_goal(q + 0.3)
    for k in range(_steps(RUN_SECONDS)):
        if k in (200, 201):
            controller.step(np.full(7, np.nan), v)
        elif k == 300:
            controller.step(q + 0.5, v)
        else:
            q, v = _ideal(controller, q, v)
        if k == 900:
            controller.set_obstacles(_table())


def _attach() -> None:
    """A cup that stands on a table is taken, lifted and let go; then another body."""
    arm, q, v = _ready()
    controller = _controller(arm)
    hand = arm.robot.pose(q, "fr3_hand")
    cup = hand[:3, 3] + 0.12 * hand[:3, 2]
    top = cup[2] - 0.05
    table = Box((0.3, 0.3, 0.04), pose=_at(cup[0], cup[1], top - 0.021), name="table")
    controller.set_obstacles(obstacles_from_shapes([table]))
    lifted = q + np.array([0.0, -0.15, 0.0, 0.25, 0.0, 0.1, 0.0])
    for k in range(_steps(RUN_SECONDS)):
        if k == 100:
            pose = np.linalg.inv(hand) @ _at(*cup)
            controller.attach(
                "cup",
                Cylinder(0.03, 0.1),
                link="fr3_hand",
                pose=pose,
                mass=0.3,
                may_touch=["fr3_leftfinger", "fr3_rightfinger"],
                rests_on=["table"],
            )
        if k == 200:
            controller.set_goal(lifted)
        if k == 1200:
            controller.detach("cup")
        if k == 1300:
            controller.set_arm(arm)
        q, v = _ideal(controller, q, v)


def _run_in_real_time(controller: Controller, q: Array, v: Array, act: Callable[[float], None]) -> None:
    """Steps by the machine's clock, with planner, look-ahead and posture search in their threads."""
    run = RealTimeRun(controller, q, v, steps=REAL_TIME_STEPS)
    seen = 0
    while run.running:
        act(0.033 * seen)
        seen += 1
        sleep(0.033)
    run.finish()


def _real_time() -> None:
    arm, q, v = _ready()
    controller = Controller(arm, ControllerSettings())
    controller.set_goal(q + np.array([1.2, 0.2, 0.0, 0.3, 0.0, 0.0, 0.0]))
    start, way = np.array([0.5, 0.5, 0.4]), np.array([0.0, -0.3, 0.0])
    rest = np.array([[0.5, 0.35, 0.3], [0.45, 0.45, 0.55]])

    def act(time: float) -> None:
        points = np.vstack([rest, start + time * way])
        controller.set_obstacles(Obstacles(points, radii=0.06, velocities=np.vstack([np.zeros((2, 3)), way])))

    _run_in_real_time(controller, q, v, act)


def _real_time_poses() -> None:
    arm, q, v = _ready()
    controller = Controller(arm, ControllerSettings())
    controller.set_obstacles(_table())
    pose = arm.robot.pose(q + np.array([0.8, 0.3, 0.0, 0.4, 0.0, 0.1, 0.0]), "fr3_hand")
    controller.set_goal(PoseGoal(arm.robot, "fr3_hand", pose))
    _run_in_real_time(controller, q, v, lambda _: None)


def _real_time_attach() -> None:
    arm, q, v = _ready()
    controller = Controller(arm, ControllerSettings())
    controller.set_obstacles(_table())
    controller.set_goal(q + np.array([0.8, 0.0, 0.0, 0.2, 0.0, 0.0, 0.0]))
    held = [False]

    def act(time: float) -> None:
        if time > 0.5 and not held[0]:
            held[0] = True
            controller.attach(
                "rod",
                Cylinder(0.02, 0.2),
                link="fr3_hand",
                pose=_at(0.0, 0.0, 0.2),
                mass=0.2,
                may_touch=["fr3_leftfinger", "fr3_rightfinger"],
            )
            controller.set_goal(q + np.array([0.3, 0.0, 0.0, 0.2, 0.0, 0.0, 0.0]))

    _run_in_real_time(controller, q, v, act)
