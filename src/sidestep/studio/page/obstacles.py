"""The obstacles in the scene: seen where the loop has them, dragged and thrown with the mouse."""

from __future__ import annotations

import time as clock
from collections import deque
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from sidestep.math.pose import from_quaternion, pose_at, pose_vector
from sidestep.shapes import Box, Sphere
from sidestep.studio import messages as m
from sidestep.studio.page import colours
from sidestep.studio.scene_obstacle import SceneObstacle

if TYPE_CHECKING:
    from collections.abc import Callable

    import viser

Array = npt.NDArray[np.float64]

THROW_MEMORY = 0.15  # [s] of a drag from which the speed of a throw is taken
LEAST_PATH = 4  # places of the hand at least: a slow browser reports few
FASTEST_THROW = 2.0  # [m/s]


class ObstacleViews:
    """All obstacles; a drag moves one in the plane of the screen, with shift held its release throws it."""

    def __init__(
        self, server: viser.ViserServer, send: Callable[[m.Command], None], on_select: Callable[[str], None]
    ) -> None:
        self._server, self._send, self._on_select = server, send, on_select
        self._views: dict[str, _View] = {}

    def set_things(self, things: tuple[SceneObstacle, ...]) -> None:
        """Shows these obstacles and no others."""
        for name, view in list(self._views.items()):
            if view.thing not in things:
                view.handle.remove()
                del self._views[name]
        for thing in things:
            if thing.name not in self._views:
                self._views[thing.name] = _View(self._server, thing, self._send, self._on_select)

    def show(self, things: tuple[SceneObstacle, ...], poses: Array) -> None:
        """Puts them where they are, poses (N, 4, 4)."""
        for thing, pose in zip(things, poses, strict=True):
            view = self._views.get(thing.name)
            if view is not None:
                view.show(pose)

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(self._views)


class _View:
    def __init__(
        self,
        server: viser.ViserServer,
        thing: SceneObstacle,
        send: Callable[[m.Command], None],
        on_select: Callable[[str], None],
    ) -> None:
        self.thing = thing
        self._send, self._on_select = send, on_select
        self._pose = np.zeros((4, 4))
        self._grip = np.zeros(3)
        self._path: deque[tuple[float, Array]] = deque()
        large = thing.size > colours.LARGE and thing.cloud is None
        name, colour = (
            f"/obstacles/{thing.name}",
            colours.rgb(colours.FURNITURE if large else colours.OBSTACLE),
        )
        solid = thing.solids[0]
        if thing.cloud is not None:
            unit = solid.surface(subdivisions=1)
            self.handle: Any = server.scene.add_batched_meshes_simple(
                name,
                unit.vertices.astype(np.float32),
                unit.faces.astype(np.uint32),
                batched_wxyzs=np.tile([1.0, 0.0, 0.0, 0.0], (len(thing.cloud), 1)),
                batched_positions=thing.cloud,
                batched_colors=colours.batched(colours.rgb(colours.OBSTACLE)),
            )
        elif isinstance(solid.shape, Sphere):
            self.handle = server.scene.add_icosphere(name, solid.shape.radius, color=colour)
        elif isinstance(solid.shape, Box):
            self.handle = server.scene.add_box(name, color=colour, dimensions=np.array(solid.size))
            server.scene.add_line_segments(  # faces that the light does not reach look alike
                f"{name}/edges",
                box_edges(np.array(solid.size)),
                colours.rgb(colours.EDGE),
                thickness=1.5,
                thickness_units="screen",
            )
        else:
            mesh = solid.surface()
            self.handle = server.scene.add_mesh_simple(
                name,
                mesh.vertices.astype(np.float32),
                mesh.faces.astype(np.uint32),
                color=colour,
                flat_shading=True,
            )
        self.show(thing.start)
        self.handle.on_drag("left")(self._dragged)
        self.handle.on_drag("left", modifier="shift")(self._dragged)

        self.handle.on_click(self._clicked)

    def show(self, pose: Array) -> None:
        if np.array_equal(pose, self._pose):
            return
        self._pose = pose
        vector = pose_vector(pose)
        self.handle.position, self.handle.wxyz = vector[:3], vector[3:]

    async def _clicked(self, _: Any) -> None:
        self._on_select(self.thing.name)

    async def _dragged(self, event: Any) -> None:  # async: in order, on viser's own thread
        hand, now = np.array(event.end_position), clock.monotonic()
        if event.phase == "start":
            self._on_select(self.thing.name)
            self._grip = self._pose[:3, 3] - np.array(event.start_position)
            self._path.clear()
        self._path.append((now, hand))
        while len(self._path) > LEAST_PATH and now - self._path[0][0] > THROW_MEMORY:
            self._path.popleft()
        if event.phase == "end" and event.modifier == "shift":
            self._send(m.ThrowObstacle(self.thing.name, throw_velocity(list(self._path))))
        else:
            self._send(m.DragObstacle(self.thing.name, pose_at(hand + self._grip, self._pose[:3, :3])))


def box_edges(size: Array) -> npt.NDArray[np.float32]:
    """The edges (12, 2, 3) of a box with these sides (3,) [m] around the origin."""
    corners = np.array([[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)])
    pairs = [(i, j) for i in range(8) for j in range(i + 1, 8) if (corners[i] != corners[j]).sum() == 1]
    edges: npt.NDArray[np.float32] = (corners[np.array(pairs)] * size).astype(np.float32)
    return edges


def throw_velocity(path: list[tuple[float, Array]]) -> Array:
    """The velocity (3,) [m/s] of a hand that was at places (3,) at times [s], at most `FASTEST_THROW`."""
    if len(path) < 2 or path[-1][0] <= path[0][0]:
        return np.zeros(3)
    velocity: Array = (path[-1][1] - path[0][1]) / (path[-1][0] - path[0][0])
    speed = float(np.linalg.norm(velocity))
    return velocity * min(1.0, FASTEST_THROW / speed) if speed > 0.0 else velocity


def gizmo_pose(gizmo: Any) -> Array:
    """The pose (4, 4) of a viser gizmo."""
    return pose_at(np.array(gizmo.position), from_quaternion(np.array(gizmo.wxyz)))
