"""What solvers of quadratic programs take for those of an arm that passes obstacles, on one core, in one run."""

from __future__ import annotations

import importlib.util
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

import sidestep
from sidestep._core import (
    Controller,
    ControllerSettings,
    MotionProgram,
    Obstacles,
    QuadraticProgram,
    QuadraticProgramData,
    QuadraticProgramStatus,
    integrate,
)
from sidestep.arm import Arm
from sidestep.bench.step import MOTION, clear_place, cpu_model
from sidestep.bench.step_scenes import table_cloud
from sidestep.robot import Robot

Array = npt.NDArray[np.float64]

POINTS = 10_000  # of the table
EVERY = 10  # states of a motion whose program is taken: neighbours are alike
WARM_UP = 20  # programs that are solved before those that count
ACCURACY = 1e-9  # asked of solvers that iterate towards the minimiser
AGREEMENT = 1e-5  # of minimisers, relative to the largest entry and 1 rad/s²


@dataclass(frozen=True)
class QuadraticProgramSettings:
    """How many programs are solved.

    Attributes:
        programs: number of them, taken from motions of the robot. robot: a name. seed: of places, goals and points.

    Raises:
        ValueError: programs is not positive.
    """

    programs: int = 5_000
    robot: str = "fr3"
    seed: int = 0

    def __post_init__(self) -> None:
        if self.programs < 1:
            raise ValueError(f"programs is {self.programs}, must be at least 1")


@dataclass(frozen=True)
class _Solver:
    """solve(program) gives the minimiser, None if it says that there is none, and its time [s] as it measures it."""

    name: str
    method: str
    module: str | None
    solve: Callable[[QuadraticProgramData], tuple[Array | None, float]]


def run_quadratic_programs(
    settings: QuadraticProgramSettings, *, progress: Callable[[str], None] | None = None
) -> dict[str, Any]:
    """Takes programs from motions, lets every solver solve each of them, and returns a document for JSON.

    The programs are those of `MotionProgram` while the arm moves between random places above a table. All solvers
    start anew at each: from what the last one left to the solution of the next is not measured. Times are what the
    solvers measure themselves, in compiled code, the setting up of their data included. Where a solver's result is not
    the core's within 1e-5 it counts as wrong, not as quick.
    """
    say = progress or (lambda name: None)
    say("motions")
    programs = _programs(settings)
    constrained = np.array([_core(program)[2] > 0 for program in programs])
    reference = [_core(program)[0] for program in programs]
    rows: list[dict[str, Any]] = []
    for solver in _SOLVERS:
        say(solver.name)
        if solver.module is not None and importlib.util.find_spec(solver.module) is None:
            rows.append(
                {"name": solver.name, "method": solver.method, "missing": f"{solver.module} is not installed"}
            )
            continue
        rows.append(
            {
                "name": solver.name,
                "method": solver.method,
                **_measure(solver, programs, reference, constrained),
            }
        )
    for row in rows:
        if "missing" not in row:
            row["times_slower"] = row["constrained"]["median_us"] / rows[0]["constrained"]["median_us"]
    return {
        "benchmark": "quadratic programs",
        "version": sidestep.__version__,
        "cpu": cpu_model(),
        "robot": settings.robot,
        "points": POINTS,
        "programs": len(programs),
        "constrained": int(constrained.sum()),
        "rows_median": float(np.median([len(program.row_lower) for program in programs])),
        "rows_most": max(len(program.row_lower) for program in programs),
        "step_median_us": 1e6 * float(np.median(_step_seconds(settings))),
        "rows": rows,
    }


def _measure(
    solver: _Solver,
    programs: list[QuadraticProgramData],
    reference: list[Array | None],
    constrained: npt.NDArray[np.bool_],
) -> dict[str, Any]:
    for program in programs[:WARM_UP]:
        solver.solve(program)
    seconds, wrong = np.empty(len(programs)), 0
    for k, (program, expected) in enumerate(zip(programs, reference, strict=True)):
        found, seconds[k] = solver.solve(program)
        if (found is None) != (expected is None):
            wrong += 1
        elif found is not None and expected is not None:
            wrong += bool(np.abs(found - expected).max() > AGREEMENT * (1.0 + np.abs(expected).max()))
    return {
        "wrong": wrong,
        **{
            name: {
                f"{column}_us": 1e6 * float(np.percentile(part, percent))
                for column, percent in (("median", 50), ("p99", 99), ("max", 100))
            }
            for name, part in (("all", seconds), ("constrained", seconds[constrained]))
        },
    }


def _programs(settings: QuadraticProgramSettings) -> list[QuadraticProgramData]:
    """Of every tenth state; at least one is held by a clearance or a limit."""
    robot, controller, obstacles, rng = _scene(settings)
    system, filter = controller.system, MotionProgram(robot, by_torque=False)
    programs: list[QuadraticProgramData] = []
    q = clear_place(robot, system, obstacles, rng)
    constrained = False
    while len(programs) < settings.programs or not constrained:
        goal = clear_place(robot, system, obstacles, rng)
        controller.set_goal(goal)
        moved = integrate(controller, q, np.zeros_like(q), steps=MOTION)
        for k in range(0, MOTION, EVERY):
            step = system.acceleration(moved.q[k], moved.v[k], goal, obstacles)
            filter.solve(moved.q[k], moved.v[k], step.acceleration, clearances=step)
            programs.append(filter.program)
            constrained = constrained or _core(programs[-1])[2] > 0
        q = np.clip(moved.last_q, robot.limits.lower, robot.limits.upper)
    return programs


def _step_seconds(settings: QuadraticProgramSettings) -> Array:
    """Of whole steps of the controller, in C++, between places like those of the programs."""
    robot, controller, obstacles, rng = _scene(settings)
    q, goal = (clear_place(robot, controller.system, obstacles, rng) for _ in range(2))
    controller.set_goal(goal)
    return integrate(controller, q, np.zeros_like(q), steps=MOTION).step_seconds


def _scene(
    settings: QuadraticProgramSettings,
) -> tuple[Robot, Controller, Obstacles, np.random.Generator]:
    robot = Robot.named(settings.robot)
    rng = np.random.default_rng(settings.seed)
    obstacles = table_cloud(POINTS, rng)
    controller = Controller(
        Arm.from_robot(robot),
        ControllerSettings(planner=None, look_ahead=None, synchronous=True, output="acceleration"),
    )
    controller.set_obstacles(obstacles, valid_for=np.inf)
    return robot, controller, obstacles, rng


def _core(program: QuadraticProgramData) -> tuple[Array | None, float, int]:
    """Minimiser, time [s] and how many constraints were added or dropped."""
    solution = QuadraticProgram(len(program.g), len(program.row_lower)).solve(
        program.H,
        program.g,
        lower=program.lower,
        upper=program.upper,
        A=program.A,
        row_lower=program.row_lower,
        row_upper=program.row_upper,
    )
    solved = solution.status == QuadraticProgramStatus.solved
    return solution.x if solved else None, solution.seconds, solution.iterations


def _by_core(program: QuadraticProgramData) -> tuple[Array | None, float]:
    return _core(program)[:2]


def _by_daqp(program: QuadraticProgramData) -> tuple[Array | None, float]:
    import daqp

    x, _, status, info = daqp.solve(
        program.H,
        program.g,
        program.A,
        np.concatenate([program.upper, program.row_upper]),
        np.concatenate([program.lower, program.row_lower]),
        np.zeros(len(program.g) + len(program.row_lower), dtype=np.intc),
    )
    return (np.asarray(x) if status == 1 else None), info["setup_time"] + info["solve_time"]


def _by_piqp(program: QuadraticProgramData) -> tuple[Array | None, float]:
    import piqp

    solver = piqp.DenseSolver()
    solver.settings.compute_timings = True
    solver.settings.eps_abs = solver.settings.eps_rel = ACCURACY
    bounded = len(program.row_lower) > 0
    rows = (
        (np.asfortranarray(program.A), program.row_lower, program.row_upper)
        if bounded
        else (None, None, None)
    )
    solver.setup(np.asfortranarray(program.H), program.g, None, None, *rows, program.lower, program.upper)
    status = solver.solve()
    info = solver.result.info
    solved = status == piqp.PIQP_SOLVED
    return (np.array(solver.result.x) if solved else None), info.setup_time + info.solve_time


def _by_proxqp(program: QuadraticProgramData) -> tuple[Array | None, float]:
    from proxsuite import proxqp

    n, m = len(program.g), len(program.row_lower)
    solver = proxqp.dense.QP(n, 0, m, True)
    solver.settings.compute_timings = True
    solver.settings.eps_abs, solver.settings.eps_rel = ACCURACY, 0.0
    rows = (program.A, program.row_lower, program.row_upper) if m else (None, None, None)
    solver.init(program.H, program.g, None, None, *rows, program.lower, program.upper)
    solver.solve()
    info = solver.results.info
    solved = info.status == proxqp.QPSolverOutput.PROXQP_SOLVED
    return (np.array(solver.results.x) if solved else None), 1e-6 * (info.setup_time + info.solve_time)


_SOLVERS = (
    _Solver("Sidestep", "dual active set, exact", None, _by_core),
    _Solver("DAQP", "dual active set", "daqp", _by_daqp),
    _Solver("PIQP", "interior point", "piqp", _by_piqp),
    _Solver("ProxQP", "proximal augmented Lagrangian", "proxsuite", _by_proxqp),
)
