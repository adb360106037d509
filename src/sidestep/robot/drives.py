"""What drives a joint: its own coordinate, another one's, or nobody; where parts may be that others drive."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from sidestep.math.pose import about_axis, pose_at
from sidestep.robot.link import Array, Link
from sidestep.robot.urdf_elements import Urdf, UrdfJoint

MOST_CELLS = 2000  # of a link that several joints with a range move: each takes a millisecond
LARGEST_TURN = 0.05  # [rad] between two poses of a sweep: 0.03 mm of 0.1 m are cut off the arc


@dataclass(frozen=True)
class Drive:
    """What a moving joint follows: multiplier * position of `source` + offset; `offset` alone without one."""

    source: str | None
    multiplier: float
    offset: float


def drives_of(urdf: Urdf, locks: Mapping[str, float]) -> dict[str, Drive]:
    """Follows every mimic chain to its end: a joint with its own coordinate, or a locked one."""
    drives: dict[str, Drive] = {}
    for joint in urdf.joints.values():
        if not joint.moves:
            continue
        multiplier, offset, current, seen = 1.0, 0.0, joint, [joint.name]
        while current.mimic is not None:
            offset += multiplier * current.mimic.offset
            multiplier *= current.mimic.multiplier
            current = urdf.joints[current.mimic.joint]
            if current.name in seen:
                raise ValueError(
                    f"{urdf.label}: mimic joints form a loop: {' -> '.join([*seen, current.name])}"
                )
            seen.append(current.name)
        if not current.moves:
            raise ValueError(f"{urdf.label}: joint {joint.name!r} mimics {current.name!r}, which is fixed")
        if current.name in locks:
            drives[joint.name] = Drive(None, 0.0, multiplier * locks[current.name] + offset)
        else:
            drives[joint.name] = Drive(current.name, multiplier, offset)
    return drives


def joint_motion(joint: UrdfJoint, value: float) -> Array:
    """Pose (4, 4) of a joint's child, at a position, in the joint's frame."""
    if joint.type == "prismatic":
        return pose_at(value * joint.axis)
    return pose_at(np.zeros(3), about_axis(joint.axis, value))


def swept_links(
    urdf: Urdf,
    kept: Sequence[UrdfJoint],
    locks: Mapping[str, float],
    ranges: Mapping[str, tuple[float, float]],
    poses: Mapping[str, Array],
) -> dict[str, Link]:
    """The links that joints with a range move, with shapes that hold them wherever those are.

    Args:
        kept: joints of the tree, parents first. locks: position of every joint that is held, the middle of its range
            where it has one [rad | m]. ranges: of joints that something else drives. poses: of joints with several
            coordinates.

    Raises:
        ValueError: so many joints with long ranges move a link that its shapes cannot be swept.
    """
    if not ranges:
        return {}

    def placed(values: Mapping[str, float]) -> dict[str, Array]:
        return _poses_in_moving(urdf, kept, {**locks, **values}, poses)

    middle = placed({})
    grid = {name: np.linspace(*ranges[name], _num_steps(urdf, name, ranges[name]) + 1) for name in ranges}
    alone = {  # poses of links while one joint moves
        name: [placed({name: float(value)}) for value in grid[name]] for name in ranges
    }
    found = {}
    for link, X in middle.items():
        movers = [
            name
            for name in ranges
            if any(not np.allclose(at[link], X, rtol=0.0, atol=1e-12) for at in alone[name])
        ]
        if not movers:
            continue
        _check_cells(link, {name: len(grid[name]) - 1 for name in movers})
        cells = itertools.product(*(itertools.pairwise(grid[name]) for name in movers))
        sweeps = tuple(
            np.array(
                [
                    np.linalg.inv(X) @ placed(dict(zip(movers, corner, strict=True)))[link]
                    for corner in itertools.product(*cell)
                ]
            )
            for cell in cells
        )
        whole = urdf.links[link]
        found[link] = replace(
            whole, collisions=tuple(replace(shape, sweeps=sweeps) for shape in whole.geometries)
        )
    return found


def _poses_in_moving(
    urdf: Urdf, kept: Sequence[UrdfJoint], locks: Mapping[str, float], poses: Mapping[str, Array]
) -> dict[str, Array]:
    """Pose of every link in the child of the last joint before it that moves."""
    drives = drives_of(urdf, locks)
    found = {urdf.root: np.eye(4)}
    for joint in kept:
        X = found[joint.parent] @ joint.placement
        if not joint.moves:
            found[joint.child] = X @ poses.get(joint.name, np.eye(4))
        elif drives[joint.name].source is None:
            found[joint.child] = X @ joint_motion(joint, drives[joint.name].offset)
        else:
            found[joint.child] = np.eye(4)
    return found


def _num_steps(urdf: Urdf, name: str, interval: tuple[float, float]) -> int:
    """Into how many parts a range is cut, so that nothing turns far within one."""
    lower, upper = interval
    followers = [drive for drive in drives_of(urdf, {}).items() if drive[1].source == name]
    turns = [abs(drive.multiplier) for joint, drive in followers if urdf.joints[joint].type != "prismatic"]
    return max(1, math.ceil((upper - lower) * sum(turns) / LARGEST_TURN))


def _check_cells(link: str, parts: Mapping[str, int]) -> None:
    count = math.prod(parts.values())
    if count > MOST_CELLS:
        names = ", ".join(map(repr, parts))
        raise ValueError(
            f"locked: link {link!r} is swept through {count} cells by the ranges of {names}, "
            f"allowed: {MOST_CELLS}; give shorter ranges, or hold some of these joints at a value"
        )
