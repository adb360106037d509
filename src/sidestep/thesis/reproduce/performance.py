"""Table 6.1: how often a second each way of computing T5.4 runs."""

from __future__ import annotations

import os
import time as clock
from collections.abc import Callable, Iterator

import numpy as np

from sidestep import Body, Obstacles, Robot
from sidestep.bench.peers import dense_analytic, torch_autograd
from sidestep.bench.peers.serial_chain import SerialChain
from sidestep.system import GeometricSystem
from sidestep.thesis import CollisionDensity, rollout
from sidestep.thesis.reproduce.item import Array, Caption, Item, Table
from sidestep.thesis.reproduce.registry import Settings

ROBOTS = {2: "planar2", 3: "planar3", 7: "fr3_arm"}
POINTS = {2: (0.6, 0.3, 0.0), 3: (0.6, 0.3, 0.0), 7: (0.4, 0.2, 0.5)}  # [m] beside the arm
STEPS, REPETITIONS = 1000, 10  # the thesis's
BUDGET = 25.0  # [s] for each number of the slow rows: automatic differentiation of 7 joints would take half an hour
THESIS = {
    "torch.autograd": (133.0, 57.0, 4.5),
    "analytic, dense": (3076.0, 1725.0, 214.0),
}  # [Hz] its Table 6.1
METHODS = ("torch.autograd", "analytic, dense", "core from Python", "core in C++")


def computation_frequency(settings: Settings) -> Iterator[Item]:
    """Steps a second for 2, 3 and 7 joints, one Gaussian per link, one obstacle."""
    steps, repetitions = (100, 3) if settings.quick else (STEPS, REPETITIONS)
    budget = 0.7 if settings.quick else BUDGET
    frequencies = {method: np.full(len(ROBOTS), np.nan) for method in METHODS}
    evaluations = {method: np.zeros(len(ROBOTS), dtype=int) for method in METHODS}
    for column, (joints, name) in enumerate(ROBOTS.items()):
        settings.notify(f"table 6.1, {joints} joints")
        robot = Robot.named(name)
        body = Body.fit(robot, components=1, seed=settings.seed)
        chain = SerialChain.of(robot, body)
        point = np.array(POINTS[joints])
        obstacles = Obstacles(point[None])
        system = GeometricSystem([CollisionDensity(robot, body)], stiffness=0.5, damping=1.5)
        start, goal = robot.neutral, robot.neutral + 0.1
        run = rollout(system, start, np.zeros(joints), goal, obstacles, period=1e-3, steps=steps)
        states = list(zip(run.q[:-1], run.v[:-1], strict=True))

        def by_core(q: Array, v: Array) -> object:
            return system.acceleration(q, v, goal, obstacles)  # noqa: B023

        def by_tensors(q: Array, v: Array) -> object:
            return dense_analytic.acceleration(chain, q, v, goal, point)  # noqa: B023

        ways: dict[str, Callable[[Array, Array], object]] = {
            "analytic, dense": by_tensors,
            "core from Python": by_core,
        }
        if torch_autograd.available():
            automatic = torch_autograd.AutogradSystem(chain, point)
            ways["torch.autograd"] = lambda q, v: automatic.acceleration(q, v, goal)  # noqa: B023
        for method, way in ways.items():
            frequencies[method][column], evaluations[method][column] = _frequency(
                way, states, repetitions, budget
            )

        many = 100 * steps  # a call costs microseconds: it must not be counted among the steps
        times = []
        for _ in range(repetitions):
            begin = clock.perf_counter()
            rollout(system, start, np.zeros(joints), goal, obstacles, period=1e-3, steps=many)
            times.append((clock.perf_counter() - begin) / many)
        frequencies["core in C++"][column] = 1.0 / np.median(times)
        evaluations["core in C++"][column] = many * repetitions
    yield table(frequencies, evaluations, steps=steps, repetitions=repetitions, budget=budget)


def _frequency(
    way: Callable[[Array, Array], object],
    states: list[tuple[Array, Array]],
    repetitions: int,
    budget: float,
) -> tuple[float, int]:
    """Median over the repetitions of evaluations a second, and how many evaluations there were."""
    way(*states[0])
    rates, count, begin = [], 0, clock.perf_counter()
    for _ in range(repetitions):
        lap, done = clock.perf_counter(), 0
        for q, v in states:
            way(q, v)
            done += 1
            if clock.perf_counter() - begin > budget:
                break
        rates.append(done / (clock.perf_counter() - lap))
        count += done
        if clock.perf_counter() - begin > budget:
            break
    return float(np.median(rates)), count


def table(
    frequencies: dict[str, Array],
    evaluations: dict[str, Array],
    *,
    steps: int = STEPS,
    repetitions: int = REPETITIONS,
    budget: float = BUDGET,
) -> Table:
    """The table of frequencies [Hz] (NaN: not measured) and of evaluations behind them, per method.

    Args:
        steps, repetitions, budget: states per repetition, repetitions, and most time for a cell [s].
    """
    from sidestep.thesis.reproduce.runner import cpu_name

    rows: list[tuple[str, ...]] = []
    base = frequencies["analytic, dense"]
    for method in METHODS:
        found = frequencies[method]
        theirs = " / ".join(f"{x:g}" for x in THESIS[method]) if method in THESIS else "-"
        if np.isnan(found).all():
            rows.append((method, *("PyTorch is not installed",) * 3, "-", theirs))
            continue
        cells = [f"{x:,.0f} Hz" if x >= 100 else f"{x:.1f} Hz" for x in found]
        ratios = [f"{r:,.0f}" if r >= 100 else f"{r:.3g}" for r in found / base]
        rows.append((method, *cells, " / ".join(ratios), theirs))
    load = os.getloadavg()[0] if hasattr(os, "getloadavg") else float("nan")
    return Table(
        key="6.1",
        title="Computation frequency against the number of joints",
        caption=Caption(
            shows="Evaluations a second of q'' = -G⁻¹K(q - q*) - Dq' - Ξq'. Ratios are to the dense analytic "
            "row of the same run, for 2 / 3 / 7 joints.",
            answers="Table 6.1.",
            parameters=f"{cpu_name()}, one thread, load {load:.1f} when it ended. Robots "
            f"{', '.join(ROBOTS.values())}; one Gaussian per link, one obstacle point, K = 0.5 /s², D = 1.5 "
            f"/s; the same {steps} states for every row, {repetitions} repetitions, median; a row stops after "
            f"{budget:g} s a cell "
            f"(evaluations for 7 joints: {', '.join(f'{m} {evaluations[m][2]:,}' for m in METHODS)}). The "
            "C++ row is one long rollout, with integration.",
            differs="The thesis's processor is an Intel i7-1360P; only ratios compare. Its rows are not "
            "wrong in kind: autograd is slowest, tensors in NumPy are faster. The core needs no d×d×3×3 "
            "tensors, since the obstacle point moves in the link's frame and the covariances stay "
            "constant there.",
        ),
        columns=("method", "2 joints", "3 joints", "7 joints", "ratio", "thesis [Hz]"),
        rows=tuple(rows),
        data={
            "joints": np.array(list(ROBOTS)),
            **{f"{method} [Hz]": frequencies[method] for method in METHODS},
        },
    )
