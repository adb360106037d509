"""What a run of a scenario leaves behind."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from sidestep._core import Obstacles, __version__
from sidestep.body import Body
from sidestep.robot.tolerance import SLIDING
from sidestep.scenario.scenario import Scenario
from sidestep.simulation import Evaluation, Run

Array = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class ScenarioResult:
    """A scenario that was run.

    Attributes:
        scenario, body: what was run.
        run: the record, one row per control step.
        evaluation: the figures it is judged by.
        clearance_time, clearance: (C,) [s] and [m] exact distance between arm and obstacles at some samples;
            empty without obstacles. `evaluation.min_clearance_m` looks between the samples too.
        seen: what the controller saw at the start. embedding_names: what each embedding coordinate is about.
        wall_time: what the run took on the clock, without the fit of the body [s].
        stop: why the arm did not arrive, in a sentence; None if it did.
    """

    scenario: Scenario
    body: Body
    run: Run
    evaluation: Evaluation
    clearance_time: Array
    clearance: Array
    seen: Obstacles
    embedding_names: tuple[str, ...]
    wall_time: float
    stop: str | None = None

    @property
    def switched(self) -> bool:
        """Whether a switch weighed the motion; barriers have none, whatever the file says."""
        scenario = self.scenario
        return scenario.method == "custom" and scenario.system.switch.type in (
            "binary",
            "sigmoid",
            "distance",
        )

    @property
    def success(self) -> bool:
        """Reached the goal, touched nothing and exceeded no limit."""
        evaluation = self.evaluation
        return evaluation.reached and evaluation.collision_free and not evaluation.limits.any

    def to_document(self) -> dict[str, Any]:
        """The figures as JSON values, with units in the keys (accelerations [rad/s^2], ratios without)."""
        choice = self.scenario.simulation
        turning, sliding = tolerance_units(self.run)
        return {
            "scenario": self.scenario.name,
            "robot": self.run.robot.name,
            "mode": choice.mode,
            "method": self.scenario.method,
            "switch": self.scenario.system.switch.type if self.scenario.method == "custom" else None,
            "success": self.success,
            **self.evaluation.to_dict(),
            "tolerance_rad": choice.tolerance if turning else None,
            "tolerance_m": SLIDING * choice.tolerance if sliding else None,
            "period_s": choice.period,
            "wall_time_s": self.wall_time,
            "stop": self.stop,
            "body_components": self.body.num_components,
            "sidestep_version": __version__,
        }

    def sentence(self) -> str:
        """What happened, in one sentence."""
        evaluation = self.evaluation
        arrival = f"ends {evaluation.way_left()} from the goal, which it does not reach"
        if evaluation.reached and evaluation.time_to_goal_s is not None:
            arrival = f"reaches the goal after {evaluation.time_to_goal_s:.1f} s"
        encounter = ""
        if evaluation.min_clearance_m is not None:
            millimetres = 1000.0 * evaluation.min_clearance_m
            encounter = f", stays at least {millimetres:.1f} mm away from the obstacles"
            if not evaluation.collision_free:
                pair = evaluation.clearance_pair or "arm - obstacle"
                pushed = ", ".join(evaluation.moved_objects)
                encounter = f", touches on the way ({pair})"
                encounter += f" and pushes {pushed} away" if pushed else ""
        limits = "exceeds a limit" if evaluation.limits.any else "respects every limit"
        reason = "" if self.stop is None else f" At the end: {self.stop}."
        return f"The arm {arrival}{encounter}, and {limits}.{reason}"


def tolerance_units(run: Run) -> tuple[bool, bool]:
    """Whether the tolerance of a run's goal is an angle [rad], and whether it is a length [m], or both."""
    units = run.robot.coordinate_units
    return run.pose is not None or "rad" in units, run.pose is None and "m" in units
