"""An object that an arm holds, from its geometry: the ellipsoids that cover it, and its inertia."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeAlias

import numpy as np
import numpy.typing as npt
import trimesh
from numpy.typing import ArrayLike
from scipy.spatial import ConvexHull, QhullError

from sidestep import _core
from sidestep.body.cover_problem import EFFORTS, LinkProblem
from sidestep.body.cover_refine import Ellipsoids
from sidestep.math.pose import checked_pose
from sidestep.shapes import KINDS, Shape, Sphere, is_shape

Array: TypeAlias = npt.NDArray[np.float64]

COMPONENTS = 8  # ellipsoids of an object
THINNEST = 5e-4  # [m] of half an extent: what has no thickness is taken to have twice that


def attachment(
    name: str,
    geometry: Shape | ArrayLike,
    *,
    link: str,
    pose: ArrayLike | None = None,
    radius: float = 0.0,
    mass: float = 0.0,
    center_of_mass: ArrayLike | None = None,
    inertia: ArrayLike | None = None,
    may_touch: Sequence[str] = (),
    rests_on: str | Sequence[str] = (),
    components: int = COMPONENTS,
) -> _core.Attachment:
    """An object for `Controller.attach`: takes a few tenths of a second.

    A shape is covered as the links of an arm are, proven on its triangles; of points the convex hull is, so that what
    lies between them is covered too.

    Args:
        name: of its frame. geometry: a shape, in the object's own frame, or points (N, 3) [m] there.
        link: that holds it. pose: (4, 4) of the object's frame in the link's; the identity by default.
        radius: [m] by which the object may be larger everywhere, as points of a camera are apart.
        mass: [kg]; 0: unknown. center_of_mass: (3,) [m] in the object's frame; the middle of its hull by default.
        inertia: (3, 3) [kg m^2] about the centre of mass; of a solid of even density by default.
        may_touch: links that get no clearance from it, as the fingers that hold it.
        rests_on: names of obstacles that it stands on, or "*" for whatever it stands on. Until its whole cover is
            5 mm off all obstacles it may stay as near to them as it is. Its cover may be 30 mm deep in them at most.
        components: ellipsoids of it at most.

    Raises:
        ValueError: names what is wrong: points that are not finite or too few, a value out of range, a pose that is
            none.
    """
    if isinstance(geometry, Shape) and not geometry.bounded:
        raise ValueError(
            f"attach {name!r}: a {type(geometry).__name__} has no end and cannot be held, allowed: "
            f"{', '.join(sorted(kind.__name__ for kind in KINDS.values() if kind.bounded))}, or points (N, 3)"
        )
    X = np.eye(4) if pose is None else checked_pose(pose, f"attach {name!r}: pose")
    if not (np.isfinite(radius) and radius >= 0.0):
        raise ValueError(f"attach {name!r}: radius is {radius}, must be finite and not negative [m]")
    if not (np.isfinite(mass) and mass >= 0.0):
        raise ValueError(f"attach {name!r}: mass is {mass}, must be finite and not negative [kg]")
    if components < 1:
        raise ValueError(f"attach {name!r}: components is {components}, must be at least 1")
    cover, solid = _cover(name, geometry, components)
    middle, moments = _of_even_density(solid, mass)
    if radius > 0.0:
        cover = _larger(cover, radius)
    com = middle if center_of_mass is None else np.asarray(center_of_mass, dtype=np.float64)
    moments = moments if inertia is None else np.asarray(inertia, dtype=np.float64)
    return _core.Attachment(
        name,
        link=link,
        pose=X,
        centres=cover.centres,
        shapes=list(cover.shapes),
        inertial=_core.Inertial(mass, com, moments),
        may_touch=list(may_touch),
        rests_on=[rests_on] if isinstance(rests_on, str) else list(rests_on),
    )


def _cover(name: str, geometry: Shape | ArrayLike, components: int) -> tuple[Ellipsoids, Array]:
    """Its ellipsoids, and the triangles (F, 3, 3) of its surface."""
    if isinstance(geometry, Sphere):
        ball = Ellipsoids(geometry.centre[None], geometry.radius * np.eye(3)[None])
        return ball, np.asarray(geometry.mesh().triangles, dtype=np.float64)
    if is_shape(geometry):
        mesh = geometry.mesh()
        triangles = np.asarray(mesh.triangles, dtype=np.float64)
        outside = geometry.bulge if isinstance(geometry, Shape) else 0.0
    else:
        triangles, outside = _hull(name, np.asarray(geometry, dtype=np.float64)), 0.0
    if not len(triangles) or not np.isfinite(triangles).all():
        raise ValueError(f"attach {name!r}: the geometry has no triangles, or some that are not finite")
    problem = LinkProblem(triangles, seed=0, effort=EFFORTS["draft"])
    cover = problem.finish(components).ellipsoids
    return _larger(cover, outside) if outside > 0.0 else cover, triangles


def _hull(name: str, p: Array) -> Array:
    """Triangles (F, 3, 3) of the convex hull of points."""
    if p.ndim != 2 or p.shape[1] != 3 or len(p) < 1 or not np.isfinite(p).all():
        raise ValueError(
            f"attach {name!r}: points have shape {p.shape}, must be finite ones (N, 3), at least one"
        )
    middle = p.mean(axis=0)
    axes = np.linalg.eigh((p - middle).T @ (p - middle))[1]
    thin = np.ptp((p - middle) @ axes, axis=0) < 2.0 * THINNEST
    for axis in np.flatnonzero(thin):  # a point, a line and a sheet get a thickness
        p = np.vstack([p + THINNEST * axes[:, axis], p - THINNEST * axes[:, axis]])
    try:
        hull = ConvexHull(p)
    except QhullError as error:
        raise ValueError(f"attach {name!r}: the points have no convex hull: {error}") from None
    return np.asarray(p[hull.simplices], dtype=np.float64)


def _larger(cover: Ellipsoids, margin: float) -> Ellipsoids:
    """Ellipsoids that hold all that is within a margin [m] of others."""
    shortest = np.linalg.svd(cover.shapes, compute_uv=False)[:, 2]
    return cover.scaled(np.asarray(1.0 + margin / shortest, dtype=np.float64))


def _of_even_density(triangles: Array, mass: float) -> tuple[Array, Array]:
    """Centre of mass (3,) and moments (3, 3) about it of the solid in a surface, or in its hull where that is open."""
    if mass == 0.0:
        return np.asarray(triangles.reshape(-1, 3).mean(axis=0)), np.zeros((3, 3))
    faces = np.arange(3 * len(triangles)).reshape(-1, 3)
    solid = trimesh.Trimesh(triangles.reshape(-1, 3), faces)  # which merges equal corners
    if not solid.is_watertight or not solid.volume > 0.0:
        solid = solid.convex_hull
    volume = float(solid.volume)
    return (
        np.asarray(solid.center_mass, dtype=np.float64),
        np.asarray(solid.moment_inertia, dtype=np.float64) * (mass / volume),
    )
