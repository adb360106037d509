"""What a run achieved: the thesis's four criteria (section 6.2), the limits, and exact clearance."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from sidestep._core import JointLimits
from sidestep.distance.clearance import ExactClearance
from sidestep.robot.tolerance import tolerances
from sidestep.robot.turns import ways_to
from sidestep.simulation.joint_words import in_words, largest_ways, pose_in_words
from sidestep.simulation.run import Run, SimulationRun

Array = npt.NDArray[np.float64]

GOAL_TOLERANCE = 0.05  # [rad] the project's definition of arriving
POSE_TOLERANCE = 0.01  # [m] the same of the frame of a pose goal, whose angle has the tolerance of joints
MOVED = (
    1e-4  # [m] a free object that nothing touches floats still to rounding; a tenth of a millimetre is a push
)
LIMIT_SLACK = 1e-6  # relative (absolute below 1): the quadratic program's own tolerance


@dataclass(frozen=True)
class LimitViolations:
    """Number of samples at which any joint is beyond its limit, see `outside_of`, and by how much at worst.

    The excess is in the limit's own unit ([rad], [rad/s], [rad/s^2], [Nm]; metres for sliding joints), 0 when
    every sample is inside. Torque is None where there was none.
    """

    position: int
    velocity: int
    acceleration: int
    torque: int | None
    worst_position: float
    worst_velocity: float
    worst_acceleration: float
    worst_torque: float | None

    @property
    def any(self) -> bool:
        """Whether any limit was broken at any sample."""
        return bool(self.position or self.velocity or self.acceleration or self.torque)


@dataclass(frozen=True)
class Evaluation:
    """The figures of a run. Fields that a run without physics does not have are None.

    Attributes:
        reached: criterion 1: every joint's error at the end is under its tolerance; of a pose goal the angle
            under the tolerance and the distance under 1 cm.
        position_error_rad, position_error_m: that of the turning and of the sliding joints, None for a pose goal or
            without such a joint.
        pose_distance_m, pose_angle_rad: those of a pose goal, else None.
        time_to_goal_s: when the error went under the tolerance for good, or None.
        path_deviation_rad, path_deviation_m: criterion 2: the largest offset of the turning and of the sliding
            joints from the straight segment from the start to the goal, or to the configuration at the end of a run
            to a pose, None without such a joint; path_deviation_joint: the joint with the largest number.
        contacts: criterion 3: arm-scene contact points that MuJoCo counted, over all steps; contact_pairs:
            which "link - obstacle" they were; max_contact_force_n.
        min_clearance_m: criterion 3: smallest exact clearance, between samples too (None: empty scene), found
            to within clearance_tolerance_m (the true one is smaller by at most that); clearance_pair and
            clearance_time_s: where and when.
        moved_objects: criterion 3: name to largest displacement [m] of every free object that moved.
        max_tracking_error, rms_tracking_error: criterion 4: |achieved - wanted| acceleration, largest joint
            [rad/s^2 | m/s^2] and root mean square over samples and joints.
        max_qp_error, rms_qp_error: the same for |QP's - wanted|; max_model_error for |achieved - QP's|.
        max_torque_ratio: largest |torque| / limit.
        limits: violations at samples.
        system_status, controller_status: status name to the number of samples that had it.
        duration_s: simulated time.
    """

    reached: bool
    position_error_rad: float | None
    position_error_m: float | None
    pose_distance_m: float | None
    pose_angle_rad: float | None
    time_to_goal_s: float | None
    path_deviation_rad: float | None
    path_deviation_m: float | None
    path_deviation_joint: str
    contacts: int | None
    contact_pairs: tuple[str, ...] | None
    max_contact_force_n: float | None
    min_clearance_m: float | None
    clearance_tolerance_m: float
    clearance_pair: str | None
    clearance_time_s: float | None
    moved_objects: dict[str, float]
    max_tracking_error: float | None
    rms_tracking_error: float | None
    max_qp_error: float | None
    rms_qp_error: float | None
    max_model_error: float | None
    max_torque_ratio: float | None
    limits: LimitViolations
    system_status: dict[str, int]
    controller_status: dict[str, int] | None
    duration_s: float

    @property
    def collision_free(self) -> bool:
        """No contact, nothing pushed, and surely nothing overlapping between samples either."""
        apart = self.min_clearance_m is None or self.min_clearance_m > self.clearance_tolerance_m
        return not self.contacts and not self.moved_objects and apart

    def way_left(self) -> str:
        """How far from the goal the run ended, in words."""
        if self.pose_distance_m is None:
            return in_words(self.position_error_rad, self.position_error_m)
        return pose_in_words(self.pose_distance_m, self.pose_angle_rad or 0.0)

    def to_dict(self) -> dict[str, Any]:
        """Plain values for JSON; what is not a finite number is None."""
        record = asdict(self)
        record["collision_free"] = self.collision_free
        cleaned = _finite(record)
        assert isinstance(cleaned, dict)
        return cleaned


def evaluate(
    run: Run, *, goal_tolerance: float = GOAL_TOLERANCE, clearance_tolerance: float = 1e-3
) -> Evaluation:
    """Judges a run, by physics where it had physics and by exact meshes always.

    Args:
        run: of `Simulation.run` or `run_kinematically`.
        goal_tolerance: largest joint error [rad], see `tolerances` of sliding joints, or angle of a pose [rad], that
            counts as reached.
        clearance_tolerance: accuracy [m] of the minimum clearance, see `ExactClearance.minimum_over`; where
            the minimum is smaller than this, it is measured again, finer, until it is clear whether the arm
            touched.
    """
    error, distance = np.zeros(len(run)), np.zeros(len(run))
    if run.pose is None:
        away = ways_to(run.robot, run.q, run.goal)
        inside = np.asarray((away < tolerances(run.robot, goal_tolerance)).all(axis=1))
    else:
        distance, error = np.array([run.pose.errors(q) for q in run.q]).T
        inside = np.asarray((error < goal_tolerance) & (distance < POSE_TOLERANCE))
    deviation = np.abs(run.q - _on_segment(run.q, run.start, run.goal)).max(axis=0)
    physics = run if isinstance(run, SimulationRun) else None
    pair, minimum, when, worst = None, None, None, None
    if run.objects:
        worst = ExactClearance(run.robot, run.objects).decided_minimum(
            run.q, run.object_poses, tolerance=clearance_tolerance
        )
        minimum, when = worst.clearance.distance, worst.sample * run.timestep
        pair = f"{worst.clearance.link} - {worst.clearance.obstacle}"
    effort = run.robot.limits.effort
    left: tuple[float | None, float | None] = (None, None)
    if run.pose is None:
        left = largest_ways(run.robot, ways_to(run.robot, run.q[-1], run.goal))
    detour = largest_ways(run.robot, deviation)
    return Evaluation(
        reached=bool(inside[-1]),
        position_error_rad=left[0],
        position_error_m=left[1],
        pose_distance_m=None if run.pose is None else float(distance[-1]),
        pose_angle_rad=None if run.pose is None else float(error[-1]),
        time_to_goal_s=_settled(run.time, inside),
        path_deviation_rad=detour[0],
        path_deviation_m=detour[1],
        path_deviation_joint=run.robot.coordinate_names[int(deviation.argmax())],
        contacts=None if physics is None else len(physics.contacts),
        contact_pairs=None
        if physics is None
        else tuple(sorted({f"{c.link} - {c.obstacle}" for c in physics.contacts})),
        max_contact_force_n=None
        if physics is None
        else max((c.force for c in physics.contacts), default=0.0),
        min_clearance_m=minimum,
        clearance_tolerance_m=clearance_tolerance if worst is None else worst.tolerance,
        clearance_pair=pair,
        clearance_time_s=when,
        moved_objects=_moved(run),
        max_tracking_error=_largest(physics, "achieved", "wanted"),
        rms_tracking_error=_rms(physics, "achieved", "wanted"),
        max_qp_error=_largest(physics, "solved", "wanted"),
        rms_qp_error=_rms(physics, "solved", "wanted"),
        max_model_error=_largest(physics, "achieved", "solved"),
        max_torque_ratio=None if physics is None else float((np.abs(physics.torque) / effort).max()),
        limits=_violations(run),
        system_status=_counts(run.system_status),
        controller_status=None if physics is None else _counts(physics.controller_status),
        duration_s=float(run.time[-1] + run.timestep),
    )


def _on_segment(q: Array, start: Array, goal: Array) -> Array:
    """The nearest points (T, nv) to q (T, nv) on the straight segment from start to goal."""
    along = goal - start
    length = float(along @ along)
    fraction = np.clip((q - start) @ along / length, 0.0, 1.0) if length > 0.0 else np.zeros(len(q))
    nearest: Array = start + fraction[:, None] * along
    return nearest


def _settled(time: Array, inside: npt.NDArray[np.bool_]) -> float | None:
    if not inside[-1]:
        return None
    outside = np.flatnonzero(~inside)
    return float(time[outside[-1] + 1]) if len(outside) else float(time[0])


def _moved(run: Run) -> dict[str, float]:
    moved = {}
    for j, item in enumerate(run.objects):
        if item.motion == "free":
            shift = float(
                np.linalg.norm(run.object_poses[:, j, :3] - run.object_poses[0, j, :3], axis=1).max()
            )
            if shift > MOVED:
                moved[item.name] = shift
    return moved


def _differences(run: SimulationRun | None, a: str, b: str) -> Array:
    """|a - b| of two recorded accelerations, all joints and samples; a fallback's unknown ones are left
    out."""
    if run is None:
        return np.zeros(0)
    differences = np.abs(getattr(run, a) - getattr(run, b)).ravel()
    known: Array = differences[np.isfinite(differences)]
    return known


def _largest(run: SimulationRun | None, a: str, b: str) -> float | None:
    differences = _differences(run, a, b)
    return float(differences.max()) if differences.size else None


def _rms(run: SimulationRun | None, a: str, b: str) -> float | None:
    differences = _differences(run, a, b)
    return float(np.sqrt((differences**2).mean())) if differences.size else None


def _violations(run: Run) -> LimitViolations:
    limits = run.robot.limits
    position = excess_over(outside_of(run.q, limits), np.zeros(1))
    velocity = excess_over(np.abs(run.v), limits.velocity)
    acceleration = excess_over(np.abs(run.achieved), limits.acceleration)
    torque = excess_over(np.abs(run.torque), limits.effort) if isinstance(run, SimulationRun) else None
    return LimitViolations(
        position=position[0],
        velocity=velocity[0],
        acceleration=acceleration[0],
        torque=None if torque is None else torque[0],
        worst_position=position[1],
        worst_velocity=velocity[1],
        worst_acceleration=acceleration[1],
        worst_torque=None if torque is None else torque[1],
    )


def outside_of(q: Array, limits: JointLimits) -> Array:
    """How far q (T, nv) is outside the position limits, but for a start a rounding error outside until it has come in.

    What such a start (see `JointLimits.rounding`) leaves of its excess is no violation, as long as it only shrinks.
    """
    outside = np.maximum(np.maximum(limits.lower - q, q - limits.upper), 0.0)
    taken_in = np.where(outside[0] <= JointLimits.rounding, outside[0], 0.0)
    excess: Array = outside - np.minimum(np.minimum.accumulate(outside, axis=0), taken_in)
    return excess


def excess_over(values: Array, limit: Array) -> tuple[int, float]:
    """Number of samples beyond a limit (nv,) that carry any excess, and the largest excess."""
    excess = values - limit
    beyond = excess > LIMIT_SLACK * np.maximum(limit, 1.0)
    return int(beyond.any(axis=1).sum()), float(np.max(excess, where=beyond, initial=0.0))


def _counts(statuses: tuple[str, ...]) -> dict[str, int]:
    names, counts = np.unique(np.array(statuses, dtype=str), return_counts=True)
    return {str(name): int(count) for name, count in zip(names, counts, strict=True)}


def _finite(value: object) -> object:
    if isinstance(value, dict):
        return {key: _finite(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(item) for item in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value
