"""Pictures of an arm in its scene, by Matplotlib alone: no display and no graphics driver needed."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import lru_cache
from typing import Any

import numpy as np
import numpy.typing as npt
import trimesh
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from mpl_toolkits.mplot3d.art3d import Poly3DCollection

from sidestep._core import JointType
from sidestep.robot import Robot
from sidestep.simulation.pose import pose_matrix, pose_vector
from sidestep.simulation.run import Run
from sidestep.simulation.scene import SceneObject

Array = npt.NDArray[np.float64]
Colour = tuple[float, float, float]

ARM_COLOUR: Colour = (0.86, 0.87, 0.90)
BASE_COLOUR: Colour = (0.62, 0.64, 0.68)
OBSTACLE_COLOUR: Colour = (0.84, 0.16, 0.12)
TRACE_COLOUR: Colour = (0.10, 0.42, 0.75)
LIGHT = np.array([0.35, -0.55, 0.76])  # unit-length direction towards the lamp, world
AMBIENT = 0.45  # share of light that reaches a face turned away from the lamp
ARM_TRIANGLES = 8000  # of the whole arm in a picture: about 0.1 s to draw
TRACE_POINTS = 400  # of the line that the tip draws
FINEST_CELL = 2e-3  # [m] detail that nobody sees in a picture of an arm


def draw_arm(
    ax: Any,
    robot: Robot,
    q: Array,
    *,
    objects: Sequence[SceneObject] = (),
    object_poses: Array | None = None,
    colour: Colour = ARM_COLOUR,
    opacity: float = 1.0,
) -> Poly3DCollection:
    """Draws an arm and the objects around it as shaded triangles on a 3D axes.

    Everything is one collection, so that near triangles hide far ones across links and objects.

    Args:
        ax: Matplotlib axes with projection "3d".
        robot, q: the arm at configuration (nv,).
        objects, object_poses: the scene; poses (num_objects, 7), or at time 0.
        colour: of the moving links; opacity: of everything.
    """
    triangles, colours = _picture(robot, q, objects, object_poses, colour)
    collection = Poly3DCollection(triangles, linewidths=0.4)
    _paint(collection, colours, opacity)
    ax.add_collection3d(collection)
    return collection


def render_frames(
    run: Run,
    *,
    frames: int = 60,
    width: int = 640,
    height: int = 480,
    elevation: float | None = None,
    azimuth: float | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> list[npt.NDArray[np.uint8]]:
    """Pictures of a run at equal time intervals, the first and the last sample included.

    Args:
        run: simulated or kinematic.
        frames: number of pictures, at least 2.
        width, height: [pixels].
        elevation, azimuth: of the view [deg]; by default from above for an arm that moves in the x-y plane,
            else from the front left.
        progress: called with the number of pictures done and in all.

    Returns:
        RGB images (height, width, 3).
    """
    if frames < 2:
        raise ValueError(f"frames must be at least 2, got {frames}")
    planar = all(j.type == JointType.revolute and abs(j.axis[2]) > 0.999 for j in run.robot.joints) and all(
        np.allclose(j.placement[2, :3], [0.0, 0.0, 1.0]) for j in run.robot.joints
    )
    dpi = 100
    figure = Figure(figsize=(width / dpi, height / dpi), dpi=dpi)
    canvas: Any = FigureCanvasAgg(figure)
    side = max(width, height)  # 3D axes are square and clip: a square that covers the picture
    ax: Any = figure.add_axes(
        ((1.0 - side / width) / 2, (1.0 - side / height) / 2, side / width, side / height),
        projection="3d",
        computed_zorder=False,
    )
    ax.set_axis_off()
    ax.view_init(
        elev=(90.0 if planar else 22.0) if elevation is None else elevation,
        azim=(-90.0 if planar else 38.0) if azimuth is None else azimuth,
    )
    samples = np.unique(np.linspace(0, len(run) - 1, frames).round().astype(int))
    tip = run.robot.frames[-1].name
    traced = np.unique(np.linspace(0, len(run) - 1, TRACE_POINTS).round().astype(int))
    trace = np.array([run.robot.pose(run.q[k], tip)[:3, 3] for k in traced])
    low, high = _bounds(run, samples)
    ax.set_proj_type("ortho" if planar else "persp")
    ax.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), zlim=(low[2], high[2]))
    ax.set_box_aspect(high - low, zoom=1.2 * min(width, height) / side)
    if not planar:
        _draw_ground(ax, low, high)
    goal_tip = run.robot.pose(run.goal, tip)[:3, 3]
    ax.plot(*goal_tip[:, None], marker="x", color=TRACE_COLOUR, markersize=9, markeredgewidth=2, zorder=1)
    (line,) = ax.plot(*trace[:1].T, color=TRACE_COLOUR, linewidth=1.6, zorder=1)
    clock = figure.text(0.02, 0.95, "", fontsize=11, color="0.25")
    collection = draw_arm(
        ax, run.robot, run.q[0], objects=run.objects, object_poses=_poses(run, 0), colour=ARM_COLOUR
    )
    collection.set_zorder(2)
    pictures = []
    for done, k in enumerate(samples, start=1):
        triangles, colours = _picture(run.robot, run.q[k], run.objects, _poses(run, k), ARM_COLOUR)
        collection.set_verts(triangles)
        _paint(collection, colours, 1.0)
        line.set_data_3d(*trace[traced <= k].T)
        clock.set_text(f"{run.time[k]:.2f} s")
        canvas.draw()
        pictures.append(np.asarray(canvas.buffer_rgba())[..., :3].copy())
        if progress is not None:
            progress(done, len(samples))
    return pictures


def simplified(mesh: trimesh.Trimesh, cell: float) -> trimesh.Trimesh:
    """A coarser mesh: vertices in one cube of side `cell` [m] become their mean (Rossignac, Borrel, 1993)."""
    keys = np.floor(mesh.vertices / cell).astype(np.int64)
    _, cluster = np.unique(keys, axis=0, return_inverse=True)
    cluster = cluster.reshape(-1)
    counts = np.bincount(cluster)
    means = np.stack([np.bincount(cluster, mesh.vertices[:, k]) / counts for k in range(3)], axis=1)
    faces = cluster[mesh.faces]
    distinct = (faces[:, 0] != faces[:, 1]) & (faces[:, 1] != faces[:, 2]) & (faces[:, 2] != faces[:, 0])
    faces = faces[distinct]
    _, first = np.unique(np.sort(faces, axis=1), axis=0, return_index=True)
    return trimesh.Trimesh(means, faces[np.sort(first)], process=False)


@lru_cache(maxsize=8)
def _arm_triangles(robot: Robot) -> tuple[tuple[str, bool, Array], ...]:
    """Per link: its name, whether a joint moves it, and its triangles (F, 3, 3) in the link frame."""
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
def _object_triangles(item: SceneObject) -> Array:
    return np.array(item.surface(subdivisions=2).triangles, dtype=float)


def _picture(
    robot: Robot, q: Array, objects: Sequence[SceneObject], object_poses: Array | None, colour: Colour
) -> tuple[Array, Array]:
    """Triangles (F, 3, 3) in the world and their shaded colours (F, 3)."""
    triangles, colours = [], []
    for link, moves, shape in _arm_triangles(robot):
        X = robot.pose(q, link)
        triangles.append(shape @ X[:3, :3].T + X[:3, 3])
        colours.append(_shaded(triangles[-1], colour if moves else BASE_COLOUR))
    for i, item in enumerate(objects):
        X = item.pose if object_poses is None else pose_matrix(object_poses[i])
        triangles.append(_object_triangles(item) @ X[:3, :3].T + X[:3, 3])
        colours.append(_shaded(triangles[-1], OBSTACLE_COLOUR))
    if not triangles:
        return np.zeros((0, 3, 3)), np.zeros((0, 3))
    return np.concatenate(triangles), np.concatenate(colours)


def _shaded(triangles: Array, colour: Colour) -> Array:
    normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    lengths = np.linalg.norm(normals, axis=1)
    facing = (normals @ LIGHT) / np.where(lengths > 0.0, lengths, 1.0)
    brightness = AMBIENT + (1.0 - AMBIENT) * np.clip(0.5 + 0.5 * facing, 0.0, 1.0)
    shaded: Array = np.clip(brightness[:, None] * np.array(colour), 0.0, 1.0)
    return shaded


def _paint(collection: Poly3DCollection, colours: Array, opacity: float) -> None:
    rgba = np.column_stack([colours, np.full(len(colours), opacity)])
    collection.set_facecolor(rgba)
    collection.set_edgecolor(
        rgba if opacity == 1.0 else "none"
    )  # the edges close hairlines between triangles


def _poses(run: Run, k: int) -> Array:
    if run.object_poses.size:
        poses: Array = run.object_poses[k]
        return poses
    return np.array([pose_vector(item.pose) for item in run.objects]).reshape(-1, 7)


def _bounds(run: Run, samples: npt.NDArray[np.intp]) -> tuple[Array, Array]:
    """A box (low, high) that holds the arm at the samples and every object where it starts."""
    corners = []
    shapes = _arm_triangles(run.robot)
    for k in samples[:: max(1, len(samples) // 12)]:
        for link, _, shape in shapes:
            X = run.robot.pose(run.q[k], link)
            points = shape.reshape(-1, 3) @ X[:3, :3].T + X[:3, 3]
            corners += [points.min(axis=0), points.max(axis=0)]
    for item in run.objects:
        corners += [item.pose[:3, 3] - item.bounding_radius, item.pose[:3, 3] + item.bounding_radius]
    low, high = np.min(corners, axis=0), np.max(corners, axis=0)
    least = 0.25 * float((high - low).max())  # no side thinner than a quarter of the longest
    thin = np.maximum(least - (high - low), 0.0)
    return low - 0.5 * thin, high + 0.5 * thin


def _draw_ground(ax: Any, low: Array, high: Array) -> None:
    height = min(low[2], 0.0)
    spacing = 0.2  # [m]
    xs = np.arange(np.floor(low[0] / spacing), np.ceil(high[0] / spacing) + 1) * spacing
    ys = np.arange(np.floor(low[1] / spacing), np.ceil(high[1] / spacing) + 1) * spacing
    for x in xs:
        ax.plot([x, x], [ys[0], ys[-1]], [height, height], color="0.88", linewidth=0.7, zorder=0)
    for y in ys:
        ax.plot([xs[0], xs[-1]], [y, y], [height, height], color="0.88", linewidth=0.7, zorder=0)
