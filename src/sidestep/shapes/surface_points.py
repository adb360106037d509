"""Points on a surface such that no surface point is farther than a given spacing from one of them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    import trimesh

Points = NDArray[np.float64]

# A flat grid of step a leaves its cell centres a / sqrt(2) from the nearest node.
GRID_STEP = np.sqrt(2.0)
# Rings of step a with an arc a between points: the square of the distance to the nearest point is at most
# (a/2)^2 + 1.5 (a/2)^2; 1.5 because a ring half a step farther out than the first is half as long again.
RING_STEP = 2.0 / np.sqrt(2.5)
# A triangle whose longest edge is a has no point farther than a / sqrt(3) from its corners.
TRIANGLE_EDGE = np.sqrt(3.0)
MAX_POINTS = (
    1_000_000  # far beyond what a control step can visit; stops a file in millimetres from filling memory
)


def triangles(mesh: trimesh.Trimesh, spacing: float) -> Points:
    """Covering points of a triangle mesh: its corners after subdivision, thinned to an even distance."""
    import trimesh

    check_spacing(spacing, area=float(mesh.area))
    half = 0.5 * spacing  # one half for the subdivision, one for the thinning
    used, faces = np.unique(mesh.faces, return_inverse=True)  # a file may list corners that no face uses
    corners, _ = trimesh.remesh.subdivide_to_size(  # type: ignore[no-untyped-call]
        mesh.vertices[used],
        faces.reshape(-1, 3),
        max_edge=TRIANGLE_EDGE * half,
        max_iter=50,
    )
    return _thinned(np.unique(np.asarray(corners, dtype=np.float64), axis=0), half)


def check_spacing(spacing: float, *, area: float = 0.0, length: float = 0.0) -> None:
    """Raises ValueError unless the spacing is a positive length that suits the area [m^2] to be covered, and the
    length [m] of what is too thin to have one."""
    if not (np.isfinite(spacing) and spacing > 0.0):
        raise ValueError(f"spacing is {spacing}, must be positive and finite [m]")
    area = max(area, spacing * length)
    if area / spacing / spacing > MAX_POINTS:
        raise ValueError(
            f"spacing of {spacing} m on {area:.4g} m^2 asks for about {area / spacing / spacing:.2g} points, "
            f"allowed are {MAX_POINTS}; is the shape in metres?"
        )


def line(length: float, spacing: float) -> Points:
    """Nodes from end to end of a grid line."""
    return np.linspace(-0.5 * length, 0.5 * length, int(np.ceil(length / (GRID_STEP * spacing))) + 1)


def around(radius: float, spacing: float) -> int:
    """Number of points around a round side: unrolled it is flat, and a chord is no longer than its arc."""
    return max(3, int(np.ceil(2.0 * np.pi * radius / (GRID_STEP * spacing))))


def rings(length: float, spacing: float) -> int:
    """Number of steps between rings along a length [m]."""
    return int(np.ceil(length / (RING_STEP * spacing)))


def ring_size(radius: float, spacing: float) -> int:
    """Number of points on a ring."""
    return 1 if radius == 0.0 else max(3, rings(2.0 * np.pi * radius, spacing))


def ring(radius: float, number: int) -> Points:
    """Points (number, 2) on a circle."""
    angles = np.linspace(0.0, 2.0 * np.pi, number, endpoint=False)
    return np.column_stack([radius * np.cos(angles), radius * np.sin(angles)])


def _thinned(points: Points, distance: float) -> Points:
    """A subset more than `distance` apart, with every dropped point within `distance` of a kept one."""
    from scipy.spatial import cKDTree

    tree = cKDTree(points)
    alive = np.ones(len(points), dtype=bool)
    kept = []
    for index in range(len(points)):
        if alive[index]:
            kept.append(index)
            alive[tree.query_ball_point(points[index], distance)] = False
    return points[kept]
