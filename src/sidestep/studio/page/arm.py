"""An arm in the scene: a frame for every link with its mesh, and the ellipsoids of its body."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt
import trimesh

from sidestep.math.pose import pose_vector
from sidestep.robot import Geometry, Robot
from sidestep.shapes.mesh_reader import simplified
from sidestep.studio.page import colours

if TYPE_CHECKING:
    import viser

    from sidestep.body import Body

Array = npt.NDArray[np.float64]

MOST_TRIANGLES = 60_000  # of an arm: a megabyte or two for each browser
FIRST_CELL = 1e-3  # [m] detail that is given up first
SHARP = 0.6  # [rad] edges sharper than this stay edges
OPACITY = 0.22  # of a ghost
SKIN = 2e-3  # [m] that a ghost is larger than its arm: surfaces in one place flicker, as of links that turn in place
LEAST_REACH = 0.3  # [m] what the page is laid out for at least
SAME, LEVER = (
    5e-3,
    0.3,
)  # [m] links less apart than this are in one place, of which points lie this far from the frame
TWO_DEVIATIONS = 4.0  # level of the ellipsoids of a body that is not calibrated: two standard deviations


class ArmView:
    """An arm of `link_meshes`; `ghost` is the colour of one that is see-through.

    Links with a mesh have a frame, and those of `frames`.
    """

    def __init__(
        self,
        server: viser.ViserServer,
        robot: Robot,
        meshes: dict[str, trimesh.Trimesh],
        name: str,
        *,
        ghost: str | None = None,
        frames: Iterable[str] = (),
    ) -> None:
        self._robot, self._name = robot, name
        self.root = server.scene.add_frame(name, show_axes=False)
        self._frames: dict[str, Any] = {}
        self._meshes: dict[str, Any] = {}
        self._shades: dict[str, int] = {}
        self._apart: tuple[Array, Array] = np.zeros(0), np.zeros(0)
        moving = {frame.name: frame.joint >= 0 for frame in robot.frames}
        for link in dict.fromkeys((*meshes, *frames)):
            self._frames[link] = server.scene.add_frame(f"{name}/{link}", show_axes=False)
        for link, mesh in meshes.items():
            colour = ghost or (colours.LINK if moving[link] else colours.BASE)
            if ghost and not moving[link]:
                continue  # the base stands where the arm's own does
            self._meshes[link] = server.scene.add_mesh_simple(
                f"{name}/{link}/mesh",
                np.asarray(mesh.vertices + SKIN * bool(ghost) * mesh.vertex_normals, dtype=np.float32),
                np.asarray(mesh.faces, dtype=np.uint32),
                color=colours.rgb(colour),
                opacity=OPACITY if ghost else None,
                side="double",
                cast_shadow=not ghost,
                receive_shadow=not ghost,
            )
        self._moving = [link for link in self._frames if moving[link]]
        self._q = np.zeros(0)
        self.show(robot.neutral, every=True)

    def show(self, q: Array, *, every: bool = False) -> None:
        """Puts the links where they are at q (nv,)."""
        if not every and np.array_equal(q, self._q):
            return
        self._q = np.array(q)
        for link in self._frames if every else self._moving:
            vector = pose_vector(self._robot.pose(q, link))
            frame = self._frames[link]
            frame.position, frame.wxyz = vector[:3], vector[3:]

    def colour(self, clearances: dict[str, float], *, lit: str = "") -> None:
        """Colours the links by their clearance [m]; one may be `lit`."""
        for link in self._moving:
            shade = colours.SHADE_LIT if link == lit else colours.shade(clearances.get(link, np.inf))
            if link in self._meshes and self._shades.get(link, 0) != shade:
                self._shades[link] = shade
                self._meshes[link].color = colours.shade_colour(shade)

    def hide_where_at(self, q: Array) -> None:
        """Hides the links that are where they are at q (nv,): two surfaces in one place flicker."""
        if np.array_equal(q, self._apart[0]) and np.array_equal(self._q, self._apart[1]):
            return
        self._apart = np.array(q), self._q
        for link in self._moving:
            if link in self._meshes:
                moved = np.abs(self._robot.pose(q, link) - self._robot.pose(self._q, link))[:3]
                self._meshes[link].visible = bool(moved[:, 3].max() + LEVER * moved[:, :3].max() > SAME)

    def set_meshes_visible(self, visible: bool) -> None:
        """Shows or hides the meshes; what else is fixed to the frames stays."""
        for mesh in self._meshes.values():
            mesh.visible = visible

    @property
    def q(self) -> Array:
        """The configuration (nv,) that is shown."""
        return self._q

    @property
    def shades(self) -> dict[str, int]:
        """The shade of each link that has one, see `colours.shade`."""
        return dict(self._shades)

    def remove(self) -> None:
        """Takes it out of the scene."""
        self.root.remove()


class BodyView:
    """The ellipsoids of a body, fixed to the frames of an `ArmView` called `arm`."""

    def __init__(
        self, server: viser.ViserServer, robot: Robot, body: Body, arm: str, *, visible: bool
    ) -> None:
        joints = {frame.name: frame.joint for frame in robot.frames}
        unit = trimesh.creation.icosphere(subdivisions=2)
        links = np.asarray(body.links)
        levels = np.full(len(links), TWO_DEVIATIONS) if body.levels is None else np.asarray(body.levels)
        self.body = body
        self._batches: dict[str, Any] = {}
        self._shades: dict[str, int] = {}
        for link in dict.fromkeys(body.links):
            own = np.flatnonzero(links == link)
            poses, scales = [], []
            for k in own:
                values, axes = np.linalg.eigh(body.covariances[k])
                if np.linalg.det(axes) < 0.0:
                    axes[:, 0] *= -1.0
                X = np.eye(4)
                X[:3, :3], X[:3, 3] = axes, body.means[k]
                poses.append(pose_vector(X))
                scales.append(np.sqrt(levels[k] * values))
            vectors = np.array(poses)
            self._batches[link] = server.scene.add_batched_meshes_simple(
                f"{arm}/{link}/body",
                unit.vertices.astype(np.float32),
                unit.faces.astype(np.uint32),
                batched_wxyzs=vectors[:, 3:],
                batched_positions=vectors[:, :3],
                batched_scales=np.array(scales),
                batched_colors=colours.batched(
                    colours.rgb(colours.BASE if joints[link] < 0 else colours.LINK)
                ),
                opacity=0.6,
                cast_shadow=False,
                receive_shadow=False,
                visible=visible,
            )

    def colour(self, shades: dict[str, int]) -> None:
        """Colours it as the links are, by their shades."""
        for link, shade in shades.items():
            if link in self._batches and self._shades.get(link, 0) != shade:
                self._shades[link] = shade
                colour = colours.batched(colours.shade_colour(shade))
                self._batches[link].batched_colors = np.array(colour, dtype=np.uint8)

    def set_visible(self, visible: bool) -> None:
        for batch in self._batches.values():
            batch.visible = visible

    def remove(self) -> None:
        """Takes it out of the scene."""
        for batch in self._batches.values():
            batch.remove()


def reach(robot: Robot) -> float:
    """Distance [m] from the world's origin to the farthest frame at rest, at least `LEAST_REACH`."""
    places = [robot.pose(robot.neutral, frame.name)[:3, 3] for frame in robot.frames]
    return max(LEAST_REACH, *(float(np.linalg.norm(place)) for place in places))


def link_meshes(robot: Robot, most: int = MOST_TRIANGLES) -> dict[str, trimesh.Trimesh]:
    """What each link looks like, in its frame, together at most `most` triangles."""
    return merged_meshes({link.name: link.visuals or link.collisions for link in robot.links}, most)


def merged_meshes(
    geometries: Mapping[str, Sequence[Geometry]], most: int = MOST_TRIANGLES
) -> dict[str, trimesh.Trimesh]:
    """The shapes of each link as one mesh in its frame, all together at most `most` triangles."""
    whole: dict[str, trimesh.Trimesh] = {}
    for link, shapes in geometries.items():
        parts = [shape.mesh() for shape in shapes]
        if parts:
            merged: Any = trimesh.util.concatenate([trimesh.Trimesh(s.vertices, s.faces) for s in parts])
            whole[link] = merged
    meshes, cell = whole, FIRST_CELL
    while (count := sum(len(mesh.faces) for mesh in meshes.values())) > most:
        if meshes is not whole:
            cell *= max(1.1, np.sqrt(count / most))  # triangles are as many as there are cells on a surface
        meshes = {name: simplified(mesh, cell) for name, mesh in whole.items()}
    return {name: trimesh.graph.smooth_shade(mesh, angle=SHARP) for name, mesh in meshes.items()}


def short_names(names: Sequence[str]) -> list[str]:
    """Names of joints without the parts between underscores that all of them begin or end with."""
    parts = [name.split("_") for name in names]
    first, last = 0, 0
    while all(len(part) > first + 1 and part[first] == parts[0][first] for part in parts):
        first += 1
    while all(len(part) > first + last + 1 and part[-1 - last] == parts[0][-1 - last] for part in parts):
        last += 1
    if any(part[first].isdigit() for part in parts):  # "joint_1", not "1"
        first = max(first - 1, 0)
    return ["_".join(part[first : len(part) - last]) for part in parts]
