"""Obstacles from shapes."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from sidestep._core import Obstacles, real_array
from sidestep.obstacles.covering import check_spacing
from sidestep.obstacles.shapes import Shape, Sphere


def obstacles_from_shapes(
    shapes: Sequence[Shape],
    *,
    spacing: float = 0.02,
    radius: float = 0.0,
    velocities: ArrayLike | None = None,
) -> Obstacles:
    """Obstacle points of solid shapes.

    A sphere becomes one point with its radius, which is exact. Any other shape becomes points on its surface,
    such that every point of the surface is within `spacing` of one. With `radius` = `spacing` the balls cover
    the surface without a gap; with the default 0 the space between the points is left to the width of the
    body's Gaussians.

    Args:
        shapes: at least one shape.
        spacing: covering radius of the samples [m].
        radius: radius of the surface samples [m]; a sphere keeps its own.
        velocities: velocity of each shape (len(shapes), 3) [m/s] in the world, or None for rest.

    Returns:
        The points in the order of the shapes.

    Raises:
        ValueError: if there is no shape, or a spacing, radius or velocity is out of range.
    """
    if not shapes:
        raise ValueError("there is no shape; Obstacles.none() says that the workspace is known to be free")
    check_spacing(spacing)
    if not (np.isfinite(radius) and radius >= 0.0):
        raise ValueError(f"radius is {radius}, must be >= 0 and finite [m]")
    shape_velocities = (
        np.zeros((len(shapes), 3)) if velocities is None else real_array(velocities, "velocities")
    )
    if shape_velocities.shape != (len(shapes), 3) or not np.isfinite(shape_velocities).all():
        raise ValueError(
            f"velocities have shape {shape_velocities.shape}, expected finite ({len(shapes)}, 3)"
        )
    points, radii = [], []
    for shape in shapes:
        own = shape.centre[None, :] if isinstance(shape, Sphere) else shape.sample(spacing)
        points.append(own)
        radii.append(np.full(len(own), shape.radius if isinstance(shape, Sphere) else radius))
    counts = [len(own) for own in points]
    return Obstacles(
        np.concatenate(points),
        radii=np.concatenate(radii),
        velocities=np.repeat(shape_velocities, counts, axis=0),
    )
