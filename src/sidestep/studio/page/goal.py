"""The goal: a ghost arm, a gizmo at its tip, and a slider for each joint."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from sidestep.math.pose import pose_vector
from sidestep.robot import Robot
from sidestep.simulation.pose_target import IkSolution
from sidestep.studio import messages as m
from sidestep.studio.page import colours
from sidestep.studio.page.arm import ArmView, reach
from sidestep.studio.page.joint_sliders import JointSliders
from sidestep.studio.page.obstacles import gizmo_pose

if TYPE_CHECKING:
    import trimesh
    import viser

Array = npt.NDArray[np.float64]

GIZMO_SIZE = 0.22  # of the distance to the farthest link at rest


class GoalControl:
    """Where the arm is sent: by sliders to a configuration, by the gizmo to a pose of the tip.

    The ghost shows where the arm is led to: of a pose the posture that was found for it last.
    """

    def __init__(
        self,
        server: viser.ViserServer,
        robot: Robot,
        meshes: dict[str, trimesh.Trimesh],
        tip: str,
        send: Callable[[m.Command], None],
    ) -> None:
        self._robot, self._tip, self._send = robot, tip, send
        self.q = np.array(robot.neutral)
        self.ghost = ArmView(server, robot, meshes, "/goal", ghost=colours.GOAL)
        self.gizmo = server.scene.add_transform_controls(
            "/goal_gizmo", scale=GIZMO_SIZE * reach(robot), depth_test=False, line_width=3.0
        )
        self.kind = server.gui.add_markdown("")
        self._sliders = JointSliders(server, robot, self._moved, hint="goal of")
        self._pose: Array | None = None
        self.gizmo.on_update(self._dragged)
        self._known: tuple[Array | None, ...] = (None, None, None)

    def show(self, goal: Array | None, pose: Array | None, posture: IkSolution | None) -> None:
        """Shows the goal that the loop has, whoever set it; does nothing while it stays the same, or is not found."""
        if posture is None:
            return
        now = goal, pose, posture.q
        if all(map(same, now, self._known)):
            return
        self._known, self.q = now, posture.q
        if goal is not None:
            self._place_gizmo(self._robot.pose(goal, self._tip))
            self.kind.content = "**Goal: a configuration.** Move a slider, or drag the gizmo for a pose."
        elif pose is not None:
            self._place_gizmo(pose)
            where = "" if posture.found else " **Out of reach**: the ghost is as near as was found."
            self.kind.content = f"**Goal: a pose** of `{self._tip}`.{where} Drag the gizmo, or move a slider."
        self.ghost.show(self.q)
        self._sliders.show(self.q)

    def set_visible(self, visible: bool) -> None:
        self.ghost.root.visible = visible
        self.gizmo.visible = visible

    def remove(self) -> None:
        for part in (self.ghost, self.gizmo, self.kind, self._sliders):
            part.remove()

    def _place_gizmo(self, pose: Array) -> None:
        vector = pose_vector(pose)
        if not np.allclose(gizmo_pose(self.gizmo), pose, atol=1e-6):
            self.gizmo.position, self.gizmo.wxyz = vector[:3], vector[3:]

    async def _dragged(self, event: Any) -> None:
        self._send(m.SetPoseGoal(gizmo_pose(self.gizmo), thorough=event.phase == "end"))

    def _moved(self, q: Array) -> None:
        self._send(m.SetJointGoal(q))


def same(a: Array | None, b: Array | None) -> bool:
    """Whether both are None, or equal arrays."""
    return a is b if a is None or b is None else np.array_equal(a, b)
