"""Runs a scenario: physics under torque control, or the integrated dynamical system alone."""

from __future__ import annotations

import time as clock
from collections.abc import Callable, Sequence

import numpy as np
import numpy.typing as npt

from sidestep._core import Controller, CoordinateKind, CoordinateLabel
from sidestep.distance import ExactClearance
from sidestep.scenario.assembly import Assembly, Progress, assemble
from sidestep.scenario.result import ScenarioResult
from sidestep.scenario.scenario import Scenario
from sidestep.simulation import Arrival, Run, Simulation, evaluate, run_kinematically
from sidestep.simulation.evaluation import POSE_TOLERANCE
from sidestep.simulation.run import obstacles_over_time

Array = npt.NDArray[np.float64]
OnStep = Callable[[float, Array], None]

MAX_CLEARANCE_SAMPLES = 400  # of the curve of the clearance; the minimum is searched between them as well
ARRIVAL_SHARE = 0.4  # of the tolerance: a run ends when the error is well inside it


def run_scenario(
    scenario: Scenario,
    *,
    on_step: OnStep | None = None,
    on_start: Callable[[Assembly], None] | None = None,
    fit_progress: Progress | None = None,
) -> ScenarioResult:
    """Runs a scenario and judges the run.

    Args:
        scenario: what to run.
        on_step: called with time [s] and q (nv,) after every control step.
        on_start: called with the parts of the run before the first step.
        fit_progress: told of the preparation of the arm, see `assemble`.

    Raises:
        ScenarioError: the scenario asks for something impossible, see `assemble`.
        RuntimeError: the physics or the integration diverged.
    """
    parts = assemble(scenario, progress=fit_progress)
    if on_start is not None:
        on_start(parts)
    begin = clock.perf_counter()
    run = _run(scenario, parts, on_step)
    evaluation = evaluate(run, goal_tolerance=scenario.simulation.tolerance)
    samples = np.unique(np.linspace(0, len(run) - 1, MAX_CLEARANCE_SAMPLES).astype(int))
    clearance = np.zeros(0)
    if run.objects:
        clearance = ExactClearance(run.robot, run.objects).series(run.q[samples], run.object_poses[samples])
    return ScenarioResult(
        scenario=scenario,
        body=parts.body,
        run=run,
        evaluation=evaluation,
        clearance_time=run.time[samples] if run.objects else np.zeros(0),
        clearance=clearance,
        seen=obstacles_over_time(parts.seen)(0.0),
        embedding_names=embedding_names(scenario, parts.mover.labels),
        wall_time=clock.perf_counter() - begin,
        stop=None if evaluation.reached else _reason(parts, run),
    )


def embedding_names(scenario: Scenario, labels: Sequence[CoordinateLabel]) -> tuple[str, ...]:
    """What each embedding coordinate is about: a link, a pair of links, a joint limit, or a density."""
    choice = scenario.embedding
    densities = ["collision density"] + ([] if choice.joint_limits is None else ["joint limits"])
    potentials = iter([" + ".join(densities)] if choice.combine == "sum" else densities)

    def name(label: CoordinateLabel) -> str:
        match label.kind:
            case CoordinateKind.obstacle:
                return f"{label.name} - obstacles"
            case CoordinateKind.plane:
                return f"{label.name} - plane"
            case CoordinateKind.self:
                return f"{label.name} - {label.other}"
            case CoordinateKind.joint_limit:
                return f"{label.name} - {label.other} limit"
            case CoordinateKind.effort:
                return f"{label.name} - effort limit"
        return next(potentials, "density")

    return tuple(map(name, labels))


def _reason(parts: Assembly, run: Run) -> str:
    if isinstance(parts.mover, Controller):
        return parts.mover.explain()
    seen = obstacles_over_time(parts.seen)(float(run.time[-1]))
    return parts.posture.in_words(parts.mover.diagnose(run.q[-1], run.v[-1], parts.goal, seen).describe())


def _run(scenario: Scenario, parts: Assembly, on_step: OnStep | None) -> Run:
    choice = scenario.simulation
    target = parts.driver, parts.start, parts.pose or parts.goal, choice.duration
    arrival = Arrival(position=ARRIVAL_SHARE * choice.tolerance, distance=ARRIVAL_SHARE * POSE_TOLERANCE)
    if choice.mode == "torque":
        simulation = Simulation(parts.robot, parts.objects, timestep=choice.period, visuals=False)
        return simulation.run(*target, start_velocity=parts.start_velocity, arrival=arrival, on_step=on_step)
    return run_kinematically(
        parts.robot,
        *target,
        objects=parts.objects,
        timestep=choice.period,
        start_velocity=parts.start_velocity,
        arrival=arrival,
        on_step=on_step,
    )
