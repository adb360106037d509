"""The shapes of a robot that can be drawn; those that cannot are said."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from sidestep.robot import Geometry, Robot
from sidestep.studio.show.reading import collected_warnings

Shapes = dict[str, tuple[Geometry, ...]]


@dataclass(frozen=True, eq=False)
class DrawableShapes:
    """Geometry by link.

    Attributes:
        seen: what each link looks like: its visual shapes, or what it has else.
        collision: what distances are measured on: its collision shapes, or its visual ones.
        warnings: of meshes that cannot be read, and of their sizes.
    """

    seen: Shapes
    collision: Shapes
    warnings: tuple[str, ...]


def drawable_shapes(robot: Robot, stopped: Callable[[], bool] = lambda: False) -> DrawableShapes:
    """Loads every mesh of a robot, which may take seconds; where it is `stopped`, those of further links not."""
    seen: Shapes = {}
    collision: Shapes = {}
    broken: list[str] = []
    with collected_warnings() as told:
        for link in robot.links:
            if stopped():
                break
            visuals, collisions = (
                _readable(link.name, shapes, broken) for shapes in (link.visuals, link.collisions)
            )
            seen[link.name], collision[link.name] = visuals or collisions, collisions or visuals
            if link.geometries and link.name not in {text.split("'")[1] for text in broken}:
                robot.collision_mesh(link.name)  # warns of sizes
    return DrawableShapes(seen, collision, (*told, *broken))


def _readable(link: str, shapes: tuple[Geometry, ...], broken: list[str]) -> tuple[Geometry, ...]:
    found = []
    for shape in shapes:
        try:
            shape.mesh()
        except (ValueError, OSError) as error:
            broken.append(f"link '{link}': a shape is not drawn: {error}")
        else:
            found.append(shape)
    return tuple(found)
