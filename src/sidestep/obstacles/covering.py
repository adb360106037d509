"""Points on a surface such that no surface point is farther than a given spacing from one of them.

The points of box, cylinder and sphere lie exactly on the shape, and on its edges and corners.
"""

from __future__ import annotations

from collections.abc import Sequence
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


def box(size: Sequence[float], spacing: float) -> Points:
    """Covering points of a box with edge lengths `size` (3,) [m], centred at the origin."""
    x, y, z = size
    check_spacing(spacing, area=2.0 * (x * y + y * z + z * x), length=x + y + z)
    lines = [_line(length, spacing) for length in size]
    faces = []
    for axis in range(3):
        for end in (0, -1):
            face = list(lines)
            face[axis] = lines[axis][[end]]
            faces.append(np.stack(np.meshgrid(*face, indexing="ij"), axis=-1).reshape(-1, 3))
    return np.unique(np.concatenate(faces), axis=0)


def cylinder(radius: float, length: float, spacing: float) -> Points:
    """Covering points of a capped cylinder along z, centred at the origin."""
    check_spacing(spacing, area=2.0 * np.pi * radius * (radius + length), length=length)
    # the unrolled side is flat; a chord is no longer than its arc
    number = max(3, int(np.ceil(2.0 * np.pi * radius / (GRID_STEP * spacing))))
    rim = _ring(radius, number)
    heights = _line(length, spacing)
    side = np.concatenate([np.column_stack([rim, np.full(number, z)]) for z in heights])
    num_rings = int(np.ceil(radius / (RING_STEP * spacing)))
    radii = np.linspace(0.0, radius, num_rings + 1)[:-1]
    flat = np.concatenate([_ring(r, _ring_size(r, spacing)) for r in radii])
    outer = _ring(radius, _ring_size(radius, spacing))
    flat = np.concatenate([flat, outer])
    caps = [np.column_stack([flat, np.full(len(flat), z)]) for z in (heights[0], heights[-1])]
    return np.concatenate([side, *caps])


def sphere(radius: float, spacing: float) -> Points:
    """Covering points of a sphere around the origin."""
    check_spacing(spacing, area=4.0 * np.pi * radius * radius)
    num_rings = max(2, int(np.ceil(np.pi * radius / (RING_STEP * spacing))))
    rings = []
    for polar in np.linspace(0.0, np.pi, num_rings + 1):
        r = radius * np.sin(polar) if 0.0 < polar < np.pi else 0.0
        circle = _ring(r, _ring_size(r, spacing))
        rings.append(np.column_stack([circle, np.full(len(circle), radius * np.cos(polar))]))
    return np.concatenate(rings)


def capsule(radius: float, length: float, spacing: float) -> Points:
    """Covering points of a capsule along z, around the origin: a ball rolled over `length`."""
    check_spacing(spacing, area=2.0 * np.pi * radius * (2.0 * radius + length))
    number = max(3, int(np.ceil(2.0 * np.pi * radius / (GRID_STEP * spacing))))
    rim = _ring(radius, number)
    side = np.concatenate([np.column_stack([rim, np.full(number, z)]) for z in _line(length, spacing)])
    ball = sphere(radius, spacing)  # a half-ball keeps its rings, and the rim of the side closes it
    shift = np.array([0.0, 0.0, 0.5 * length])
    return np.concatenate([side, ball[ball[:, 2] > 0.0] + shift, ball[ball[:, 2] < 0.0] - shift])


def square(extent: float, spacing: float) -> Points:
    """Covering points of the square of half an edge `extent` [m] in the plane z = 0."""
    check_spacing(spacing, area=4.0 * extent**2)
    line = _line(2.0 * extent, spacing)
    flat = np.stack(np.meshgrid(line, line, indexing="ij"), axis=-1).reshape(-1, 2)
    return np.column_stack([flat, np.zeros(len(flat))])


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


def _line(length: float, spacing: float) -> Points:
    """Nodes from end to end of a grid line."""
    return np.linspace(-0.5 * length, 0.5 * length, int(np.ceil(length / (GRID_STEP * spacing))) + 1)


def _ring_size(radius: float, spacing: float) -> int:
    return 1 if radius == 0.0 else max(3, int(np.ceil(2.0 * np.pi * radius / (RING_STEP * spacing))))


def _ring(radius: float, number: int) -> Points:
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
