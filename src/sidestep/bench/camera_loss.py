"""Why a problem is not solved through cameras that is solved with full knowledge."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from enum import StrEnum

import numpy as np
import numpy.typing as npt

from sidestep._core import Obstacles
from sidestep.bench.arm import Arm
from sidestep.bench.camera_rig import room
from sidestep.bench.camera_runner import Sighted
from sidestep.bench.motion import MotionSettings
from sidestep.bench.outcome import TOLERANCE, Outcome
from sidestep.bench.problem import SceneProblem
from sidestep.bench.sight_log import TOUCHED
from sidestep.bench.workspace import Workspace
from sidestep.distance import SceneObject

Array = npt.NDArray[np.float64]

SEEN_BEFORE = 0.3  # [s] before a contact by which the touched place must have been seen for it to count
CONTACT_STRIDE = 10  # samples between two looks for the first contact
AROUND = 0.1  # [m] of a solid: obstacles there are meant to be its own
WRONG_BEYOND = 0.02  # [m] from any solid, beyond its radius, of an obstacle where nothing is


class Loss(StrEnum):
    """Why a problem is not solved by cameras that is solved with full knowledge."""

    hidden = "hidden"  #: what it touched was never seen, or nobody has seen that the goal or the way are free
    late = (
        "late"  #: what it touched was seen less than 0.3 s before; or all is free at last, and time was over
    )
    wrong = "wrong"  #: obstacles where nothing is, without which it is solved
    voxels = "voxels"  #: true obstacles alone, as large as voxels make them, leave no room
    touched = "touched"  #: it touched what it had seen 0.3 s before


class LossFinder:
    """Finds why a run through cameras did not solve a problem, by running it again with parts of what was believed.

    Args:
        arm, problem, sighted: that go together. motion: how problems are run.
    """

    def __init__(self, arm: Arm, problem: SceneProblem, sighted: Sighted, motion: MotionSettings) -> None:
        self._arm, self._problem, self._sighted, self._motion = arm, problem, sighted, motion
        robot = arm.robot
        base = robot.pose(robot.neutral, robot.links[0].name)[:3, 3]
        solids = (*problem.objects, *room(base, Workspace.of(robot).reach))
        away = distances(solids, sighted.cells["centres"])
        self.wrong: npt.NDArray[np.bool_] = (
            away > sighted.cells["radii"] + WRONG_BEYOND
        )  #: (N,) where nothing is

    def find(self, outcome: Outcome) -> tuple[Loss, str]:
        """Why it is not solved, in a word and a sentence."""
        if outcome.collision:
            return self._contact(outcome)
        centres, radii = self._sighted.cells["centres"], self._sighted.cells["radii"]
        if not self._is_solved(centres[~self.wrong], radii[~self.wrong]):
            return Loss.voxels, "true obstacles alone, as large as voxels and noise make them, leave no room"
        if self.wrong.any() and not self._is_solved(centres, radii):
            return Loss.wrong, f"it is solved without the {int(self.wrong.sum())} obstacles where nothing is"
        if len(self._sighted.unseen):
            return Loss.hidden, f"{len(self._sighted.unseen)} cells that nobody has seen close the way"
        return Loss.late, "it is solved with what is known at the end"

    def overshoot_mm(self) -> list[float]:
        """How far obstacles reach beyond solids [mm], of those within `AROUND` of one: median, 95 %."""
        away = distances(self._problem.objects, self._sighted.cells["centres"])
        beyond = (away + self._sighted.cells["radii"])[away < AROUND]
        return [round(1e3 * float(x), 1) for x in np.percentile(beyond, (50.0, 95.0))] if len(beyond) else []

    def _is_solved(self, centres: Array, radii: Array) -> bool:
        told = Obstacles(centres, radii) if len(centres) else Obstacles.none()
        return told_outcome(self._arm, self._problem, told, self._motion).arrived

    def _contact(self, outcome: Outcome) -> tuple[Loss, str]:
        """What was known of the place that it touched first."""
        clearance, q, period = self._problem.clearance, self._sighted.motion.q, self._motion.period
        last = min(round(outcome.clearance_time_s / period), len(q) - 1)
        steps = [*range(0, last, CONTACT_STRIDE), last]
        step, nearest = next(
            (k, found)
            for k in steps
            if (found := clearance.distance(q[k])).distance <= TOLERANCE or k == last
        )
        before = step * period - self._sighted.log.seen_at(np.asarray(nearest.point_on_obstacle))
        pair = f"{nearest.link} - {nearest.obstacle} at {step * period:.2f} s"
        if not math.isfinite(before):
            return Loss.hidden, f"{pair}: nothing within {TOUCHED} m of the contact was in view"
        word = f"{pair}: in view {before:.2f} s before"
        return (Loss.late if before < SEEN_BEFORE else Loss.touched), word


def told_outcome(arm: Arm, problem: SceneProblem, obstacles: Obstacles, motion: MotionSettings) -> Outcome:
    """What comes of a problem with a controller that is told of obstacles from the start."""
    told = replace(problem, obstacles=obstacles)
    return arm.judge.judge(told, arm.move(told, motion), motion)


def distances(objects: Sequence[SceneObject], points: Array) -> Array:
    """Distances (N,) [m] of points (N, 3) from the nearest of some boxes, cylinders and spheres; inside: 0.

    Raises:
        ValueError: an object of another kind.
    """
    nearest = np.full(len(points), np.inf)
    for item in objects:
        local = (points - item.pose[:3, 3]) @ item.pose[:3, :3]
        match item.kind, item.size:
            case "box", (x, y, z):
                out = np.maximum(np.abs(local) - 0.5 * np.array([x, y, z]), 0.0)
            case "cylinder", (radius, length):
                across = np.linalg.norm(local[:, :2], axis=1) - radius
                out = np.maximum(np.column_stack([across, np.abs(local[:, 2]) - 0.5 * length]), 0.0)
            case "sphere", (radius,):
                out = np.maximum(np.linalg.norm(local, axis=1, keepdims=True) - radius, 0.0)
            case _:
                raise ValueError(f"object {item.name!r} is a {item.kind}, allowed: box, cylinder, sphere")
        nearest = np.minimum(nearest, np.linalg.norm(out, axis=1))
    return nearest
