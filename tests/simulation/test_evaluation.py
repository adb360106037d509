"""Every figure of an evaluation on runs written by hand, where it is known."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from sidestep import Robot, SceneObject, evaluate
from sidestep.math.pose import pose_at, pose_vector
from sidestep.simulation import Contact, KinematicRun, SimulationRun

DT = 0.01


def _columns(q: np.ndarray, **changes) -> dict:
    """A run through q (T, 2) of the planar arm, with v and achieved by differences."""
    v = np.gradient(q, DT, axis=0)
    achieved = np.gradient(v, DT, axis=0)
    columns = {
        "robot": Robot.named("planar2"),
        "objects": (),
        "start": q[0],
        "goal": q[-1],
        "timestep": DT,
        "time": np.arange(len(q)) * DT,
        "q": q,
        "v": v,
        "wanted": achieved,
        "achieved": achieved,
        "switch": np.ones((len(q), 1)),
        "values": np.zeros((len(q), 1)),
        "system_status": ("ok",) * len(q),
        "object_poses": np.zeros((len(q), 0, 7)),
        "arrived": True,
        "time_to_goal": None,
    }
    return columns | changes


def _simulated(q: np.ndarray, **changes) -> SimulationRun:
    columns = _columns(q)
    physics = {
        "solved": columns["wanted"],
        "torque": np.zeros_like(q),
        "controller_status": ("ok",) * len(q),
        "contacts": (),
    }
    return SimulationRun(**(columns | physics | changes))


def _line(steps: int = 101) -> np.ndarray:
    """A smooth move of joint 1 from 0 to 1 rad in 1 s, at rest at both ends."""
    s = np.linspace(0.0, 1.0, steps)
    return np.column_stack([10 * s**3 - 15 * s**4 + 6 * s**5, np.zeros(steps)])


def test_straight_motion() -> None:
    result = evaluate(KinematicRun(**_columns(_line())))
    assert result.reached
    assert result.position_error_rad == 0.0
    assert result.path_deviation_rad == pytest.approx(0.0, abs=1e-12)
    assert not result.limits.any
    assert result.contacts is None
    assert result.max_torque_ratio is None
    assert result.max_tracking_error is None
    assert result.min_clearance_m is None
    assert result.system_status == {"ok": 101}
    q = _line()[:, 0]
    assert result.time_to_goal_s == pytest.approx(DT * np.flatnonzero(q <= 0.95)[-1] + DT)
    assert result.duration_s == pytest.approx(1.01)


def test_deviation_names_the_joint() -> None:
    q = _line()
    q[:, 1] = 0.3 * np.sin(np.pi * np.linspace(0.0, 1.0, len(q)))
    result = evaluate(KinematicRun(**_columns(q)))
    assert result.path_deviation_joint == "joint2"
    assert result.path_deviation_rad == pytest.approx(0.3, abs=1e-9)


def test_overshoot_past_the_goal_is_a_deviation() -> None:
    q = np.vstack([_line(), _line()[::-1][:50]])
    result = evaluate(KinematicRun(**_columns(q, goal=np.array([0.8, 0.0]))))
    assert result.path_deviation_rad == pytest.approx(0.2)


def test_left_again_is_not_reached() -> None:
    q = np.vstack([_line(), _line()[::-1]])
    result = evaluate(KinematicRun(**_columns(q, goal=np.array([1.0, 0.0]))))
    assert not result.reached
    assert result.time_to_goal_s is None
    assert result.position_error_rad == pytest.approx(1.0)


def test_limit_violations_are_counted_with_their_size() -> None:
    run = _simulated(_line())
    limits = run.robot.limits
    q, v, achieved, torque = run.q.copy(), run.v.copy(), run.achieved.copy(), run.torque.copy()
    q[3, 0] = limits.upper[0] + 0.1
    v[4:6, 1] = -limits.velocity[1] - 0.2
    achieved[7, 0] = limits.acceleration[0] + 0.3
    torque[8:11, 1] = -limits.effort[1] * 1.5
    result = evaluate(replace(run, q=q, v=v, achieved=achieved, torque=torque))
    counts = result.limits
    assert (counts.position, counts.velocity, counts.acceleration, counts.torque) == (1, 2, 1, 3)
    assert counts.worst_position == pytest.approx(0.1)
    assert counts.worst_velocity == pytest.approx(0.2)
    assert counts.worst_acceleration == pytest.approx(0.3)
    assert counts.worst_torque == pytest.approx(0.5 * limits.effort[1])
    assert result.max_torque_ratio == pytest.approx(1.5)
    assert counts.any


def test_values_on_the_limit_are_inside() -> None:
    run = _simulated(_line())
    torque = np.broadcast_to(run.robot.limits.effort, run.q.shape)
    result = evaluate(replace(run, torque=torque))
    assert not result.limits.any
    assert result.max_torque_ratio == 1.0


def test_tracking_errors() -> None:
    run = _simulated(_line())
    achieved = run.wanted.copy()
    achieved[5, 1] += 0.4
    solved = run.wanted.copy()
    solved[6, 0] -= 0.3
    result = evaluate(replace(run, achieved=achieved, solved=solved))
    assert result.max_tracking_error == pytest.approx(0.4)
    assert result.rms_tracking_error == pytest.approx(0.4 / np.sqrt(run.q.size))
    assert result.max_qp_error == pytest.approx(0.3)
    assert result.max_model_error == pytest.approx(0.4)


def test_unknown_accelerations_of_a_fallback_are_left_out() -> None:
    run = _simulated(_line())
    solved = run.wanted.copy()
    solved[6] = np.nan
    statuses = ("ok",) * 6 + ("fallback_invalid_input",) + ("ok",) * 94
    result = evaluate(replace(run, solved=solved, controller_status=statuses))
    assert result.max_qp_error == 0.0
    assert result.controller_status == {"fallback_invalid_input": 1, "ok": 100}


def test_contacts_displacement_and_clearance() -> None:
    ball = SceneObject.ball("ball", [0.8, 0.8, 0.0], radius=0.05, motion="free")
    poses = np.broadcast_to(pose_vector(ball.pose), (101, 1, 7)).copy()
    poses[60:, 0, 2] += 0.2
    contact = Contact(time=0.6, link="link2", obstacle="ball", depth=1e-4, force=3.0)
    result = evaluate(
        replace(_simulated(_line()), objects=(ball,), object_poses=poses, contacts=(contact, contact))
    )
    assert result.contacts == 2
    assert result.contact_pairs == ("link2 - ball",)
    assert result.max_contact_force_n == 3.0
    assert result.moved_objects == {"ball": pytest.approx(0.2)}
    assert not result.collision_free
    assert result.min_clearance_m is not None
    assert result.clearance_pair == "link2 - ball"
    assert result.clearance_time_s is not None


def test_grazing_between_samples_is_no_contact_but_not_collision_free() -> None:
    """Two samples only, a thin rod in between: no contact was counted, exact clearance knows better."""
    at = 0.8 * np.array([np.cos(0.7), np.sin(0.7)])
    rod = SceneObject("rod", "cylinder", size=(5e-4, 0.5), pose=pose_at([*at, 0.0]))
    q = np.array([[0.0, 0.0], [1.5, 0.0]])
    poses = np.broadcast_to(pose_vector(rod.pose), (2, 1, 7))
    result = evaluate(replace(_simulated(q), objects=(rod,), object_poses=poses))
    assert result.contacts == 0
    assert result.min_clearance_m is not None
    assert result.min_clearance_m <= 0.0
    assert not result.collision_free


@pytest.mark.parametrize("gap", [3e-4, 2e-5])  # [m], both below the tolerance of the first look, 1 mm
def test_a_narrow_gap_is_measured_until_it_is_sure(gap: float) -> None:
    ball = SceneObject.ball(
        "ball", [0.25, 0.0, 0.09 + gap], radius=0.05
    )  # above link 1, 4 cm thick either way
    poses = np.broadcast_to(pose_vector(ball.pose), (101, 1, 7))
    result = evaluate(replace(_simulated(_line()), objects=(ball,), object_poses=poses))
    assert result.min_clearance_m == pytest.approx(gap, abs=2e-9)  # Coal's point has a radius of 1e-9
    assert result.clearance_tolerance_m < gap
    assert result.collision_free
    # what could have touched, as far as the measurement knows, is not called free of collision
    assert not replace(result, clearance_tolerance_m=1e-3).collision_free


@pytest.mark.parametrize("physics", [True, False])
def test_json_has_the_figures_and_no_nan(physics: bool) -> None:
    run = _simulated(_line()) if physics else KinematicRun(**_columns(_line()))
    if isinstance(run, SimulationRun):
        run = replace(run, solved=np.full_like(run.q, np.nan))
    record = json.loads(json.dumps(evaluate(run).to_dict(), allow_nan=False))
    assert {
        "reached",
        "position_error_rad",
        "time_to_goal_s",
        "contacts",
        "min_clearance_m",
        "max_tracking_error",
        "max_torque_ratio",
        "collision_free",
    } <= record.keys()
    assert record["max_qp_error"] is None
    assert record["contacts"] == (0 if physics else None)
    assert record["limits"]["position"] == 0
