"""Uniform sampling of link surfaces."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING
from zlib import crc32

import numpy as np
import trimesh
from numpy.typing import NDArray

if TYPE_CHECKING:
    from sidestep.robot import Robot


def sample_surface(mesh: trimesh.Trimesh, count: int, *, seed: int) -> NDArray[np.float64]:
    """Points spread uniformly over the surface of a mesh: each triangle is drawn in proportion to its area.

    Args:
        mesh: triangles in any frame [m]; inner surfaces count as surface.
        count: number of points, at least 1.
        seed: seed of the draw; equal seeds give equal points.

    Returns:
        Points (count, 3) [m] in the frame of the mesh.

    Raises:
        ValueError: if count is below 1 or the mesh has no area.

    Source: Bosc, section 3.1 (a point cloud per link).
    """
    if count < 1:
        raise ValueError(f"number of surface samples is {count}, must be at least 1")
    if not (np.isfinite(mesh.area) and mesh.area > 0.0):
        raise ValueError(f"mesh has surface area {mesh.area} m^2, must be positive and finite")
    points, _ = trimesh.sample.sample_surface(mesh, count, seed=np.random.default_rng(seed))
    return np.asarray(points, dtype=np.float64)


def sample_link(robot: Robot, link: str, *, count: int, seed: int) -> NDArray[np.float64]:
    """Points (count, 3) [m] on the surface of a link (`Robot.collision_mesh`), in the link frame.

    The draw depends on the seed and on the name of the link only, so that the fit of one link does not change
    when another link is added or dropped.

    Raises:
        ValueError: if the link has no geometry, or geometry without area.
    """
    mesh = robot.collision_mesh(link)
    if mesh is None:
        raise ValueError(f"link '{link}' of robot '{robot.name}' has no geometry")
    try:
        return sample_surface(mesh, count, seed=link_seed(link, seed=seed))
    except ValueError as error:
        raise ValueError(f"link '{link}' of robot '{robot.name}': {error}") from error


def link_seed(link: str, *, seed: int) -> int:
    """A 32-bit seed for one link, independent between links."""
    return int(np.random.SeedSequence([seed, crc32(link.encode())]).generate_state(1)[0])


def links_with_geometry(robot: Robot) -> tuple[str, ...]:
    """Names of the links that have geometry, in the order of the robot's links."""
    return tuple(link.name for link in robot.links if link.geometries)


def check_components(components: int | Mapping[str, int], links: Sequence[str]) -> None:
    """Checks a number of components for every link, or one for each of exactly these links.

    Raises:
        ValueError: naming the links or the number at fault.
    """
    if isinstance(components, Mapping):
        unknown = sorted(set(components) - set(links))
        absent = [link for link in links if link not in components]
        if unknown or absent:
            fault = f"names unknown links {unknown}" if unknown else f"has no number for links {absent}"
            raise ValueError(f"components {fault}; the links with geometry are {', '.join(links)}")
    for link in links:
        number = components[link] if isinstance(components, Mapping) else components
        if isinstance(number, bool) or not isinstance(number, int) or number < 1:
            raise ValueError(
                f"components of link '{link}' is {number!r}, must be a whole number of at least 1"
            )
