"""The arm in the scene, and the controls that move it."""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
import numpy.typing as npt

from sidestep.drawing.palette import ORANGE
from sidestep.math.pose import moved
from sidestep.robot import Robot
from sidestep.studio.page import colours
from sidestep.studio.page.arm import SKIN, ArmView, BodyView, merged_meshes, reach
from sidestep.studio.page.camera import Viewpoint
from sidestep.studio.page.joint_sliders import JointSliders
from sidestep.studio.page.scene import point_cameras, set_up_scene
from sidestep.studio.show.body_at_hand import body_at_hand
from sidestep.studio.show.facts import configuration_html
from sidestep.studio.show.facts_panel import FactsPanel
from sidestep.studio.show.reading import Reading
from sidestep.studio.show.shapes import DrawableShapes

if TYPE_CHECKING:
    import trimesh
    import viser

Array = npt.NDArray[np.float64]

WIDTH = 365  # [px] of the panel with the controls
AXES, THICKNESS = 0.14, 0.003  # of the reach: length and radius of the axes of base and tip
MIDDLE, ZERO = "Middle", "Zero"
MARGIN = 0.1  # of the reach, around the frames: an arm file has no meshes


class ShowView:
    """The arm, its base and tip frames, sliders, postures and switches.

    Args:
        server: of the page. reading: what was read. shapes: of its links. panel: which the document comes from.
        on_configuration: called with the configuration (nv,) whenever another one is shown.
    """

    def __init__(
        self,
        server: viser.ViserServer,
        reading: Reading,
        shapes: DrawableShapes,
        panel: FactsPanel,
        on_configuration: Callable[[Array], None],
    ) -> None:
        self._server, self._robot, self._panel = server, reading.robot, panel
        self._on_configuration = on_configuration
        self._lock = threading.Lock()
        robot = reading.robot
        set_up_scene(server)
        server.gui.configure_theme(control_width="medium", show_logo=False, show_share_button=False)
        server.gui.main_panel.dock_right()
        server.gui.main_panel.set_width(WIDTH)
        meshes = merged_meshes(shapes.seen)
        self.arm = ArmView(server, robot, meshes, "/arm", frames=[frame.name for frame in robot.frames])
        self._shapes = shapes
        self.collision: list[Any] = []  # drawn when they are asked for
        body = body_at_hand(reading)
        self.body = None if body is None else BodyView(server, robot, body, "/arm", visible=False)
        self._axes = [
            self._add_axes(robot.frames[0].name, "base", anchor="top-right"),
            self._add_axes(
                reading.tip, "tip", anchor="top-left"
            ),  # beside that of the base where both are in one place
        ]
        point_cameras(server, Viewpoint.of(_extent(robot, meshes)))
        self._add_switches()
        self._add_postures()
        self._sliders = JointSliders(server, robot, self.show, hint="position of")
        self._words: Any = server.gui.add_html("")
        self.show(robot.neutral)

    def show(self, q: Array) -> None:
        """Moves arm and sliders to q (nv,)."""
        with self._lock, self._server.atomic():
            self.arm.show(q)
            self._sliders.show(q)
            self._words.content = configuration_html(self._panel.document, q.tolist())
            self._panel.show_touching(None)
        self._on_configuration(q)

    def stamp(self) -> int:
        """See `FactsPanel.stamp`."""
        return self._panel.stamp()

    def _add_axes(self, link: str, what: str, *, anchor: Literal["top-left", "top-right"]) -> Any:
        scene, size = self._server.scene, reach(self._robot)
        name = f"/arm/{link}/{what}_axes"
        axes = scene.add_frame(name, axes_length=AXES * size, axes_radius=THICKNESS * size)
        scene.add_label(f"{name}/name", f"{what}: {link}", anchor=anchor)
        return axes

    def _add_switches(self) -> None:
        gui, has_meshes = self._server.gui, any(self._shapes.seen.values())
        if has_meshes:
            seen = gui.add_checkbox("visual meshes", True)
            seen.on_update(lambda _: self.arm.set_meshes_visible(seen.value))
            shapes = gui.add_checkbox("collision shapes", False)
            shapes.on_update(lambda _: self._show_collision(shapes.value))
        if self.body is not None:
            body = self.body
            ellipsoids = gui.add_checkbox("ellipsoids", not has_meshes)
            ellipsoids.on_update(lambda _: body.set_visible(ellipsoids.value))
            body.set_visible(not has_meshes)
        frames = gui.add_checkbox("base, tip axes", True)
        frames.on_update(lambda _: _set_visible(self._axes, frames.value))

    def _show_collision(self, visible: bool) -> None:
        with self._lock:
            if visible and not self.collision:
                self.collision = _add_collision_shapes(self._server, self._shapes)
        _set_visible(self.collision, visible)

    def _add_postures(self) -> None:
        robot = self._robot
        zero = np.clip(np.zeros(robot.num_coordinates), robot.limits.lower, robot.limits.upper)
        postures = {MIDDLE: np.array(robot.neutral), ZERO: zero, **robot.postures}
        buttons = self._server.gui.add_button_group(
            "Postures", tuple(postures), hint=f"{ZERO}: as near to it as the limits allow"
        )
        buttons.on_click(lambda event: self.show(postures[event.target.value]))


def _extent(robot: Robot, meshes: Mapping[str, trimesh.Trimesh]) -> Array:
    """Points (n, 3) [m] around the arm at rest: its frames, and the corners of boxes around its meshes."""
    around = MARGIN * reach(robot) * np.array([[1.0, 1.0, 1.0], [-1.0, -1.0, 0.0]])
    poses = {frame.name: robot.pose(robot.neutral, frame.name) for frame in robot.frames}
    corners = [moved(np.array(mesh.bounding_box.vertices), poses[link]) for link, mesh in meshes.items()]
    return np.concatenate([*(pose[:3, 3] + around for pose in poses.values()), *corners])


def _add_collision_shapes(server: viser.ViserServer, shapes: DrawableShapes) -> list[Any]:
    """What distances are measured on, see-through, fixed to the frames of the links."""
    return [
        server.scene.add_mesh_simple(
            f"/arm/{link}/collision",
            np.asarray(mesh.vertices + SKIN * mesh.vertex_normals, dtype=np.float32),
            np.asarray(mesh.faces, dtype=np.uint32),
            color=colours.rgb(ORANGE),
            opacity=0.5,
            side="double",
            cast_shadow=False,
            receive_shadow=False,
        )
        for link, mesh in merged_meshes(shapes.collision).items()
    ]


def _set_visible(parts: list[Any], visible: bool) -> None:
    for part in parts:
        part.visible = visible
