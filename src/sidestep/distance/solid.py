"""Links and scene objects as Coal takes them: hollow triangle meshes, and solid primitives."""

from __future__ import annotations

from dataclasses import dataclass, replace

import coal
import numpy as np
import numpy.typing as npt
import trimesh
from scipy.spatial import ConvexHull, QhullError

from sidestep.distance.scene import SceneObject
from sidestep.shapes import Sphere
from sidestep.shapes.mesh_reader import mesh_model

Array = npt.NDArray[np.float64]

POINT_RADIUS = 1e-9  # [m] Coal has no point; a sphere this small stands for the centre of a ball
MAX_CONTACTS = 10_000  # contacts kept for a penetration depth: more than the triangles of any overlap


class Surface:
    """A closed surface of triangles (F, 3, 3)."""

    def __init__(self, triangles: Array) -> None:
        self._triangles = triangles
        self._low, self._high = triangles.min(axis=(0, 1)), triangles.max(axis=(0, 1))

    def contains(self, point: Array) -> bool:
        """Whether a point (3,) is inside: its winding number (van Oosterom, Strackee 1983) exceeds one half."""
        if (point < self._low).any() or (point > self._high).any():
            return False
        a, b, c = (self._triangles[:, k] - point for k in range(3))
        la, lb, lc = (np.linalg.norm(side, axis=1) for side in (a, b, c))
        volume = np.einsum("ij,ij->i", a, np.cross(b, c))
        dots = [np.einsum("ij,ij->i", u, w) for u, w in ((a, b), (b, c), (c, a))]
        solid_angles = 2.0 * np.arctan2(volume, la * lb * lc + dots[0] * lc + dots[1] * la + dots[2] * lb)
        return bool(abs(solid_angles.sum()) > 2.0 * np.pi)


@dataclass(frozen=True, eq=False)
class Solid:
    """A rigid shape for Coal. A ball is kept as its centre and `radius` is subtracted afterwards."""

    name: str
    shape: coal.CollisionGeometry
    radius: float
    surface: Surface | None  # hollow for Coal; None for primitives, which are solid
    reference: Array  # (3,) a point of the shape, in its frame
    bounding_radius: float
    hull: coal.CollisionGeometry | None = None  # of objects: what is solid and holds it, if it has volume


def hull_model(points: Array) -> coal.Convex | None:
    """The convex hull of points (N, 3) for Coal: solid; None where they have no volume."""
    try:
        hull = ConvexHull(points)
    except QhullError:
        return None
    number = np.empty(len(hull.points), dtype=int)  # of a point among the corners
    number[hull.vertices] = np.arange(len(hull.vertices))
    corners, triangles = coal.StdVec_Vec3s(), coal.StdVec_Triangle()
    for point in hull.points[hull.vertices]:
        corners.append(point)
    for a, b, c in number[hull.simplices].tolist():
        triangles.append(coal.Triangle(a, b, c))
    return coal.Convex(corners, triangles)


def mesh_solid(name: str, mesh: trimesh.Trimesh) -> Solid:
    radius = float(np.linalg.norm(mesh.vertices, axis=1).max())
    triangles = np.array(mesh.triangles, dtype=float)
    return Solid(name, mesh_model(mesh), 0.0, Surface(triangles), triangles[0, 0], radius)


def object_solid(item: SceneObject) -> Solid:
    exact, bound = item.shape.coal(), item.bounding_radius
    if exact is None:
        surface = item.shape.surface()
        solid = mesh_solid(item.name, surface)
        return replace(solid, hull=hull_model(surface.vertices) or solid.shape)
    radius = 0.0
    if isinstance(item.shape, Sphere):
        exact, radius = coal.Sphere(POINT_RADIUS), item.shape.radius
    return Solid(item.name, exact, radius, None, np.zeros(3), bound, exact)


def penetration(
    a: coal.CollisionGeometry, X_a: coal.Transform3s, b: coal.CollisionGeometry, X_b: coal.Transform3s
) -> float:
    request, result = coal.CollisionRequest(coal.CONTACT, MAX_CONTACTS), coal.CollisionResult()
    coal.collide(a, X_a, b, X_b, request, result)
    depths = [abs(result.getContact(k).penetration_depth) for k in range(result.numContacts())]
    return float(max(depths, default=0.0))
