"""Reads a URDF: elements are checked one by one, and as a tree."""

from __future__ import annotations

import math
import xml.etree.ElementTree as ElementTree

import numpy as np

from sidestep.robot.degrees import looks_like_degrees, warn_of_degrees
from sidestep.robot.elements import attribute, number, numbers, placement, short, words
from sidestep.robot.link import Inertial, Link
from sidestep.robot.plausibility import check_inertia
from sidestep.robot.remarks import Remarks
from sidestep.robot.source import Description
from sidestep.robot.urdf_elements import FREE_TYPES, Urdf, UrdfJoint, UrdfLimit, UrdfMimic
from sidestep.robot.urdf_geometry import shapes_of

JOINT_TYPES = ("revolute", "continuous", "prismatic", "fixed", "floating", "planar")

NO_MASS = "<inertial> has no <mass>, and is left out"
NO_INERTIA = "<inertial> has no whole <inertia>; the mass counts as a point"


def parse_urdf(description: Description) -> Urdf:
    """Reads every link and joint.

    Raises:
        ValueError: an element, its owner and what is allowed; every mesh file of a collision shape that cannot be
            used, and why. FileNotFoundError: the same where some file is missing.
    """
    remarks = Remarks()
    links: dict[str, Link] = {}
    faults: list[str] = []
    missing = False
    for element in description.root.findall("link"):
        name = attribute(element, "name", f"{description.label}: a link")
        owner = f"{description.label}: link {name!r}"
        if name in links:
            raise ValueError(f"{description.label}: link {name!r} is defined twice")
        shapes = shapes_of(element, description, owner, remarks)
        faults += shapes.faults
        missing = missing or shapes.missing
        inertial = element.find("inertial")
        links[name] = Link(
            name=name,
            inertial=None if inertial is None else _inertial(inertial, owner, remarks),
            collisions=tuple(shapes.collisions),
            visuals=tuple(shapes.visuals),
        )
    joints: dict[str, UrdfJoint] = {}
    for element in description.root.findall("joint"):
        joint = _joint(element, description.label, remarks)
        if joint.name in joints:
            raise ValueError(f"{description.label}: joint {joint.name!r} is defined twice")
        joints[joint.name] = joint
    root = _root(links, joints, description.label)
    if faults:
        raise (FileNotFoundError if missing else ValueError)("\n".join(faults))
    warn_of_degrees(description.label, _odd_angles(description, joints), stacklevel=3)
    return Urdf(description.root.get("name", "robot"), description.label, links, joints, root, remarks)


def _odd_angles(description: Description, joints: dict[str, UrdfJoint]) -> list[str]:
    """Angles of a description that look like degrees: limits, and angles of <origin>."""
    odd = [
        f"{side} limit {value:g} of joint {joint.name!r}"
        for joint in joints.values()
        if joint.type == "revolute" and joint.limit is not None
        for side, value in (("lower", joint.limit.lower), ("upper", joint.limit.upper))
        if looks_like_degrees(value)
    ]
    read = ("joint", *(f"link/{part}" for part in ("inertial", "visual", "collision")))
    for element in (found for way in read for found in description.root.findall(way)):
        origin = element.find("origin")
        rpy = "" if origin is None else origin.get("rpy", "")
        if any(looks_like_degrees(float(part)) for part in words(rpy)):
            odd.append(f"rpy {rpy!r} of <{element.tag}> {element.get('name', '')!r}")
    return odd


def _root(links: dict[str, Link], joints: dict[str, UrdfJoint], label: str) -> str:
    """The only link that is no joint's child, after checking that the joints form one tree over all links."""
    if not links:
        raise ValueError(
            f"{label} has no link (of xacro macros only, the file that calls them makes a robot)"
        )
    parent_joint: dict[str, str] = {}
    children: dict[str, list[str]] = {name: [] for name in links}
    for joint in joints.values():
        for role, link in (("parent", joint.parent), ("child", joint.child)):
            if link not in links:
                raise ValueError(f"{label}: joint {joint.name!r}: {role} link {link!r} does not exist")
        if joint.child in parent_joint:
            raise ValueError(
                f"{label}: link {joint.child!r} is the child of joints {parent_joint[joint.child]!r} and "
                f"{joint.name!r}; a link has at most one parent"
            )
        parent_joint[joint.child] = joint.name
        children[joint.parent].append(joint.child)
    roots = [name for name in links if name not in parent_joint]
    if len(roots) > 1:
        raise ValueError(f"{label} has several root links {roots}; join them by (fixed) joints into one tree")
    reached: set[str] = set()
    open_links = list(roots)
    while open_links:
        link = open_links.pop()
        reached.add(link)
        open_links.extend(children[link])
    if len(reached) != len(links):
        raise ValueError(
            f"{label}: links {sorted(set(links) - reached)} hang on a loop of joints, not on a root"
        )
    for joint in joints.values():
        if joint.mimic is not None and joint.mimic.joint not in joints:
            raise ValueError(
                f"{label}: joint {joint.name!r} mimics {joint.mimic.joint!r}, which does not exist; "
                f"the joints are: {', '.join(joints)}"
            )
    return roots[0]


def _joint(element: ElementTree.Element, label: str, remarks: Remarks) -> UrdfJoint:
    owner = f"{label}: joint {attribute(element, 'name', f'{label}: a joint')!r}"
    kind = attribute(element, "type", owner)
    if kind not in JOINT_TYPES:
        raise ValueError(f"{owner} has type {kind!r}; allowed: {', '.join(JOINT_TYPES)}")
    ends = {}
    for role in ("parent", "child"):
        end = element.find(role)
        if end is None:
            raise ValueError(f"{owner} has no <{role}>")
        ends[role] = attribute(end, "link", f"{owner}: <{role}>")
    axis = np.array([1.0, 0.0, 0.0])  # the URDF default
    axis_element = element.find("axis")
    if axis_element is not None and kind not in ("fixed", *FREE_TYPES):
        axis = np.array(numbers(axis_element, "xyz", owner, remarks, count=3))
        length = float(np.linalg.norm(axis))
        if length == 0.0:
            raise ValueError(f"{owner}: axis is zero, must have a direction")
        axis = axis / length
    limit = _limit(element.find("limit"), kind, owner)
    mimic_element = element.find("mimic")
    mimic = None
    if mimic_element is not None and kind not in ("fixed", *FREE_TYPES):
        mimic = UrdfMimic(
            joint=attribute(mimic_element, "joint", f"{owner}: <mimic>"),
            multiplier=number(mimic_element, "multiplier", f"{owner}: <mimic>", default=1.0),
            offset=number(mimic_element, "offset", f"{owner}: <mimic>", default=0.0),
        )
    name = str(element.get("name"))
    return UrdfJoint(
        name, kind, ends["parent"], ends["child"], placement(element, owner, remarks), axis, limit, mimic
    )


def _limit(element: ElementTree.Element | None, kind: str, owner: str) -> UrdfLimit | None:
    """The limit of a moving joint. Revolute and prismatic joints must have one; a continuous one may."""
    if kind in ("fixed", *FREE_TYPES):
        return None
    if element is None:
        if kind == "continuous":
            return None
        raise ValueError(f"{owner} is {kind} and has no <limit>; give lower, upper, velocity and effort")
    where = f"{owner}: <limit>"
    lower, upper = -math.inf, math.inf
    if kind != "continuous":
        lower = number(element, "lower", where, default=0.0, finite=False)
        upper = number(element, "upper", where, default=0.0, finite=False)
    return UrdfLimit(
        lower=lower,
        upper=upper,
        velocity=_positive(element, "velocity", where),
        effort=_positive(element, "effort", where),
    )


def _positive(element: ElementTree.Element, key: str, where: str) -> float | None:
    """A limit; None where it is missing, zero or negative, as exporters write what they do not know."""
    if not element.get(key):
        return None
    value = number(element, key, where, finite=False)
    return value if value > 0.0 else None


def _inertial(element: ElementTree.Element, owner: str, remarks: Remarks) -> Inertial | None:
    where = f"{owner}: <inertial>"
    mass_element, inertia_element = element.find("mass"), element.find("inertia")
    if mass_element is None:
        remarks.add(NO_MASS, short(owner))
        return None
    mass = number(mass_element, "value", where)
    if mass < 0.0:
        raise ValueError(f"{where}: mass is {mass}, must not be negative")
    X = placement(element, where, remarks)
    if inertia_element is None or not all(inertia_element.get(key) for key in ("ixx", "iyy", "izz")):
        remarks.add(NO_INERTIA, short(owner))
        return Inertial(mass, X[:3, 3], np.zeros((3, 3)))
    xx, yy, zz = (number(inertia_element, key, where) for key in ("ixx", "iyy", "izz"))
    xy, xz, yz = (number(inertia_element, key, where, default=0.0) for key in ("ixy", "ixz", "iyz"))
    own = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    check_inertia(mass, own, short(owner), remarks)
    return Inertial(mass, X[:3, 3], X[:3, :3] @ own @ X[:3, :3].T)
