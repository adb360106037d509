"""Published problems through cameras: two for a planar arm, and why one is lost."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tests.bench.camera_stand_ins import needs_opengl

from sidestep import Body, Robot
from sidestep.bench import (
    CameraSceneSettings,
    ControllerRunner,
    Method,
    MotionSettings,
    camera_scene_table,
    read_motion_bench_maker,
)
from sidestep.bench.arm import Arm, Arms
from sidestep.bench.camera_loss import Loss, LossFinder, distances
from sidestep.bench.camera_runner import CameraRunner, Sighted
from sidestep.bench.problem import SceneProblem
from sidestep.distance import SceneObject
from sidestep.obstacles import Box, Cylinder, Sphere, pose_at

PLANAR = Path(__file__).parent / "motion_bench_maker_planar"
MOTION = MotionSettings(duration=6.0)


@pytest.fixture(scope="module")
def case(runner: ControllerRunner) -> tuple[Arm, SceneProblem, Sighted]:
    source = read_motion_bench_maker(PLANAR)[0]
    plain = Robot.named("planar3")
    arm = Arms("planar3", Method.controller, Body.cover(plain, components=3, cache=False)).of(source)
    problem, _ = arm.problem(source, spacing=0.04, point_radius=0.02)
    cameras = CameraRunner(
        arm, MOTION, cameras=1, size="424x240", noise="d435", unseen_is_free=True, exact_poses=False, seed=0
    )
    with needs_opengl():
        return arm, problem, cameras.move(problem)


def test_the_free_problem_is_solved_by_a_camera(case: tuple[Arm, SceneProblem, Sighted]) -> None:
    arm, problem, sighted = case
    outcome = arm.judge.judge(problem, sighted.motion, MOTION)
    assert outcome.success
    assert sighted.ended == "arrived"
    np.testing.assert_array_equal(sighted.motion.q[0], problem.start)
    # It looks around for half a second before it gets its goal: from then on times count.
    assert -0.5 <= sighted.log.first_seen.min() < -0.45
    assert 0.1 < np.isfinite(sighted.log.first_seen).mean() < 0.9  # the near half of the post


def test_what_is_wrong_is_far_from_all_solids(case: tuple[Arm, SceneProblem, Sighted]) -> None:
    arm, problem, sighted = case
    ghost = problem.objects[0].pose[:3, 3] + np.array([0.0, 0.0, 0.6])
    cells = {
        "centres": np.vstack([sighted.log.points[:5], ghost]),
        "radii": np.full(6, 0.03),
    }
    finder = LossFinder(arm, problem, replace(sighted, cells=cells), MOTION)
    np.testing.assert_array_equal(finder.wrong, [False] * 5 + [True])


def test_a_contact_is_hidden_late_or_with_what_was_seen(case: tuple[Arm, SceneProblem, Sighted]) -> None:
    arm, problem, sighted = case
    q = sighted.motion.q[:401]
    link = arm.robot.pose(q[200], arm.robot.links[-1].name)[:3, 3]
    ball = SceneObject.ball("ball", link, radius=0.02)
    struck = replace(problem, clearance=arm.clearance.among([ball]))
    motion = replace(sighted.motion, q=q, v=sighted.motion.v[:401], object_poses=np.zeros((401, 1, 7)))
    motion.object_poses[:, 0] = [*link, 1.0, 0.0, 0.0, 0.0]
    outcome = arm.judge.judge(struck, replace(motion, safe=False, a=motion.a[:401]), MOTION)
    assert outcome.collision
    first = outcome.clearance_time_s
    for seen, loss in ((np.inf, Loss.hidden), (first - 0.05, Loss.late), (-0.5, Loss.touched)):
        log = replace_log(sighted, link, seen)
        finder = LossFinder(arm, struck, replace(sighted, motion=motion, log=log), MOTION)
        assert finder.find(outcome)[0] is loss


def replace_log(sighted: Sighted, place: np.ndarray, seen: float) -> object:
    """A log with points around a place, seen at a time."""
    log = type(sighted.log)(place + 0.02 * np.vstack([np.eye(3), -np.eye(3)]))
    log.first_seen[:] = seen
    return log


def test_distances_from_solids() -> None:
    solids = [
        SceneObject.from_shape("box", Box((0.2, 0.4, 0.6), pose_at([0.0, 0.0, 0.0]))),
        SceneObject.from_shape("cylinder", Cylinder(radius=0.1, length=0.2, pose=pose_at([2.0, 0.0, 0.0]))),
        SceneObject.from_shape("sphere", Sphere(0.1, pose_at([4.0, 0.0, 0.0]))),
    ]
    points = np.array([[0.0, 0.1, 0.2], [0.4, 0.6, 0.0], [2.0, 0.4, 0.5], [4.0, 0.0, 0.5]])
    np.testing.assert_allclose(distances(solids, points), [0.0, 0.5, 0.5, 0.4])
    with pytest.raises(ValueError, match="allowed: box, cylinder, sphere"):
        distances([SceneObject("plane", "plane", size=(1.0,))], points)


def test_the_table_counts_losses_of_what_full_knowledge_solves() -> None:
    rows = [
        {"set": "a", "told_solved": True, "solved": True, "loss": None},
        {"set": "a", "told_solved": True, "solved": False, "loss": "voxels"},
        {"set": "b", "told_solved": False, "solved": False, "loss": "late"},
        {"set": "b", "told_solved": True, "solved": False, "loss": "touched"},
    ]
    table = camera_scene_table(rows)
    assert table["a"] == {
        "problems": 2, "told_solved": 2, "solved": 1, "lost": {"voxels": 1}, "touched_what_was_seen": 0
    }  # fmt: skip
    assert table["all"]["lost"] == {"voxels": 1, "touched": 1}
    assert (table["all"]["solved"], table["all"]["touched_what_was_seen"]) == (1, 1)
    with pytest.raises(ValueError, match="cameras is 3, allowed: 1 to 2"):
        CameraSceneSettings("panda", cameras=3)
