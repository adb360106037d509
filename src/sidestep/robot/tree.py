"""From URDF to the core's tree: pruned to a tip, joints locked, fixed ones folded, mimic ones resolved."""

from __future__ import annotations

import math
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from sidestep._core import Frame, Joint, JointLimits, JointType, real_array
from sidestep.math.pose import checked_pose, from_roll_pitch_yaw, pose_at
from sidestep.robot.degrees import DEGREES_HINT, degrees_hint, looks_like_degrees
from sidestep.robot.drives import Drive, drives_of, joint_motion, swept_links
from sidestep.robot.limits import LimitValues, limits_of, position_bounds, stands_still
from sidestep.robot.link import Array, Link
from sidestep.robot.plausibility import check_lengths, check_meshes
from sidestep.robot.urdf_elements import Urdf, UrdfJoint

CORE_TOLERANCE = 1e-9  # on R Rᵀ - 1, the core's own
FOLLOWER_TOLERANCE = 1e-6  # [rad | m] of a locked mimic joint: values are written down with a few digits

HELD_POSE = (
    "has several coordinates, and is held where it is written; pass its pose in locked to hold it elsewhere"
)
HELD_LIMITS = "lower and upper limit are the same, so that it is held there"


@dataclass(frozen=True, eq=False)
class KinematicTree:
    """What the core's robot is built from; `links` in the order of `frames`, `held` as `Robot.held`."""

    joints: tuple[Joint, ...]
    frames: tuple[Frame, ...]
    coordinate_names: tuple[str, ...]
    limits: JointLimits
    links: tuple[Link, ...]
    held: Mapping[str, float] = field(default_factory=dict)


def build_tree(
    urdf: Urdf,
    *,
    base_pose: ArrayLike | None,
    tip: str | None,
    locked: Mapping[str, ArrayLike] | None,
    locked_beyond_limits: bool,
    acceleration_limits: LimitValues | None,
    velocity_limits: LimitValues | None,
    effort_limits: LimitValues | None,
    jerk_limits: LimitValues | None,
    effort_rate_limits: LimitValues | None,
) -> KinematicTree:
    """Folds `urdf` into moving joints and frames; see `Robot.from_urdf` for the arguments and the rules."""
    poses, values, ranges = _poses_and_values(urdf, locked or {})
    locks = _checked_locks(urdf, values, ranges, beyond_limits=locked_beyond_limits)
    still = [
        joint for joint in urdf.joints.values() if joint.moves and joint.mimic is None and stands_still(joint)
    ]
    still = [joint for joint in still if joint.name not in locks]
    locks |= {joint.name: position_bounds(joint)[0] for joint in still}
    drives = drives_of(urdf, locks)
    _check_followers(urdf, values, ranges, drives)
    kept = _kept_joints(urdf, drives, tip)
    for joint in kept:
        if joint in still:
            urdf.remarks.add(HELD_LIMITS, f"joint {joint.name!r} ({position_bounds(joint)[0]:g})")
        if joint.free and joint.name not in poses:
            urdf.remarks.add(HELD_POSE, f"{joint.type} joint {joint.name!r}")
    names = [joint.name for joint in kept if joint.moves and drives[joint.name].source == joint.name]
    if not names:
        raise ValueError(f"{urdf.label} has no movable joint left; give another tip or lock fewer joints")
    joints, placed = _placed(urdf, kept, drives, names, poses, tip=tip, base_pose=base_pose)
    limits = limits_of(
        urdf,
        names,
        drives=drives,
        acceleration=acceleration_limits,
        velocity=velocity_limits,
        effort=effort_limits,
        jerk=jerk_limits,
        effort_rate=effort_rate_limits,
    )
    driven = swept_links(urdf, kept, locks, ranges, poses)
    links = tuple(driven.get(link, urdf.links[link]) for link in placed)
    check_lengths(links, kept, joints, urdf.remarks)
    check_meshes(links, joints, urdf.remarks)
    frames = tuple(Frame(link, joint=index, placement=X) for link, (index, X) in placed.items())
    return KinematicTree(
        tuple(joints),
        frames,
        tuple(names),
        limits,
        links,
        {joint.name: drives[joint.name].offset for joint in kept if joint.moves and _held(drives, joint)},
    )


def _placed(
    urdf: Urdf,
    kept: Sequence[UrdfJoint],
    drives: Mapping[str, Drive],
    names: Sequence[str],
    poses: Mapping[str, Array],
    *,
    tip: str | None,
    base_pose: ArrayLike | None,
) -> tuple[list[Joint], dict[str, tuple[int, Array]]]:
    """The joints that move, parents first; and of each link the joint that it moves with, and its pose there."""
    coordinates = {name: index for index, name in enumerate(names)}
    joints: list[Joint] = []
    root_pose = (
        np.eye(4) if base_pose is None else checked_pose(base_pose, "base_pose", tolerance=CORE_TOLERANCE)
    )
    placed: dict[str, tuple[int, Array]] = {urdf.root: (-1, root_pose)}
    for joint in kept:
        parent, X_PL = placed[joint.parent]
        X_PJ = X_PL @ joint.placement
        if not joint.moves:
            placed[joint.child] = (parent, X_PJ @ poses[joint.name] if joint.name in poses else X_PJ)
            continue
        drive = drives[joint.name]
        if drive.source is None:
            placed[joint.child] = (parent, X_PJ @ joint_motion(joint, drive.offset))
            continue
        if drive.source not in coordinates:
            raise ValueError(
                f"{urdf.label}: joint {joint.name!r} mimics {drive.source!r}, which is not on the way to the "
                f"tip {tip!r}; lock {drive.source!r}"
            )
        joints.append(
            Joint(
                joint.name,
                JointType.prismatic if joint.type == "prismatic" else JointType.revolute,
                parent=parent,
                placement=X_PJ,
                axis=joint.axis,
                coordinate=coordinates[drive.source],
                multiplier=drive.multiplier,
                offset=drive.offset,
            )
        )
        placed[joint.child] = (len(joints) - 1, np.eye(4))
    return joints, placed


def at_postures(
    locked: Mapping[str, ArrayLike | str], states: Sequence[tuple[str, Mapping[str, float]]]
) -> dict[str, ArrayLike]:
    """`locked` with the values that postures give in place of their names.

    Args:
        locked: by joint. states: names of postures, and the values of joints that they give.

    Raises:
        ValueError: no posture of that name gives the joint a value; names those that do.
    """
    numbers: dict[str, ArrayLike] = {}
    for joint, value in locked.items():
        if isinstance(value, str):
            known = {name: values[joint] for name, values in states if joint in values}
            if value not in known:
                raise ValueError(
                    f"locked: {joint!r} is {value!r}, and no posture of that name gives the joint a value; allowed: "
                    f"a number, two: a range, or one of: {', '.join(known) or 'no posture does'}"
                )
            value = known[value]
        numbers[joint] = value
    return numbers


def _poses_and_values(
    urdf: Urdf, locked: Mapping[str, ArrayLike]
) -> tuple[dict[str, Array], dict[str, float], dict[str, tuple[float, float]]]:
    """Of `locked`, the poses of joints with several coordinates, the positions of the others, and their ranges.

    A joint with a range is held in its middle.
    """
    poses: dict[str, Array] = {}
    values: dict[str, float] = {}
    ranges: dict[str, tuple[float, float]] = {}
    for name, value in locked.items():
        joint = urdf.joints.get(name)
        if joint is None or not joint.free:
            number = real_array(value, f"locked: {name!r}")
            if number.shape == (2,):
                lower, upper = (float(bound) for bound in number)
                if not lower < upper:
                    raise ValueError(f"locked: {name!r} = [{lower}, {upper}], must be a range that ascends")
                ranges[name], values[name] = (lower, upper), 0.5 * (lower + upper)
                continue
            if number.shape != ():
                raise ValueError(
                    f"locked: {name!r} has shape {number.shape}, must be one number, or two: a range"
                )
            values[name] = value if isinstance(value, int | float) else float(number)
            continue
        array = real_array(value, f"locked: {name!r}")
        if array.shape == (6,) and np.isfinite(array).all():
            array = pose_at(array[:3], from_roll_pitch_yaw(array[3:].tolist()))
        elif array.shape != (4, 4):
            raise ValueError(
                f"locked: {joint.type} joint {name!r} has shape {array.shape}; allowed: a pose (4, 4), or x, y, z [m], "
                "roll, pitch, yaw [rad]"
            )
        poses[name] = checked_pose(array, f"locked: {name!r}")
    return poses, values, ranges


def _checked_locks(
    urdf: Urdf, locked: Mapping[str, float], ranges: Mapping[str, tuple[float, float]], *, beyond_limits: bool
) -> dict[str, float]:
    """The locks of joints that follow no other, after checking that they exist and may stand there."""
    locks = {}
    for name, value in locked.items():
        joint = urdf.joints.get(name)
        if joint is None or not joint.moves:
            kind = "does not exist" if joint is None else "is fixed already"
            raise ValueError(
                f"locked: joint {name!r} {kind}; joints that can be locked: {', '.join(_lockable(urdf))}"
            )
        lower, upper = position_bounds(joint)
        least, most = ranges.get(name, (value, value))
        if not math.isfinite(most - least) or not (beyond_limits or lower <= least <= most <= upper):
            hint = "" if joint.type == "prismatic" else degrees_hint([value])
            told = f"[{least}, {most}]" if name in ranges else value
            raise ValueError(f"locked: {name!r} = {told} is outside its limits [{lower}, {upper}]{hint}")
        if name in ranges and joint.mimic is not None:
            raise ValueError(f"locked: {name!r} mimics another joint; give the range of that one")
        if joint.type != "prismatic" and looks_like_degrees(value):
            warnings.warn(f"locked: {name!r} = {value:g} {DEGREES_HINT}", RuntimeWarning, stacklevel=5)
        if joint.mimic is None:
            locks[name] = float(value)
    return locks


def _check_followers(
    urdf: Urdf,
    locked: Mapping[str, float],
    ranges: Mapping[str, tuple[float, float]],
    drives: dict[str, Drive],
) -> None:
    """A mimic joint may be named with the one that it follows, at the place where it then is."""
    for name, value in locked.items():
        if drives[name].source is not None:
            raise ValueError(
                f"locked: joint {name!r} mimics another; lock that one; joints that can be locked: "
                f"{', '.join(_lockable(urdf))}"
            )
        source = _followed(urdf, name)
        if source != name and source in ranges:
            raise ValueError(
                f"locked: {name!r} = {value} mimics {source!r}, which something else drives in a range; "
                f"lock {source!r} alone"
            )
        if not math.isclose(drives[name].offset, value, abs_tol=FOLLOWER_TOLERANCE):
            raise ValueError(
                f"locked: {name!r} = {value} mimics another that is locked and puts it at {drives[name].offset}"
            )


def _followed(urdf: Urdf, name: str) -> str:
    """The joint at the end of a chain of mimic joints; its own name where it follows none."""
    joint = urdf.joints[name]
    while joint.mimic is not None:
        joint = urdf.joints[joint.mimic.joint]
    return joint.name


def _lockable(urdf: Urdf) -> list[str]:
    return [
        joint.name for joint in urdf.joints.values() if (joint.moves or joint.free) and joint.mimic is None
    ]


def _held(drives: dict[str, Drive], joint: UrdfJoint) -> bool:
    return drives[joint.name].source is None


def _kept_joints(urdf: Urdf, drives: dict[str, Drive], tip: str | None) -> list[UrdfJoint]:
    """The joints that stay, depth first (Pinocchio needs every subtree contiguous), siblings in file order.

    With a tip: the way from the root to it, and what hangs rigidly (fixed or locked joints only) on a link of
    that way other than the tip itself.
    """
    if tip is not None and tip not in urdf.links:
        raise ValueError(f"tip {tip!r} is no link of {urdf.label}; its links are: {', '.join(urdf.links)}")
    children: dict[str, list[UrdfJoint]] = {link: [] for link in urdf.links}
    to_parent: dict[str, UrdfJoint] = {}
    for joint in urdf.joints.values():
        children[joint.parent].append(joint)
        to_parent[joint.child] = joint
    way: set[str] = set()
    link = tip
    while link is not None and link in to_parent:
        way.add(to_parent[link].name)
        link = to_parent[link].parent

    def stays(joint: UrdfJoint) -> bool:
        rigid = not joint.moves or _held(drives, joint)
        return tip is None or joint.name in way or (rigid and joint.parent != tip)

    kept: list[UrdfJoint] = []
    open_joints = children[urdf.root][::-1]
    while open_joints:
        joint = open_joints.pop()
        if stays(joint):
            kept.append(joint)
            open_joints.extend(children[joint.child][::-1])
    return kept
