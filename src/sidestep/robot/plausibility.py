"""What a description says that no arm has: inertias, velocities, efforts and sizes of meshes."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from sidestep._core import Joint, JointType
from sidestep.robot.link import Array, Geometry, Link
from sidestep.robot.remarks import Remarks
from sidestep.robot.urdf_elements import UrdfJoint
from sidestep.shapes.mesh_file import extents_of

_NEGATIVE = 1e-6  # of the largest principal inertia: rounding of a file
_TRIANGLE = 1e-2  # of the largest principal inertia: files write three digits
_ROUNDING = 1e-12  # [kg m^2] a CAD export's zero; the lightest finger has 1e-7
_MOST_GYRATION = 10.0  # [m] radius; links are shorter than that
_MOST_VELOCITY = 50.0  # [rad/s | m/s] 480 rpm: joints of arms turn at up to 20 rad/s
_MOST_EFFORT = 1e6  # [Nm | N] the largest arms have some 1e4
_LARGE, _SMALL = 10.0, 0.01  # edges of a mesh as a share of the arm's length: 1 mm for 1 m is 1000
_LEAST_LENGTH = 0.5  # [m] of an arm, for this: one of a single joint has none
_MOST_LENGTH = 20.0  # [m] of a link, and of what is on it: 20 mm
_MOST_STROKE = 30.0  # [m] of a slide joint and its rail: the longest gantries have some 20
_PLACEHOLDER = 1e5  # [m] 100 m in millimetres; who writes more than that wants no limit
_THINNEST = 1.0  # [m] 1 mm; floors and walls of a cell are large, and thinner than that

IMPOSSIBLE_INERTIA = (
    "no rigid body has such an inertia: principal inertias are positive, and each at most the sum of the other two; "
    "the likely cause is a wrong sign or unit, or an <inertia> about another point than the centre of mass"
)
LARGE_INERTIA = (
    "the inertia is too large for the mass; the likely cause is kg mm^2 or g mm^2 in place of kg m^2"
)
FAST = (
    "so fast is no joint; the likely cause is deg/s in place of rad/s, or a placeholder: pass velocity_limits"
)
FAST_SLIDE = (
    "so fast is no slide joint; the likely cause is mm/s in place of m/s, or a placeholder: pass "
    "velocity_limits"
)
STRONG = "so strong is no joint; the likely cause is a placeholder: pass effort_limits"
LARGE_MESH = (
    'the mesh is far larger than the arm; the likely cause is millimetres: write scale="0.001 0.001 0.001"'
)
MILLIMETRES = "looks like millimetres; metres are expected"
SMALL_MESH = (
    "the mesh is far smaller than the arm; the likely cause is a scale on a file that is in metres already"
)


def check_inertia(mass: float, inertia: Array, owner: str, remarks: Remarks) -> None:
    """Remarks on a rotational inertia (3, 3) about the centre of mass that no body of this mass has."""
    principal = np.linalg.eigvalsh(inertia)
    most = float(np.abs(principal).max())
    what = f"{owner} ({', '.join(f'{value:.3g}' for value in principal)} kg m^2 at {mass:g} kg)"
    negative = principal[0] < -_NEGATIVE * most - _ROUNDING
    if negative or principal[2] > principal[0] + principal[1] + _TRIANGLE * most + _ROUNDING:
        remarks.add(IMPOSSIBLE_INERTIA, what)
    elif mass > 0.0 and most > mass * _MOST_GYRATION**2:
        remarks.add(LARGE_INERTIA, what)


def check_limits(joints: Sequence[UrdfJoint], velocity: Array, effort: Array, remarks: Remarks) -> None:
    """Remarks on velocity and effort limits that no joint has; infinite ones are none."""
    for joint, speed, force in zip(joints, velocity, effort, strict=True):
        if _MOST_VELOCITY < speed < np.inf:
            kind = FAST_SLIDE if joint.type == "prismatic" else FAST
            remarks.add(kind, f"velocity limit {speed:g} of joint {joint.name!r}")
        if _MOST_EFFORT < force < np.inf:
            remarks.add(STRONG, f"effort limit {force:g} of joint {joint.name!r}")


def check_lengths(
    links: Sequence[Link], joints: Sequence[UrdfJoint], moving: Sequence[Joint], remarks: Remarks
) -> None:
    """Remarks on origins, strokes and shapes without a file that are in millimetres, by their size.

    Args:
        links, joints: of the description. moving: joints of the arm.
    """
    for joint in joints:
        _check_origin(joint.placement, f"joint {joint.name!r}", remarks)
        if joint.type == "prismatic" and joint.limit is not None:
            for side, value in (("lower", joint.limit.lower), ("upper", joint.limit.upper)):
                if _MOST_STROKE < abs(value) <= _PLACEHOLDER:
                    remarks.add(MILLIMETRES, f"{side} limit {value:g} of joint {joint.name!r}")
    most = min(_LARGE * max(arm_length(moving), _LEAST_LENGTH), _MOST_LENGTH)
    for link in links:
        if link.inertial is not None and np.linalg.norm(link.inertial.com) > _MOST_LENGTH:
            remarks.add(MILLIMETRES, f"<inertial> of link {link.name!r} at {_vector(link.inertial.com)}")
        for geometry in link.geometries:
            least, middle, longest = sorted(_edges(geometry))
            solid, rod = least >= _THINNEST and longest > most, middle < _THINNEST and longest > _MOST_STROKE
            if solid or rod:
                remarks.add(MILLIMETRES, f"{geometry.kind} ({_vector(geometry.size)}) of link {link.name!r}")
            else:
                _check_origin(geometry.placement, f"a shape of link {link.name!r}", remarks)


def _check_origin(X: Array, owner: str, remarks: Remarks) -> None:
    if np.linalg.norm(X[:3, 3]) > _MOST_LENGTH:
        remarks.add(MILLIMETRES, f"origin {_vector(X[:3, 3])} of {owner}")


def _edges(geometry: Geometry) -> tuple[float, ...]:
    """The edges [m] of the box around a shape; 0 for a mesh."""
    return geometry.shape.extents if geometry.path is None else (0.0, 0.0, 0.0)


def _vector(values: Sequence[float] | Array) -> str:
    return " ".join(f"{value:g}" for value in values)


def check_meshes(links: Sequence[Link], joints: Sequence[Joint], remarks: Remarks) -> None:
    """Remarks on meshes far larger or smaller than the arm, as far as files tell their size without being read."""
    length = arm_length(joints)
    sizes = []
    for link in links:
        for geometry in link.geometries:
            extents = None if geometry.path is None else extents_of(geometry.path)
            if extents is None:
                continue
            size = float((extents * np.abs(geometry.scale)).max())
            sizes.append((size, f"link {link.name!r} ({size:.3g} m, the arm {length:.3g} m)"))
            check_size(link.name, size, length, remarks)
    if sizes and max(sizes)[0] < _SMALL * length and length < _MOST_LENGTH:  # else the arm is in millimetres
        for _, what in sizes:
            remarks.add(SMALL_MESH, what)


def check_size(link: str, size: float, length: float, remarks: Remarks) -> None:
    """A remark on a mesh far larger than the arm; its longest edge and the arm's length [m]."""
    if size > _LARGE * max(length, _LEAST_LENGTH):
        remarks.add(LARGE_MESH, f"link {link!r} ({size:.3g} m, the arm {length:.3g} m)")


def arm_length(joints: Sequence[Joint]) -> float:
    """The longest way over the joints [m], stretched; without the strokes of prismatic ones."""
    reach: list[float] = []
    for joint in joints:
        before = 0.0 if joint.parent < 0 else reach[joint.parent]
        own = 0.0 if joint.parent < 0 else float(np.linalg.norm(joint.placement[:3, 3]))
        reach.append(before + own)
    turning = any(joint.type == JointType.revolute for joint in joints)
    return max(reach, default=0.0) if turning else 0.0


def warn_of_sizes(robot: str, link: str, geometries: Sequence[Geometry], length: float) -> None:
    """Checks the meshes of a link whose sizes `check_meshes` could not tell, and warns; loads them."""
    remarks = Remarks()
    for geometry in geometries:
        if geometry.path is not None and extents_of(geometry.path) is None:
            check_size(link, float(geometry.mesh().extents.max()), length, remarks)
    remarks.warn(f"robot {robot!r}", stacklevel=3)
