"""Tools and payloads: a shape fixed to a link of a robot."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from sidestep import _core
from sidestep.math.pose import checked_rotation, pose_at
from sidestep.robot.link import Geometry, Inertial, Link
from sidestep.robot.tree import KinematicTree

_ROTATION_TOLERANCE = 1e-9  # on R^T R - I; poses are written with at least this accuracy


def tree_with_tool(
    robot: _core.Robot,
    links: Sequence[Link],
    held: Mapping[str, float],
    name: str,
    shape: Geometry | str | Path,
    *,
    link: str,
    pose: ArrayLike | None,
    mass: float,
) -> KinematicTree:
    """The tree of a robot with one more link, fixed to `link`; arguments as in `Robot.with_tool`."""
    known = [other.name for other in links]
    if not name or name in known:
        raise ValueError(f"name of the tool is {name!r}, must be new; the links are: {', '.join(known)}")
    if link not in known:
        raise ValueError(f"robot {robot.name!r} has no link {link!r}; its links are: {', '.join(known)}")
    if not 0.0 <= mass < np.inf:
        raise ValueError(f"mass of tool {name!r} is {mass}, must be finite and >= 0 [kg]")
    X = np.eye(4) if pose is None else _core.real_array(pose, f"pose of tool {name!r}")
    if X.shape != (4, 4) or not np.isfinite(X).all() or not np.array_equal(X[3], [0.0, 0.0, 0.0, 1.0]):
        raise ValueError(f"pose of tool {name!r} must be a homogeneous matrix (4, 4), got {X}")
    X = pose_at(
        X[:3, 3], checked_rotation(X[:3, :3], f"pose of tool {name!r}", tolerance=_ROTATION_TOLERANCE)
    )
    geometry = shape if isinstance(shape, Geometry) else _mesh_file(shape)
    tool = Link(name, _uniform(geometry, mass) if mass > 0.0 else None, (geometry,), (geometry,))
    holder = robot.frames[known.index(link)]
    return KinematicTree(
        joints=tuple(robot.joints),
        frames=(*robot.frames, _core.Frame(name, joint=holder.joint, placement=holder.placement @ X)),
        coordinate_names=tuple(robot.coordinate_names),
        limits=robot.limits,
        links=(*links, tool),
        held=held,
    )


def _mesh_file(path: str | Path) -> Geometry:
    path = Path(path)
    if not path.is_file():
        raise FileNotFoundError(f"mesh of the tool '{path}' does not exist")
    return Geometry("mesh", np.eye(4), path=path)


def _uniform(geometry: Geometry, mass: float) -> Inertial:
    """Inertia of a solid of even density; of the convex hull where the mesh is open."""
    mesh = geometry.mesh()
    solid = mesh if mesh.is_watertight and mesh.volume > 0.0 else mesh.convex_hull
    return Inertial(
        mass=mass,
        com=np.asarray(solid.center_mass, dtype=np.float64),
        inertia=np.asarray(solid.moment_inertia, dtype=np.float64) * (mass / float(solid.volume)),
    )
