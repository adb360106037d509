"""Obstacles from shapes, points, and both."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import groupby
from typing import TypeAlias

import numpy as np

from sidestep._core import Obstacles
from sidestep.shapes import Shape, Sphere, is_shape
from sidestep.shapes.ball_cover import EXCESS, check_excess
from sidestep.shapes.shape import Balls, Points
from sidestep.shapes.surface_points import check_spacing

Seen: TypeAlias = Obstacles | Shape | Sequence[Obstacles | Shape]


def obstacles_from_shapes(
    items: Seen,
    *,
    excess: float | None = None,
    spacing: float | None = None,
    radius: float | None = None,
    gaps_allowed: bool = False,
) -> Obstacles:
    """What the controller sees of solid shapes and of points: balls, without gaps.

    Every point of a shape's surface lies in one of its balls, so that nothing gets nearer to the solid than to the
    balls; nor does an arm get inside. There are two ways:

    - by default, few balls inside the solid that reach out of it by at most `excess`; a sphere is one ball, exact. Of
      other shapes than meshes they fill the inside as well (sampled, not proven);
    - with `spacing`, balls of one `radius` around points of the surface, such that every other point of the surface is
      within `spacing` of one. They reach out of the solid by `radius`. A sphere is one ball all the same.

    Args:
        items: a shape, `Obstacles`, or a list of at least one of them, in any order.
        excess: how far balls may reach out of a solid [m]; 2 mm by default; half takes 2 to 4 times as many.
        spacing: covering radius of surface points [m], in place of `excess`.
        radius: of the balls around surface points [m]; None: `spacing`, the smallest that leaves no gap.
        gaps_allowed: takes a radius below the spacing as it is.

    Returns:
        The balls in the order of the items, each with the velocity of its shape. `Obstacles.name_of(index)` is the name
        of the shape of a ball; where it has none "obstacle0", "obstacle1", …, by place in `items`. `Obstacles` alone
        are returned as they are.

    Raises:
        ValueError: if there is no item, a value is out of range, the radius leaves gaps, or a shape needs too many
            balls; names the item.
        TypeError: if an item is neither a shape nor `Obstacles`.
    """
    sampled = _checked_sampling(excess, spacing, radius, gaps_allowed=gaps_allowed)
    if isinstance(items, Obstacles):
        return items
    listed = [items] if is_shape(items) else _listed(items)
    if not listed:
        raise ValueError("there is no shape; Obstacles.none() says that the workspace is known to be free")
    parts = [
        _part(item, index, excess=EXCESS if excess is None else excess, sampled=sampled)
        for index, item in enumerate(listed)
    ]
    points, radii, velocities = (np.concatenate([part[k] for part in parts]) for k in range(3))
    if len(points) == 0:
        return Obstacles.none()
    groups = [group for part in parts for group in part[3]]
    runs = [list(run) for _, run in groupby(groups, key=lambda group: group[0])]
    return Obstacles(points, radii, velocities).named(
        [run[0][0] for run in runs],
        [sum(group[1] for group in run) for run in runs],
        [run[0][2] for run in runs],
    )


Sampling = tuple[float, float] | None  # spacing and radius [m], or None: by excess
Part = tuple[
    Points, Points, Points, list[tuple[str, int, Points]]
]  # points, radii, velocities; name, count, pose


def _listed(items: Seen) -> list[Obstacles | Shape]:
    try:
        return list(items)  # type: ignore[arg-type]
    except TypeError:
        raise TypeError(
            f"obstacles are {_kind(items)}, must be a shape, Obstacles or a list of both"
        ) from None


def _part(item: Obstacles | Shape, index: int, *, excess: float, sampled: Sampling) -> Part:
    """What is seen of an item."""
    unnamed = f"obstacle{index}"
    if isinstance(item, Obstacles):
        groups = [(name or unnamed, count, np.eye(4)) for name, count in item.groups]
        return item.points, item.radii, item.velocities, groups
    if not is_shape(item):
        raise TypeError(
            f"item {index} of the obstacles is {_kind(item)}, must be a shape or Obstacles; points (N, 3) go as "
            "Obstacles(points, radii)"
        )
    name = item.name or unnamed
    try:
        points, radii = _balls(item, excess, sampled)
    except ValueError as error:
        raise ValueError(f"{type(item).__name__} {name!r}: {error}") from error
    return points, radii, np.tile(item.velocity, (len(points), 1)), [(name, len(points), item.pose)]


def _kind(value: object) -> str:
    return f"of type {type(value).__name__}"


def _balls(shape: Shape, excess: float, sampled: Sampling) -> Balls:
    if sampled is None or isinstance(shape, Sphere):
        return shape.balls(excess)
    spacing, radius = sampled
    points = shape.sample(spacing)
    return points, np.full(len(points), radius)


def _checked_sampling(
    excess: float | None, spacing: float | None, radius: float | None, *, gaps_allowed: bool
) -> Sampling:
    """Spacing and radius of surface points, or None where balls are found by their excess."""
    if spacing is None and radius is None:
        check_excess(EXCESS if excess is None else excess)
        return None
    if excess is not None:
        raise ValueError(f"excess is {excess}, which goes without spacing and radius: give one or the other")
    if spacing is None:
        raise ValueError(f"radius is {radius}, which goes with a spacing; excess alone leaves no gap either")
    check_spacing(spacing)
    if radius is None:
        return spacing, spacing
    if not (np.isfinite(radius) and radius >= 0.0):
        raise ValueError(f"radius is {radius}, must be >= 0 and finite [m]")
    if radius < spacing and not gaps_allowed:
        raise ValueError(
            f"radius is {radius}, which leaves gaps between surface points with a spacing of {spacing} m: from "
            f"{spacing} m on there are none; gaps_allowed=True takes it as it is"
        )
    return spacing, radius
