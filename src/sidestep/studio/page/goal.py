"""The goal: a ghost arm, a gizmo at its tip, and a slider for each joint."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from sidestep._core import JointType
from sidestep.robot import Robot
from sidestep.robot.pose import pose_vector
from sidestep.simulation.pose_target import IkSolution
from sidestep.studio import messages as m
from sidestep.studio.page.arm import ArmView, reach, short_names
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
        self.ghost = ArmView(server, robot, meshes, "/goal", ghost=True)
        self.gizmo = server.scene.add_transform_controls(
            "/goal_gizmo", scale=GIZMO_SIZE * reach(robot), depth_test=False, line_width=3.0
        )
        self.kind = server.gui.add_markdown("")
        self._sliders: list[Any] = []
        revolute = {joint.coordinate for joint in robot.joints if joint.type == JointType.revolute}
        lower, upper = robot._finite_interval()
        labels = short_names(robot.coordinate_names)
        for k, name in enumerate(robot.coordinate_names):
            unit, factor = ("°", 180.0 / np.pi) if k in revolute else ("m", 1.0)
            low, high = factor * lower[k], factor * upper[k]
            slider = server.gui.add_slider(
                f"{labels[k]} [{unit}]",
                min=float(np.ceil(10.0 * low) / 10.0) if unit == "°" else float(low),
                max=float(np.floor(10.0 * high) / 10.0) if unit == "°" else float(high),
                step=0.1 if unit == "°" else 0.001,
                initial_value=float(np.round(factor * self.q[k], 1)),
                hint=f"goal of {name}",
            )
            slider.on_update(self._moved)
            self._sliders.append(slider)
        self._factors = np.array([180.0 / np.pi if k in revolute else 1.0 for k in range(len(self.q))])
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
        for slider, value in zip(self._sliders, self._factors * self.q, strict=True):
            slider.value = float(np.clip(round(float(value), 4), slider.min, slider.max))

    def set_visible(self, visible: bool) -> None:
        self.ghost.root.visible = visible
        self.gizmo.visible = visible

    def remove(self) -> None:
        for part in (self.ghost, self.gizmo, self.kind, *self._sliders):
            part.remove()

    def _place_gizmo(self, pose: Array) -> None:
        vector = pose_vector(pose)
        if not np.allclose(gizmo_pose(self.gizmo), pose, atol=1e-6):
            self.gizmo.position, self.gizmo.wxyz = vector[:3], vector[3:]

    async def _dragged(self, event: Any) -> None:
        self._send(m.SetPoseGoal(gizmo_pose(self.gizmo), thorough=event.phase == "end"))

    async def _moved(self, event: Any) -> None:
        if event.client is None:  # set by `show`
            return
        values = np.array([slider.value for slider in self._sliders]) / self._factors
        limits = self._robot.limits
        self._send(m.SetJointGoal(np.clip(values, limits.lower, limits.upper)))


def same(a: Array | None, b: Array | None) -> bool:
    """Whether both are None, or equal arrays."""
    return a is b if a is None or b is None else np.array_equal(a, b)
