"""What a step costs against the number of points, out of reach and within it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

import sidestep
from sidestep._core import BarrierSettings, GeometricSystem, Obstacles, instruction_set, rollout
from sidestep.bench.methods import barrier_system
from sidestep.bench.step import clear_place, cpu_model
from sidestep.bench.step_times import StepTimes
from sidestep.bench.workspace import Workspace
from sidestep.body import Body
from sidestep.robot import Robot

Array = npt.NDArray[np.float64]

BEYOND = (0.5, 1.5)  # [m] farther than the arm reaches, where points out of reach lie
NEAREST = 0.05  # [m] of points within reach from the body
ROUNDING = 1e-9  # [m] of where points are put
STEPS = 50  # at rest, between two looks at the time
FEWEST = 3  # steps of a row, however long they take
DRAWN = 20_000  # points drawn at once


@dataclass(frozen=True)
class CloudSizeSettings:
    """What is measured.

    Attributes:
        robot: with its covering body and the recommended system. most: points; rows have 10, 100, ... up to it.
        seconds: for each row [s]. seed: of points and configuration.

    Raises:
        ValueError: a number out of range.
    """

    robot: str = "fr3"
    most: int = 1_000_000
    seconds: float = 1.0
    seed: int = 0

    def __post_init__(self) -> None:
        if self.most < 10:
            raise ValueError(f"most is {self.most}, must be at least 10")
        if not self.seconds > 0.0:
            raise ValueError(f"seconds is {self.seconds}, must be positive")


def run_cloud_size_bench(
    settings: CloudSizeSettings, *, progress: Callable[[int, int, str], None] | None = None
) -> dict[str, Any]:
    """Times the step of an arm at rest among more and more points and returns a document for JSON.

    Out of reach: uniform by radius, 0.5 to 1.5 m beyond what the arm reaches. Within: 5 to 10 cm from the body, where
    barriers act, on all sides of it.
    """
    robot = Robot.named(settings.robot)
    body = Body.cover(robot)
    system = barrier_system(robot, body)
    rng = np.random.default_rng(settings.seed)
    q = clear_place(robot, system, Obstacles.none(), rng)
    numbers = [10**k for k in range(1, round(np.log10(settings.most)) + 1) if 10**k <= settings.most]
    drawn = {
        "out of reach": points_beyond(robot, numbers[-1], rng),
        "within reach": points_around(robot, body, q, numbers[-1], rng),
    }
    results: list[dict[str, Any]] = []
    for where, points in drawn.items():
        for num in numbers:
            if progress is not None:
                progress(len(results), len(drawn) * len(numbers), f"{num:,} points {where}")
            times = _times(system, q, Obstacles(points[:num]), settings.seconds)
            results.append({"points": num, "where": where, "steps": times.total, **_in_row(times)})
    return {
        "benchmark": "cloud size",
        "version": sidestep.__version__,
        "cpu": cpu_model(),
        "instruction_set": instruction_set(),
        "robot": settings.robot,
        "seconds": settings.seconds,
        "results": results,
    }


def _in_row(times: StepTimes) -> dict[str, float | None]:
    return {f"{name}_us": value for name, value in times.microseconds().items()}


def _times(system: GeometricSystem, q: Array, obstacles: Obstacles, seconds: float) -> StepTimes:
    times, rest, spent = StepTimes(), np.zeros_like(q), 0.0
    first = rollout(system, q, rest, q, obstacles, steps=1, time_steps=True).step_seconds[0]
    steps = int(np.clip(seconds / max(first, 1e-9), FEWEST, STEPS))
    while times.total < FEWEST or spent < seconds:
        taken = rollout(system, q, rest, q, obstacles, steps=steps, time_steps=True).step_seconds
        times.add(taken)
        spent += float(taken.sum())
    return times


def points_beyond(robot: Robot, num: int, rng: np.random.Generator) -> Array:
    """`num` points around the shoulder, farther away than the arm reaches."""
    space = Workspace.of(robot)
    directions = rng.normal(size=(num, 3))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    near, far = BEYOND
    return space.shoulder + directions * (space.reach + rng.uniform(near, far, size=(num, 1)))


def points_around(robot: Robot, body: Body, q: Array, num: int, rng: np.random.Generator) -> Array:
    """`num` points 5 cm to the activation distance away from an ellipsoid of the body at q, and no nearer to others."""
    moving = {frame.name for frame in robot.frames if frame.joint >= 0}
    assert body.levels is not None
    poses = {link: robot.pose(q, link) for link in set(body.links) & moving}
    parts = [(k, poses[link]) for k, link in enumerate(body.links) if link in moving]
    centres = np.array([X[:3, :3] @ body.means[k] + X[:3, 3] for k, X in parts])
    shapes = np.array([body.levels[k] * X[:3, :3] @ body.covariances[k] @ X[:3, :3].T for k, X in parts])
    inverses, factors = np.linalg.inv(shapes), np.linalg.cholesky(shapes)
    kept: list[Array] = []
    while sum(map(len, kept)) < num:
        which = rng.integers(len(parts), size=DRAWN)
        sphere = rng.normal(size=(DRAWN, 3))
        sphere /= np.linalg.norm(sphere, axis=1)[:, None]
        surface = np.einsum("nij,nj->ni", factors[which], sphere)
        normals = np.einsum("nij,nj->ni", inverses[which], surface)
        normals /= np.linalg.norm(normals, axis=1)[:, None]
        points = (
            centres[which]
            + surface
            + rng.uniform(NEAREST, BarrierSettings().activation, (DRAWN, 1)) * normals
        )
        free = np.ones(DRAWN, dtype=bool)
        for centre, inverse in zip(centres, inverses, strict=True):
            # The distance to first order, which is that or less.
            away = points - centre
            slope = away @ inverse
            squared = np.sum(slope * away, axis=1)
            free &= squared - np.sqrt(squared) >= (NEAREST - ROUNDING) * np.linalg.norm(slope, axis=1)
        kept.append(points[free])
    return np.concatenate(kept)[:num]


def draw_cloud_sizes(document: dict[str, Any], file: Path) -> None:
    """The step's median and 99 % against the number of points, on logarithmic axes, as a picture."""
    from sidestep.drawing import style  # here: it needs Matplotlib

    with style.applied():
        figure = style.new_figure(7.0, width=11.0)
        axes = figure.subplots()
        for where, colour in (("out of reach", style.BLUE), ("within reach", style.VERMILLION)):
            rows = [row for row in document["results"] if row["where"] == where]
            points = [row["points"] for row in rows]
            for name, line in (("median", "-"), ("p99", ":")):
                times = [row[f"{name}_us"] for row in rows]
                axes.plot(
                    points, times, line, color=colour, marker="o", markersize=3.0, label=f"{where}, {name}"
                )
        axes.set(xscale="log", yscale="log", xlabel="points", ylabel="one step [µs]")
        axes.set_title(f"{document['robot']} at rest, {document['cpu']}")
        axes.legend()
        figure.savefig(file, dpi=style.DPI)
