"""The curved configuration space: the graph of psi over two joints, with the motion on it."""

from __future__ import annotations

import threading
import time as clock
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from sidestep._core import GeometricSystem, JointType, Obstacles
from sidestep.body import Body
from sidestep.math.pose import pose_vector
from sidestep.robot import Robot
from sidestep.robot.configurations import finite_interval
from sidestep.scenario import Scenario
from sidestep.studio.messages import Snapshot
from sidestep.studio.methods import method_named
from sidestep.studio.page import colours
from sidestep.studio.page.arm import short_names
from sidestep.studio.page.camera import Viewpoint
from sidestep.studio.parameters import Method, Numbers
from sidestep.studio.systems import build_adapter

if TYPE_CHECKING:
    import viser

Array = npt.NDArray[np.float64]

CELLS = 60  # along each joint: 6 degrees of a joint that turns all the way round
SIDE = 1.2  # [m] of the surface in the scene
TOP = 0.3  # [m] above the plane at which hills are cut off, and open: the walls at joint limits would hide the rest
LINES, LIFT = 12, 2e-3  # of the net along each joint: of 30 degrees all the way round; [m] above the surface
GAP = 0.03  # [m] between the surface and the text beside it
LEAST_MOVE = 0.004  # [m] of an obstacle, or [rad] of a joint that is held, before it is computed again
PAUSE = 0.3  # [s] at least between two of them: the page has other things to do
TRAIL_POINTS, TRAIL_STEP = 150, 0.02  # [rad | m] of a joint between two points


@dataclass(frozen=True, eq=False)
class Request:
    """What the surface is to be computed from."""

    robot: Robot
    body: Body
    method: Method
    numbers: Numbers
    joints: tuple[int, int]
    q: Array
    points: Array
    radii: Array
    scenario: Scenario
    activations: Array  # (m,) clearances at which barriers begin, as in the loop; empty without any

    def differs(self, other: Request | None) -> bool:
        """Whether it would look different."""
        if other is None or self.joints != other.joints or not self.same_system(other):
            return True
        if not np.allclose(self.activations, other.activations, rtol=0.0, atol=LEAST_MOVE):
            return True
        held = np.delete(self.q - other.q, self.joints)
        if np.abs(held).max(initial=0.0) > 5.0 * LEAST_MOVE or self.points.shape != other.points.shape:
            return True
        return bool(np.abs(self.points - other.points).max(initial=0.0) > LEAST_MOVE)

    def same_system(self, other: Request) -> bool:
        """Whether both are of the same system."""
        mine, others = (
            (id(it.body), it.method.name, it.numbers, it.scenario.embedding, it.scenario.system)
            for it in (self, other)
        )
        return mine == others


class Surface:
    """|psi| over two joints, the others held where they are, to scale: a radian is as long upwards as sideways.

    Where psi has several coordinates its Euclidean norm is drawn. It is computed in a thread of its own from the same
    system that the loop runs. What goes wrong there is handed to `report`.
    """

    def __init__(
        self, server: viser.ViserServer, lock: threading.RLock, report: Callable[[str, Exception], None]
    ) -> None:
        self._server, self._lock, self._report = server, lock, report
        self._trail: deque[Array] = deque(maxlen=TRAIL_POINTS)
        self._parts: dict[str, Any] = {}
        self._request: Request | None = None
        self._done: Request | None = None
        self._heights: Array | None = None
        self._wake = threading.Event()
        self._system: tuple[Request, GeometricSystem] | None = None
        self._stopping = False
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def show(
        self,
        snapshot: Snapshot,
        robot: Robot,
        body: Body | None,
        joints: tuple[int, int] | None,
        viewpoint: Viewpoint,
    ) -> None:
        """The surface over two joints at the present state, in a corner of the window; no joints: none."""
        self._viewpoint = viewpoint
        if joints is None or body is None or joints[0] == joints[1]:
            self.clear()
            return
        method = method_named(snapshot.method)
        points, radii = seen(snapshot, bare=not method.controlled)
        numbers, scenario = snapshot.numbers[method.name], snapshot.scenario
        request = Request(
            robot, body, method, numbers, joints, snapshot.q, points, radii, scenario, snapshot.activations
        )
        if self._done is not None and (self._done.robot is not robot or self._done.joints != joints):
            self.clear()
        if request.differs(self._request):
            self._request = request
            self._wake.set()
        if self._heights is not None and self._done is not None:
            self._show_state(snapshot, robot, joints)

    def clear(self) -> None:
        """Takes everything out of the scene."""
        if "root" in self._parts:
            self._parts["root"].remove()
        self._parts, self._heights, self._request, self._done = {}, None, None, None
        self._trail.clear()

    def clear_trail(self) -> None:
        """Forgets where the joints have been."""
        self._trail.clear()

    def stop(self) -> None:
        """Ends the thread."""
        self._stopping = True
        self._wake.set()
        self._thread.join(timeout=2.0)

    @property
    def heights(self) -> Array | None:
        """|psi| (CELLS + 1, CELLS + 1) over the two joints, None while there is none."""
        return self._heights

    @property
    def trail(self) -> list[Array]:
        """Places (3,) in the frame of the surface where the joints have been, on the surface as it is now."""
        if self._done is None or self._heights is None:
            return []
        return [on_surface(self._done.robot, self._done.joints, q, self._heights) for q in self._trail]

    def place_of(self, name: str) -> Array:
        """Where the mark "state" or "goal" is in the frame of the surface, (3,)."""
        return np.array(self._parts[name].position)

    def _run(self) -> None:
        while True:
            self._wake.wait()
            self._wake.clear()
            if self._stopping:
                return
            try:
                self._compute()
            except Exception as error:  # it is computed again when something changes
                self._report("computing the curved space failed", error)
            clock.sleep(PAUSE)

    def _compute(self) -> None:
        request = self._request
        if request is None:
            return
        heights = heights_over(request, self._system_of(request))
        with self._lock:
            if self._request is not None and self._request.joints == request.joints:
                self._done, self._heights = request, heights
                self._show_surface(request, heights)

    def _system_of(self, request: Request) -> GeometricSystem:
        if self._system is None or not self._system[0].same_system(request):
            made = build_adapter(
                request.method,
                request.robot,
                request.body,
                request.numbers,
                request.scenario,
                synchronous=True,
            )
            self._system = request, made.system
        return self._system[1]

    def _show_surface(self, request: Request, heights: Array) -> None:
        x, y = (np.linspace(-0.5 * SIDE, 0.5 * SIDE, CELLS + 1) for _ in range(2))
        z = heights * scale(request.robot, request.joints)
        grid = np.stack([*np.meshgrid(x, y, indexing="ij"), np.minimum(z, TOP)], axis=-1).reshape(-1, 3)
        vertices, faces = grid.astype(np.float32), open_faces(z)
        if "surface" in self._parts:
            self._parts["surface"].vertices, self._parts["surface"].faces = vertices, faces
            self._segments("net", net(z), colours.NET, thickness=1.5)
            return
        where = pose_vector(self._viewpoint.corner(SIDE))
        self._parts["root"] = self._server.scene.add_frame(
            "/surface", show_axes=False, position=where[:3], wxyz=where[3:]
        )
        self._parts["surface"] = self._server.scene.add_mesh_simple(
            "/surface/mesh",
            vertices,
            faces,
            color=colours.rgb(colours.SURFACE),
            side="double",
            cast_shadow=False,
        )
        self._segments("net", net(z), colours.NET, thickness=1.5)
        half = 0.5 * SIDE
        self._segments(
            "axis", np.array([[[-half, half, 0.0], [-half, half, TOP]]]), colours.NET, thickness=2.5
        )
        for name, (text, place, anchor) in labels(request.robot, request.joints).items():
            self._parts[name] = self._server.scene.add_label(
                f"/surface/{name}", text, position=place, anchor=anchor, font_screen_scale=0.85
            )

    def _show_state(self, snapshot: Snapshot, robot: Robot, joints: tuple[int, int]) -> None:
        assert self._heights is not None
        if not self._trail or np.abs(snapshot.q - self._trail[-1])[list(joints)].max() > TRAIL_STEP:
            self._trail.append(np.array(snapshot.q))
        line = np.array([*self.trail, on_surface(robot, joints, snapshot.q, self._heights)])
        self._segments("trail", np.stack([line[:-1], line[1:]], axis=1), colours.TRAIL, thickness=4.0)
        self._mark("state", line[-1], colours.TRAIL)
        if snapshot.posture is not None:
            self._mark("goal", on_surface(robot, joints, snapshot.posture.q, self._heights), colours.GOAL)

    def _segments(self, name: str, ends: Array, colour: str, *, thickness: float) -> None:
        """Lines between pairs of points (n, 2, 3), new or in place of those there were."""
        segments = ends.astype(np.float32)
        if name not in self._parts:
            self._parts[name] = self._server.scene.add_line_segments(
                f"/surface/{name}",
                segments,
                colours.rgb(colour),
                thickness=thickness,
                thickness_units="screen",
            )
        elif not np.array_equal(self._parts[name].points, segments):
            self._parts[name].points = segments

    def _mark(self, name: str, place: Array, colour: str) -> None:
        if name not in self._parts:
            self._parts[name] = self._server.scene.add_icosphere(
                f"/surface/{name}", 0.022, color=colours.rgb(colour), subdivisions=2
            )
        self._parts[name].position = place


def seen(snapshot: Snapshot, *, bare: bool) -> tuple[Array, Array]:
    """Points (n, 3) [m] and radii (n,) [m] of all obstacles where they are, as the loop tells its system."""
    points, radii = [np.zeros((0, 3))], [np.zeros(0)]
    for thing, pose in zip(snapshot.things, snapshot.poses, strict=True):
        own, sizes = thing.seen(bare=bare)
        points.append(own @ pose[:3, :3].T + pose[:3, 3])
        radii.append(sizes)
    return np.concatenate(points), np.concatenate(radii)


def ranges(robot: Robot, joints: tuple[int, int]) -> tuple[Array, Array]:
    """Lower and upper end (2,) of what is drawn of two joints [rad | m]."""
    lower, upper = finite_interval(robot.limits)
    pick = list(joints)
    return np.array(lower[pick]), np.array(upper[pick])


def scale(robot: Robot, joints: tuple[int, int]) -> float:
    """Metres in the scene per radian of the longer of two joints; psi is drawn on the same scale."""
    lower, upper = ranges(robot, joints)
    return SIDE / float((upper - lower).max())


def heights_over(request: Request, system: GeometricSystem) -> Array:
    """|psi| (CELLS + 1, CELLS + 1) of a system with the barriers of the loop: at rest, over the whole range of two
    joints, the others as in `request.q`.
    """
    lower, upper = ranges(request.robot, request.joints)
    obstacles = Obstacles(request.points, request.radii) if len(request.points) else Obstacles.none()
    begin = request.activations if len(request.activations) == system.num_embedding_coordinates else None
    rest, q = np.zeros_like(request.q), np.array(request.q)
    heights = np.zeros((CELLS + 1, CELLS + 1))
    for i, first in enumerate(np.linspace(lower[0], upper[0], CELLS + 1)):
        for k, second in enumerate(np.linspace(lower[1], upper[1], CELLS + 1)):
            q[list(request.joints)] = first, second
            heights[i, k] = np.linalg.norm(system.acceleration(q, rest, q, obstacles, begin).values)
    return heights


def on_surface(robot: Robot, joints: tuple[int, int], q: Array, heights: Array) -> Array:
    """The place (3,) on the surface, in its frame, of a configuration (nv,): between the corners of its cell."""
    lower, upper = ranges(robot, joints)
    share = np.clip((np.asarray(q)[list(joints)] - lower) / (upper - lower), 0.0, 1.0)
    cell = np.minimum((share * CELLS).astype(int), CELLS - 1)
    (i, k), (f, g) = cell, share * CELLS - cell
    corners = heights[i : i + 2, k : k + 2]
    height = np.array([1.0 - f, f]) @ corners @ np.array([1.0 - g, g])
    z = min(float(height) * scale(robot, joints), TOP)
    return np.array([(share[0] - 0.5) * SIDE, (share[1] - 0.5) * SIDE, z])


def open_faces(z: Array) -> npt.NDArray[np.uint32]:
    """Triangles of a grid of heights z (n, n) [m] that lie below `TOP`."""
    index = np.arange(z.size).reshape(z.shape)
    a, b, c, d = index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]
    faces = np.stack([[a, b, c], [a, c, d]]).transpose(0, 2, 3, 1).reshape(-1, 3)
    return faces[(z.ravel()[faces] < TOP).all(axis=1)].astype(np.uint32)


def net(z: Array) -> Array:
    """Lines (n, 2, 3) on a grid of heights z (n, n) [m], along both joints, where it is below `TOP`."""
    axis = np.linspace(-0.5 * SIDE, 0.5 * SIDE, len(z))
    grid = np.stack([*np.meshgrid(axis, axis, indexing="ij"), z + LIFT], axis=-1)
    every = (len(z) - 1) // LINES
    along = [
        np.stack([line[:-1], line[1:]], axis=1) for g in (grid, grid.swapaxes(0, 1)) for line in g[::every]
    ]
    segments = np.concatenate(along)
    return segments[(segments[..., 2] < TOP + LIFT).all(axis=1)]


def labels(robot: Robot, joints: tuple[int, int]) -> dict[str, tuple[str, Array, Any]]:
    """Names and ends of the axes: text, place (3,) in the frame of the surface, and which part of the text is there."""
    lower, upper = ranges(robot, joints)
    names = short_names(robot.coordinate_names)
    turns = {joint.coordinate for joint in robot.joints if joint.type == JointType.revolute}
    half, found = 0.5 * SIDE, {}
    anchors = ("top-left", "top-center", "top-right"), ("bottom-left", "center-left", "center-left")
    for k, joint in enumerate(joints):
        out = np.array([0.0, -half - GAP, 0.0]) if k == 0 else np.array([half + GAP, 0.0, 0.0])
        here = [(-1.0, lower[k]), (0.0, names[joint]), (1.0, upper[k])]
        for (side, value), anchor in zip(here, anchors[k], strict=True):
            place = out + half * side * np.eye(3)[k]
            unit = "°" if joint in turns else " m"
            text = (
                value
                if isinstance(value, str)
                else f"{np.rad2deg(value) if joint in turns else value:.0f}{unit}"
            )
            found[f"label{k}{side:+.0f}"] = text, place, anchor
    found["label2+0"] = "0", np.array([-half - GAP, half, 0.0]), "center-right"
    found["label2+1"] = (
        f"ψ = {TOP / scale(robot, joints):.1f}",
        np.array([-half, half, TOP + GAP]),
        "bottom-center",
    )
    return found
