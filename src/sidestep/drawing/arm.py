"""An arm and the solids around it as shaded triangles, by Matplotlib: no display, no driver."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt
import trimesh
from matplotlib.colors import to_rgb
from mpl_toolkits.mplot3d.art3d import Poly3DCollection

from sidestep.drawing.palette import BLUE, FURNITURE, VERMILLION
from sidestep.math.pose import moved, pose_matrix
from sidestep.robot import Robot
from sidestep.shapes.mesh_reader import simplified

Array = npt.NDArray[np.float64]
Colour = tuple[float, float, float]

ARM_COLOUR: Colour = (0.78, 0.82, 0.88)
BASE_COLOUR: Colour = (0.60, 0.63, 0.68)
OBSTACLE_COLOUR: Colour = to_rgb(VERMILLION)
LARGE = 0.5  # [m] a solid of this size is paler: it would drown the arm
GHOST_COLOUR: Colour = to_rgb(BLUE)
GHOST_OPACITY = 0.16
LONGEST_EDGE = 0.06  # [m] of a triangle of a solid: as long as links are thick
SHARE = 0.05  # of the size of a solid: a thousand triangles or two
LIGHT = np.array([0.35, -0.55, 0.76])  # unit-length direction towards the lamp, world
AMBIENT = 0.35  # share of light that reaches a face turned away from the lamp
ARM_TRIANGLES = 8000  # at most, of the whole arm: 0.04 s to draw
FINEST_CELL = 2e-3  # [m] detail that nobody sees in a picture of an arm


class Solid(Protocol):
    """A thing to draw beside an arm, such as a `SceneObject`."""

    @property
    def pose(self) -> Array:
        """Pose (4, 4) in the world."""

    def __hash__(self) -> int: ...

    def surface(self) -> trimesh.Trimesh:
        """The surface in the frame of the thing [m]."""


def draw_arm(
    ax: Any,
    robot: Robot,
    q: Array,
    *,
    objects: Sequence[Solid] = (),
    object_poses: Array | None = None,
    colour: Colour = ARM_COLOUR,
    opacity: float = 1.0,
    ghost: Array | None = None,
) -> Poly3DCollection:
    """Draws an arm and the solids around it on a 3D axes, as one collection: near triangles hide far ones.

    Triangles that are sorted by their middles hide each other rightly where they are small: those of solids are cut
    into pieces, and those turned away from an orthographic view are left out.

    Args:
        ax: Matplotlib axes with projection "3d".
        robot, q: the arm at configuration (nv,).
        objects: what stands around it.
        object_poses: (num_objects, 7) position and quaternion (w, x, y, z), or None: their own.
        colour: of the moving links; opacity: of everything.
        ghost: a configuration (nv,) at which the arm is drawn once more, see-through: its goal.
    """
    collection = Poly3DCollection(np.zeros((0, 3, 3)), linewidths=0.8)
    ax.add_collection3d(collection, autolim=False)
    show_arm(
        collection,
        robot,
        q,
        objects=objects,
        object_poses=object_poses,
        colour=colour,
        opacity=opacity,
        ghost=ghost,
    )
    return collection


def show_arm(
    collection: Poly3DCollection,
    robot: Robot,
    q: Array,
    *,
    objects: Sequence[Solid] = (),
    object_poses: Array | None = None,
    colour: Colour = ARM_COLOUR,
    opacity: float = 1.0,
    ghost: Array | None = None,
) -> None:
    """Moves what `draw_arm` drew to another configuration; arguments as there."""
    triangles, colours = [np.zeros((0, 3, 3))], [np.zeros((0, 4))]

    def add(shape: Array, base: Colour, alpha: float) -> None:
        triangles.append(shape)
        colours.append(np.column_stack([_shaded(shape, base), np.full(len(shape), alpha)]))

    for link, moves, shape in arm_triangles(robot):
        add(moved(shape, robot.pose(q, link)), colour if moves else BASE_COLOUR, opacity)
        if ghost is not None and moves:
            add(moved(shape, robot.pose(ghost, link)), GHOST_COLOUR, GHOST_OPACITY)
    for i, item in enumerate(objects):
        pose = item.pose if object_poses is None else pose_matrix(object_poses[i])
        shape = solid_triangles(item)
        large = np.ptp(shape.reshape(-1, 3), axis=0).max(initial=0.0) > LARGE
        add(moved(shape, pose), to_rgb(FURNITURE) if large else OBSTACLE_COLOUR, opacity)
    every, rgba = np.concatenate(triangles), np.concatenate(colours)
    towards = _towards_viewer(collection)
    if towards is not None:
        normals = np.cross(every[:, 1] - every[:, 0], every[:, 2] - every[:, 0])
        turned = normals @ towards > 0.0
        every, rgba = every[turned], rgba[turned]
    edges = rgba.copy()  # which close hairlines between triangles; see-through they would be seen twice
    edges[rgba[:, 3] < 1.0, 3] = 0.0
    collection.set_verts(every)
    collection.set_facecolor(rgba)
    collection.set_edgecolor(edges)


def _towards_viewer(collection: Poly3DCollection) -> Array | None:
    """Unit vector (3,) from the scene to somebody who looks at it without perspective; None with perspective."""
    ax: Any = collection.axes
    if not np.isinf(getattr(ax, "_focal_length", 1.0)):
        return None
    return direction(ax.elev, ax.azim)


def direction(elevation_deg: float, azimuth_deg: float) -> Array:
    """Unit vector (3,) from the scene to somebody who looks from this elevation and azimuth [deg]."""
    elevation, azimuth = np.deg2rad(elevation_deg), np.deg2rad(azimuth_deg)
    return np.array(
        [np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth), np.sin(elevation)]
    )


@lru_cache(maxsize=8)
def arm_triangles(robot: Robot) -> tuple[tuple[str, bool, Array], ...]:
    """Per link: its name, whether a joint moves it, and its triangles (F, 3, 3) in the link frame [m]."""
    joint_of = {frame.name: frame.joint for frame in robot.frames}
    meshes: dict[str, trimesh.Trimesh] = {}
    for link in robot.links:
        shapes = [geometry.mesh() for geometry in link.visuals or link.collisions]
        if shapes:
            merged: Any = trimesh.util.concatenate(shapes)
            meshes[link.name] = merged
    cell = FINEST_CELL
    coarse = dict(meshes)
    while sum(len(mesh.faces) for mesh in coarse.values()) > ARM_TRIANGLES:
        coarse = {name: simplified(mesh, cell) for name, mesh in meshes.items()}
        cell *= 1.3
    return tuple(
        (name, joint_of[name] >= 0, np.array(mesh.triangles, dtype=float)) for name, mesh in coarse.items()
    )


@lru_cache(maxsize=64)
def solid_triangles(item: Solid) -> Array:
    """Triangles (F, 3, 3) of a solid in its own frame [m], none with an edge longer than `LONGEST_EDGE` or, of a large
    solid, `SHARE` of its size."""
    surface = item.surface()
    longest = max(LONGEST_EDGE, SHARE * float(np.ptp(surface.vertices, axis=0).max(initial=0.0)))
    subdivide: Any = trimesh.remesh.subdivide_to_size
    vertices, faces = subdivide(surface.vertices, surface.faces, longest)
    return np.array(vertices[faces], dtype=float)


def _shaded(triangles: Array, colour: Colour) -> Array:
    normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    lengths = np.linalg.norm(normals, axis=1)
    facing = (normals @ LIGHT) / np.where(lengths > 0.0, lengths, 1.0)
    brightness = AMBIENT + (1.0 - AMBIENT) * np.clip(0.5 + 0.5 * facing, 0.0, 1.0)
    shaded: Array = np.clip(brightness[:, None] * np.array(colour), 0.0, 1.0)
    return shaded
