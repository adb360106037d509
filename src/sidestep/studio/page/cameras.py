"""From where all windows look at the scene."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from sidestep.robot import Robot, tip_of
from sidestep.scenario import Scenario
from sidestep.scenario.assembly import coordinates, goal_posture
from sidestep.studio.page.arm import reach
from sidestep.studio.page.camera import HIGH, UNDER_CORNER, Viewpoint, clear_view, extent
from sidestep.studio.page.goal import GIZMO_SIZE
from sidestep.studio.page.scene import point_cameras
from sidestep.studio.scene_obstacle import things_of

if TYPE_CHECKING:
    import trimesh
    import viser

NEAR = 2.0  # of the arm's reach: what is farther off need not be in the window as it opens


class Cameras:
    """Shows arm, goal and obstacles of a scenario from where they are seen best.

    Args:
        scenario, robot, meshes: what is shown. meshes: of the robot, by link.
    """

    def __init__(
        self,
        server: viser.ViserServer,
        scenario: Scenario,
        robot: Robot,
        meshes: dict[str, trimesh.Trimesh],
    ) -> None:
        self._server = server
        start = coordinates(scenario.start, robot, "start")
        ends = start, goal_posture(scenario, robot, start).q
        solids = [thing.triangles for thing in things_of(scenario)]
        arrows = robot.pose(ends[1], tip_of(robot))[:3, 3] + GIZMO_SIZE * reach(robot) * np.vstack(
            [np.eye(3), -np.eye(3)]
        )
        self._places = np.vstack([extent(robot, meshes, ends, solids, NEAR * reach(robot)), arrows])
        frames = np.array([robot.pose(q, frame.name)[:3, 3] for q in ends for frame in robot.frames])
        self._view = clear_view(frames, solids)

    def point(self, *, beside_surface: bool) -> None:
        """Points all windows, those to come as well, at the scene; the curved space has the upper left."""
        self.viewpoint = Viewpoint.of(self._places, self._view, UNDER_CORNER if beside_surface else HIGH)
        point_cameras(self._server, self.viewpoint)
