"""What one control step costs: the thesis's Table 6.1, the whole arm and the whole controller among clouds."""

from __future__ import annotations

import platform
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

try:
    import resource
except ImportError:  # not on Windows
    resource = None  # type: ignore[assignment]

import sidestep
from sidestep._core import (
    CollisionDensity,
    Controller,
    ControllerSettings,
    GeometricSystem,
    Obstacles,
    RigidBodyDynamics,
    instruction_set,
    integrate,
    multiply_add_rate,
    rollout,
)
from sidestep.arm import Arm
from sidestep.bench.methods import barrier_system
from sidestep.bench.step_scenes import table_cloud, uniform_cloud
from sidestep.bench.step_times import StepTimes
from sidestep.body import Body
from sidestep.robot import Robot

Array = npt.NDArray[np.float64]
_State = tuple[Array, Array]  # q, v

TABLE_ROBOTS = ("planar2", "planar3", "fr3_arm")  # 2, 3 and 7 joints
POINTS = (1, 100, 1_000, 10_000, 100_000)
MOTION = 1_000  # steps towards one goal before the next; 1 s
CLEARANCE = 0.03  # [m] of goals from every point, of the covering body
TRIES = 30  # goals that are drawn before the best of them is taken
DENSE_POINTS = 1_000  # of the kernel that leaves nothing out
DENSE_CALLS = 20  # fewest
LONG = 1_000_000  # [ns] between two readings of the clock
WARM_UP = 0.1  # share of the steps that run before those that count


@dataclass(frozen=True)
class StepSettings:
    """How long each row is measured.

    Attributes:
        steps: that are timed, unless `seconds` [s] are over before. robot: of the rows with a whole body.
        points: numbers of points of these rows. seed: of states, goals and points.
    """

    steps: int = 1_000_000
    seconds: float = 10.0
    robot: str = "fr3"
    points: tuple[int, ...] = POINTS
    seed: int = 0

    def __post_init__(self) -> None:
        if self.steps < 1:
            raise ValueError(f"steps is {self.steps}, must be at least 1")
        if not self.seconds > 0.0:
            raise ValueError(f"seconds is {self.seconds}, must be positive")
        if not self.points or min(self.points) < 1:
            raise ValueError(f"points is {self.points}, must be one or more positive numbers")


def run_step_bench(
    settings: StepSettings, *, progress: Callable[[int, int, str], None] | None = None
) -> dict[str, Any]:
    """Times every row and returns a document for JSON.

    Times in C++ are taken around each step of a rollout, with 30 to 50 ns for the clock; those from Python around
    the call and the reading of its result. An arm with a covering body starts and is drawn to where it has 3 cm of
    clearance to points and to itself (and 0.03 rad to joint limits); only where no such place is found, as among
    many points all around it, to the best of what was drawn.

    Rows of a controller are of all that its step does beside planner and look-ahead, whose threads are not the step's:
    system, escape from local minima, room at the goal, and a program for torque, or for acceleration.
    Mass matrix and bias, which torque needs, have a row of their own.

    A step is as long as the clock says, whatever else the machine did meanwhile: `max_us`. `interruptions` says how
    often the system gave the core to another program, and `undisturbed_max_us` is the longest step of the motions
    during which it did not; null where the system does not tell. What a virtual machine or the firmware takes, no
    system tells: `idle` says how long a loop is held up that only reads the clock, see `held_up`.
    """
    rows = list(_rows(settings))
    results = []
    for k, row in enumerate(rows):
        if progress is not None:
            progress(k, len(rows), row.name)
        results.append(row.measure(settings))
    return {
        "benchmark": "step",
        "version": sidestep.__version__,
        "cpu": cpu_model(),
        "instruction_set": instruction_set(),
        "python": platform.python_version(),
        "steps": settings.steps,
        "seconds": settings.seconds,
        "results": results,
        "idle": held_up(max(row["steps"] / row["steps_per_s"] for row in results)),
        "dense": _dense_kernel(settings),
    }


def _dense_kernel(settings: StepSettings) -> dict[str, Any]:
    """The density of every Gaussian at every point, and what one core does when it only multiplies and adds."""
    robot = Robot.named(settings.robot)
    body = Body.cover(robot)
    density = CollisionDensity(robot, body)
    rng = np.random.default_rng(settings.seed)
    obstacles = Obstacles(rng.uniform(-0.5, 0.5, (DENSE_POINTS, 3)))
    q, v = robot.random_configuration(rng), rng.normal(size=robot.num_coordinates)
    peak = multiply_add_rate()
    moving = {frame.name for frame in robot.frames if frame.joint >= 0}
    gaussians = sum(link in moving for link in body.links)
    seconds: list[float] = []
    end = time.perf_counter() + 0.1 * settings.seconds
    while len(seconds) < DENSE_CALLS or time.perf_counter() < end:
        start = time.perf_counter_ns()
        density.evaluate(q, v, obstacles)
        seconds.append(1e-9 * (time.perf_counter_ns() - start))
    peak = max(peak, multiply_add_rate())
    per_pair = float(np.median(seconds)) / (gaussians * DENSE_POINTS)
    rate = CollisionDensity.operations_per_pair / per_pair
    return {
        "gaussians": gaussians,
        "points": DENSE_POINTS,
        "pair_ns": 1e9 * per_pair,
        "operations_per_pair": CollisionDensity.operations_per_pair,
        "operations_per_s": rate,
        "multiply_add_per_s": peak,
        "share_of_peak": rate / peak,
    }


def compare_steps(before: dict[str, Any], after: dict[str, Any]) -> list[dict[str, Any]]:
    """The rows that two documents share, each with its medians [us] and their ratio after/before.

    Raises:
        ValueError: if a document is none of `run_step_bench`, or they share no row.
    """
    for document in (before, after):
        if document.get("benchmark") != "step" or not isinstance(document.get("results"), list):
            raise ValueError("not a result of `sidestep bench step`")
    old = {(row["name"], row["language"]): row for row in before["results"]}
    shared = [row for row in after["results"] if (row["name"], row["language"]) in old]
    if not shared:
        raise ValueError("the two results share no row")
    return [
        {
            "name": row["name"],
            "language": row["language"],
            "before_us": old[row["name"], row["language"]]["median_us"],
            "after_us": row["median_us"],
            "ratio": row["median_us"] / old[row["name"], row["language"]]["median_us"],
        }
        for row in shared
    ]


def interruptions() -> int | None:
    """How often the core was taken away from this thread so far; None where the system does not tell."""
    if resource is None or not hasattr(resource, "RUSAGE_THREAD"):
        return None
    return resource.getrusage(resource.RUSAGE_THREAD).ru_nivcsw


def held_up(seconds: float, clock: Callable[[], int] = time.perf_counter_ns) -> dict[str, float]:
    """Reads the clock [ns] over and over, and returns the longest time between two readings [us] and how many were
    longer than 1 ms: what any program on this machine has to expect."""
    longest, above, start = 0, 0, clock()
    last, end = start, start + round(1e9 * seconds)
    while last < end:
        now = clock()
        if now - last > longest:
            longest = now - last
        if now - last > LONG:
            above += 1
        last = now
    return {"seconds": 1e-9 * (last - start), "longest_us": 1e-3 * longest, "above_1ms": above}


def cpu_model() -> str:
    """Model name of the processor, from the kernel."""
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        return platform.processor() or "unknown"
    return next((line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")), "unknown")


def one_gaussian_per_joint(robot: Robot) -> Body:
    """By hand: a ball of 8 cm on the first link of every joint."""
    links = [next(f.name for f in robot.frames if f.joint == j) for j in range(len(robot.joints))]
    num = len(links)
    covariances = np.tile(0.08**2 * np.eye(3), (num, 1, 1))
    return Body(links=links, weights=np.ones(num), means=np.zeros((num, 3)), covariances=covariances)


@dataclass(frozen=True)
class _Row:
    name: str
    robot: Robot
    system: GeometricSystem
    obstacles: Obstacles
    num_components: int
    python: bool

    def measure(self, settings: StepSettings) -> dict[str, Any]:
        times, total, end = StepTimes(), 0.0, time.perf_counter() + settings.seconds
        interrupted, undisturbed = 0, 0.0
        rng = np.random.default_rng(settings.seed)
        q = self._goal(rng)
        run = self._from_python if self.python else self._from_cpp
        steps = min(MOTION, settings.steps)
        state, _ = run((q, np.zeros_like(q)), self._goal(rng), max(1, round(WARM_UP * steps)))
        while times.total < settings.steps and (times.total == 0 or time.perf_counter() < end):
            goal, before = self._goal(rng), interruptions()
            state, seconds = run(state, goal, steps)
            after = interruptions()
            if before is not None and after is not None:
                interrupted += after - before
                undisturbed = max(undisturbed, float(seconds.max()) if after == before else 0.0)
            times.add(seconds)
            total += float(seconds.sum())
        return {
            "name": self.name,
            "language": "Python" if self.python else "C++",
            "robot": self.robot.name,
            "joints": self.robot.num_coordinates,
            "gaussians": self.num_components,
            "points": len(self.obstacles.points),
            "steps": times.total,
            **{f"{name}_us": value for name, value in times.microseconds().items()},
            "undisturbed_max_us": round(1e6 * undisturbed, 3) if undisturbed > 0.0 else None,
            "interruptions": interrupted if interruptions() is not None else None,
            "steps_per_s": times.total / total,
        }

    def _goal(self, rng: np.random.Generator) -> Array:
        return clear_place(self.robot, self.system, self.obstacles, rng)

    def _from_cpp(self, state: _State, goal: Array, steps: int) -> tuple[_State, Array]:
        moved = rollout(
            self.system,
            *self._at_rest(state),
            goal,
            self.obstacles,
            steps=steps,
            time_steps=True,
        )
        return (moved.q[-1], moved.v[-1]), moved.step_seconds

    def _from_python(self, state: _State, goal: Array, steps: int) -> tuple[_State, Array]:
        moved = rollout(self.system, *self._at_rest(state), goal, self.obstacles, steps=steps)
        seconds = np.empty(steps)
        for k in range(steps):
            start = time.perf_counter_ns()
            step = self.system.acceleration(moved.q[k], moved.v[k], goal, self.obstacles)
            _ = step.acceleration
            seconds[k] = 1e-9 * (time.perf_counter_ns() - start)
        return (moved.q[-1], moved.v[-1]), seconds

    def _at_rest(self, state: _State) -> _State:
        """Without the filter nothing keeps the limits: the next motion begins at rest, within them."""
        q, v = state
        return np.clip(q, self.robot.limits.lower, self.robot.limits.upper), np.zeros_like(v)


@dataclass(frozen=True)
class _ControllerRow(_Row):
    arm: Arm
    output: str

    @cached_property
    def _controller(self) -> Controller:
        settings = ControllerSettings(planner=None, look_ahead=None, synchronous=True, output=self.output)
        controller = Controller(self.arm, settings)
        controller.set_obstacles(self.obstacles, valid_for=np.inf)
        return controller

    def _from_cpp(self, state: _State, goal: Array, steps: int) -> tuple[_State, Array]:
        self._controller.set_goal(goal)
        moved = integrate(self._controller, *state, steps=steps)
        return (moved.last_q, moved.last_v), moved.step_seconds


@dataclass(frozen=True)
class _DynamicsRow(_Row):
    dynamics: RigidBodyDynamics

    def _from_cpp(self, state: _State, goal: Array, steps: int) -> tuple[_State, Array]:
        q, v = state
        return (goal, v), self.dynamics.call_seconds(q, goal - q, calls=steps)


def clearance_at(q: Array, system: GeometricSystem, obstacles: Obstacles) -> float:
    """The smallest [m] of those with barriers, to the links themselves and joint limits too; inf without any."""
    step = system.acceleration(q, np.zeros_like(q), q, obstacles)
    return float(step.clearances.values.min(initial=np.inf))


def clear_place(
    robot: Robot, system: GeometricSystem, obstacles: Obstacles, rng: np.random.Generator
) -> Array:
    """A random configuration with 3 cm of clearance, or the one of 30 with the largest."""
    best, most = robot.neutral, -np.inf
    for _ in range(TRIES):
        q = robot.random_configuration(rng)
        clearance = clearance_at(q, system, obstacles)
        if clearance >= CLEARANCE:
            return q
        if clearance > most:
            best, most = q, clearance
    return best


def _rows(settings: StepSettings) -> Iterator[_Row]:
    for name in TABLE_ROBOTS:
        robot = Robot.named(name)
        body = one_gaussian_per_joint(robot)
        system = GeometricSystem([CollisionDensity(robot, body)])
        for python in (False, True):
            yield _Row(
                f"Table 6.1, {robot.num_coordinates} joints",
                robot,
                system,
                Obstacles([[0.4, 0.1, 0.3]]),
                len(body.links),
                python,
            )
    robot = Robot.named(settings.robot)
    arm = Arm.from_robot(robot)
    ellipsoids, system = len(arm.body.links), barrier_system(robot, arm.body)
    for shape, cloud in (("uniform", uniform_cloud), ("table", table_cloud)):
        for num in settings.points:
            obstacles = cloud(num, np.random.default_rng(settings.seed))
            name = f"{robot.name}, {num} points, {shape}"
            scene = (robot, system, obstacles, ellipsoids)
            yield _Row(f"{name}, without filter", *scene, False)
            yield _ControllerRow(f"{name}, controller", *scene, False, arm, "automatic")
            yield _ControllerRow(f"{name}, controller, acceleration", *scene, False, arm, "acceleration")
            yield _Row(f"{name}, without filter", *scene, True)
    if arm.has_dynamics:
        dynamics = RigidBodyDynamics(robot, arm.inertials)
        none = Obstacles.none()
        yield _DynamicsRow(
            f"{robot.name}, mass matrix and bias", robot, system, none, ellipsoids, False, dynamics
        )
