"""What the controller sees of the solids of a scenario."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import trimesh

from sidestep._core import Obstacles
from sidestep.obstacles.covering import box, check_spacing, cylinder, triangles
from sidestep.pose import moved
from sidestep.scenario.scenario import Obstacle
from sidestep.simulation import SceneObject

Array = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class View:
    """What is seen of one solid: points (N, 3) in its frame, and the radius of each [m]."""

    thing: SceneObject
    points: Array
    radius: float


def view_of(item: Obstacle, thing: SceneObject, *, bare: bool) -> View:
    """What is seen of a solid.

    Args:
        item: the obstacle it belongs to. thing: the solid.
        bare: as the file asks by `points`; otherwise its real size: a ball as it is, other shapes as balls on the
            surface that leave no gap.
    """
    if bare and item.points == "surface":
        surface = thing.surface(subdivisions=3)
        check_spacing(item.spacing, area=float(surface.area), length=float(max(surface.extents)))
        count = max(12, round(surface.area / item.spacing**2))
        points, _ = trimesh.sample.sample_surface_even(surface, count, seed=0)
        return View(thing, np.asarray(points), 0.0)
    if bare or item.shape.type in ("sphere", "points"):
        centre = np.zeros((1, 3)) if thing.mesh is None else thing.mesh.bounds.mean(axis=0, keepdims=True)
        has_size = not bare or item.points == "ball"
        return View(thing, centre, float(item.shape.radius or 0.0) if has_size else 0.0)
    return View(thing, covering(item, thing), item.spacing)


def covering(item: Obstacle, thing: SceneObject) -> Array:
    """Centres (n, 3) of balls of radius `item.spacing` that cover the surface of a box, a cylinder or a mesh."""
    shape = item.shape
    if shape.type == "box" and shape.size is not None:
        return box(shape.size, item.spacing)
    if shape.type == "cylinder":
        return cylinder(float(shape.radius or 0.0), float(shape.length or 0.0), item.spacing)
    return triangles(thing.surface(), item.spacing)


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
        radii.append(np.full(len(view.points), view.radius))
        velocities.append(np.tile(view.thing.velocity if moves else np.zeros(3), (len(view.points), 1)))
    return Obstacles(np.concatenate(points), np.concatenate(radii), np.concatenate(velocities))
