"""What the controller sees of the solids of a scenario."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt
import trimesh

from sidestep._core import Obstacles
from sidestep.distance import SceneObject
from sidestep.math.pose import moved
from sidestep.obstacles import load_point_cloud
from sidestep.scenario.scenario import Obstacle
from sidestep.scenario.shape import PointSource
from sidestep.shapes import Sphere
from sidestep.shapes.surface_points import check_spacing

Array = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class View:
    """What is seen of one solid: points (N, 3) in its frame, and the radii (N,) of them [m]."""

    thing: SceneObject
    points: Array
    radii: Array


def view_of(item: Obstacle, thing: SceneObject, *, bare: bool) -> View:
    """What is seen of a solid.

    Args:
        item: the obstacle it belongs to. thing: the solid.
        bare: as the file asks by `points`; otherwise its real size: a ball as it is, other shapes as balls that cover
            the surface without a gap and reach out of it by at most the file's `excess`.
    """
    if bare and item.points == "surface":
        points = _surface_points(item, thing)
        return View(thing, points, np.zeros(len(points)))
    if bare or isinstance(item.shape, Sphere | PointSource):
        centre = np.zeros((1, 3)) if thing.mesh is None else thing.mesh.bounds.mean(axis=0, keepdims=True)
        has_size = not bare or item.points == "ball"
        radius = thing.shape.radius if has_size and isinstance(thing.shape, Sphere) else 0.0
        return View(thing, centre, np.array([radius]))
    return View(thing, *thing.shape.balls(item.excess))


def cloud_balls(shape: PointSource, path: Path) -> tuple[Array, float]:
    """Points (n, 3) of a shape of points in its frame, and the radius of all their balls [m]."""
    cloud = load_point_cloud(
        path,
        radius=shape.radius,
        voxel=shape.voxel,
        scale=shape.scale,
        viewpoint=shape.viewpoint,
    )
    return np.array(cloud.points), float(cloud.radii.max())


def _surface_points(item: Obstacle, thing: SceneObject) -> Array:
    """Points (n, 3) on the surface, about `item.spacing` apart; of a plane on its face."""
    if not thing.shape.bounded:
        return thing.shape.surface_points(item.spacing)
    surface = thing.surface(subdivisions=3)
    check_spacing(item.spacing, area=float(surface.area), length=float(max(surface.extents)))
    count = max(12, round(surface.area / item.spacing**2))
    points, _ = trimesh.sample.sample_surface_even(surface, count, seed=0)
    return np.asarray(points)


def seen_at(views: tuple[View, ...], time: float) -> Obstacles:
    """Everything that is seen at a time [s]."""
    if not views:
        return Obstacles.none()
    points, radii, velocities = [], [], []
    for view in views:
        pose = view.thing.pose_at(time)
        begin, end = view.thing.moves_during
        moves = view.thing.motion == "moving" and begin <= time < end
        points.append(moved(view.points, pose))
        radii.append(view.radii)
        velocities.append(np.tile(view.thing.velocity if moves else np.zeros(3), (len(view.points), 1)))
    seen = Obstacles(np.concatenate(points), np.concatenate(radii), np.concatenate(velocities))
    return seen.named([view.thing.name for view in views], [len(view.points) for view in views])
