"""Obstacles that are added stand away from the arm, from its goal and from each other, in sight."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from sidestep import ExactClearance, Robot
from sidestep.math.pose import pose_at
from sidestep.robot import tip_of
from sidestep.studio.clearance_monitor import solid_poses
from sidestep.studio.page.camera import HALF, RIGHT, UP, VIEW, Viewpoint
from sidestep.studio.page.placing import CLEAR, Camera, free_place
from sidestep.studio.scene_obstacle import SceneObstacle, ball, box, cloud, scattered
from sidestep.studio.start import ends

DOWN = np.diag([1.0, -1.0, -1.0])  # axes of a camera that looks down


@pytest.mark.parametrize("name", ["fr3", "planar2"])
def test_what_is_added_time_and_again_is_free_of_arm_and_goal_and_in_sight(name: str, tmp_path: Path) -> None:
    robot = Robot.named(name)
    start, goal = ends(robot)
    places = np.array([robot.pose(q, frame.name)[:3, 3] for q in (start, goal) for frame in robot.frames])
    view = Viewpoint.of(places)
    camera = Camera(view.position, np.column_stack([RIGHT, -UP, VIEW]), 2.0 * float(np.arctan(HALF)))
    gizmo = robot.pose(goal, tip_of(robot))[:3, 3], 0.2
    np.save(tmp_path / "plate.npy", scattered(0.2, seed=0))
    nowhere = np.zeros(3)
    added: list[SceneObstacle] = []
    for k in range(6):
        made = (
            ball(f"new{k}", nowhere, 0.06),
            box(f"new{k}", nowhere, np.full(3, 0.1)),
            cloud(f"new{k}", nowhere, tmp_path / "plate.npy", 0.012),
        )[k % 3]
        others = [(thing.start[:3, :3] @ thing.middle + thing.start[:3, 3], thing.size) for thing in added]
        postures = (
            (goal, start) if k < 3 else (start, goal)
        )  # at the goal, as after an arrival, and on the way
        place = free_place(robot, postures, others, gizmo, made.size, camera)
        assert camera.sees(place)
        assert np.linalg.norm(place - gizmo[0]) < 0.9  # [m] near the goal, though the first ones are there
        added.append(made.at(pose_at(place - made.middle)))
    solids = [solid for thing in added for solid in thing.solids]
    poses = solid_poses(tuple(added), np.array([thing.start for thing in added]))
    exact = ExactClearance(robot, solids)
    for q in (start, goal):
        assert exact.distance(q, poses).distance > CLEAR
    for k, thing in enumerate(added):
        for other in added[:k]:
            apart = np.linalg.norm(thing.start[:3, 3] + thing.middle - other.start[:3, 3] - other.middle)
            assert apart > thing.size + other.size + CLEAR


def test_a_file_is_put_where_it_says_if_that_is_free() -> None:
    robot = Robot.named("planar2")
    start, goal = ends(robot)
    gizmo, camera = (robot.pose(goal, "tip")[:3, 3], 0.2), Camera(np.array([0.0, 0.0, 3.0]), DOWN, 1.3)
    far, here = np.array([-0.8, 0.3, 0.0]), robot.pose(start, "tip")[:3, 3]
    np.testing.assert_array_equal(free_place(robot, (start, goal), [], gizmo, 0.1, camera, [far]), far)
    assert np.linalg.norm(free_place(robot, (start, goal), [], gizmo, 0.1, camera, [here]) - here) > 0.15


def test_without_room_it_is_said() -> None:
    robot = Robot.named("planar2")
    start, goal = ends(robot)
    gizmo, camera = (robot.pose(goal, "tip")[:3, 3], 0.2), Camera(np.array([0.0, 0.0, 3.0]), DOWN, 1.3)
    with pytest.raises(
        ValueError, match="no room for it near the goal; move the goal, or take a smaller one"
    ):
        free_place(robot, (start, goal), [(gizmo[0], 2.0)], gizmo, 0.1, camera)
