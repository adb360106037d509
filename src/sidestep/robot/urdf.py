"""URDF elements as plain values, checked one by one and as a tree."""

from __future__ import annotations

import math
import warnings
import xml.etree.ElementTree as ElementTree
from dataclasses import dataclass

import numpy as np

from sidestep.robot.degrees import DEGREES_HINT, looks_like_degrees
from sidestep.robot.link import Array, Geometry, Inertial, Link
from sidestep.robot.pose import from_roll_pitch_yaw, pose_at
from sidestep.robot.source import Description

JOINT_TYPES = ("revolute", "continuous", "prismatic", "fixed")
_INERTIA_ROUNDING = 1e-12  # [kg m^2] a CAD export's zero; the lightest finger has 1e-7
GEOMETRY_TYPES = ("mesh", "box", "cylinder", "sphere")


@dataclass(frozen=True)
class UrdfLimit:
    """The limit element of a joint; position [rad | m], velocity [/s], effort [Nm | N]."""

    lower: float
    upper: float
    velocity: float
    effort: float


@dataclass(frozen=True)
class UrdfMimic:
    """The mimic element: position = multiplier * position of `joint` + offset."""

    joint: str
    multiplier: float
    offset: float


@dataclass(frozen=True, eq=False)
class UrdfJoint:
    """A joint element; `placement` (4, 4) in the parent link's frame, `axis` (3,) of unit length."""

    name: str
    type: str
    parent: str
    child: str
    placement: Array
    axis: Array
    limit: UrdfLimit | None
    mimic: UrdfMimic | None

    @property
    def moves(self) -> bool:
        return self.type != "fixed"


@dataclass(frozen=True, eq=False)
class Urdf:
    """A checked description: every link is reached from `root`, every joint refers to what exists."""

    name: str
    label: str
    links: dict[str, Link]
    joints: dict[str, UrdfJoint]
    root: str


def parse_urdf(description: Description) -> Urdf:
    """Reads every link and joint.

    Raises:
        ValueError: an element, its owner and what is allowed. FileNotFoundError: a missing mesh file.
    """
    links: dict[str, Link] = {}
    for element in description.root.findall("link"):
        link = _link(element, description)
        if link.name in links:
            raise ValueError(f"{description.label}: link {link.name!r} is defined twice")
        links[link.name] = link
    joints: dict[str, UrdfJoint] = {}
    for element in description.root.findall("joint"):
        joint = _joint(element, description.label)
        if joint.name in joints:
            raise ValueError(f"{description.label}: joint {joint.name!r} is defined twice")
        joints[joint.name] = joint
    root = _root(links, joints, description.label)
    _warn_of_degrees(description, joints)
    return Urdf(description.root.get("name", "robot"), description.label, links, joints, root)


def _warn_of_degrees(description: Description, joints: dict[str, UrdfJoint]) -> None:
    """One warning of all angles of a description that look like degrees: limits, and angles of <origin>."""
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
        if any(looks_like_degrees(float(part)) for part in rpy.split()):
            odd.append(f"rpy {rpy!r} of <{element.tag}> {element.get('name', '')!r}")
    if odd:
        more = f" and {len(odd) - 3} more" if len(odd) > 3 else ""
        warnings.warn(
            f"{description.label}: {', '.join(odd[:3])}{more} {DEGREES_HINT}", RuntimeWarning, stacklevel=4
        )


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


def _joint(element: ElementTree.Element, label: str) -> UrdfJoint:
    owner = f"{label}: joint {_attribute(element, 'name', f'{label}: a joint')!r}"
    kind = _attribute(element, "type", owner)
    if kind not in JOINT_TYPES:
        raise ValueError(f"{owner} has type {kind!r}; allowed: {', '.join(JOINT_TYPES)}")
    ends = {}
    for role in ("parent", "child"):
        end = element.find(role)
        if end is None:
            raise ValueError(f"{owner} has no <{role}>")
        ends[role] = _attribute(end, "link", f"{owner}: <{role}>")
    axis = np.array([1.0, 0.0, 0.0])  # the URDF default
    axis_element = element.find("axis")
    if axis_element is not None and kind != "fixed":
        axis = np.array(_numbers(axis_element, "xyz", owner, count=3))
        length = float(np.linalg.norm(axis))
        if length == 0.0:
            raise ValueError(f"{owner}: axis is zero, must have a direction")
        axis = axis / length
    limit = _limit(element.find("limit"), kind, owner)
    mimic_element = element.find("mimic")
    mimic = None
    if mimic_element is not None and kind != "fixed":
        mimic = UrdfMimic(
            joint=_attribute(mimic_element, "joint", f"{owner}: <mimic>"),
            multiplier=_number(mimic_element, "multiplier", f"{owner}: <mimic>", default=1.0),
            offset=_number(mimic_element, "offset", f"{owner}: <mimic>", default=0.0),
        )
    name = str(element.get("name"))
    return UrdfJoint(
        name, kind, ends["parent"], ends["child"], _placement(element, owner), axis, limit, mimic
    )


def _limit(element: ElementTree.Element | None, kind: str, owner: str) -> UrdfLimit | None:
    """The limit of a moving joint. Revolute and prismatic joints must have one; a continuous one may."""
    if kind == "fixed":
        return None
    if element is None:
        if kind == "continuous":
            return None
        raise ValueError(f"{owner} is {kind} and has no <limit>; give lower, upper, velocity and effort")
    where = f"{owner}: <limit>"
    lower, upper = -math.inf, math.inf
    if kind != "continuous":
        lower = _number(element, "lower", where, default=0.0, finite=False)
        upper = _number(element, "upper", where, default=0.0, finite=False)
    return UrdfLimit(
        lower=lower,
        upper=upper,
        velocity=_number(element, "velocity", where, finite=False),
        effort=_number(element, "effort", where, finite=False),
    )


def _link(element: ElementTree.Element, description: Description) -> Link:
    name = _attribute(element, "name", f"{description.label}: a link")
    owner = f"{description.label}: link {name!r}"
    inertial = element.find("inertial")
    return Link(
        name=name,
        inertial=None if inertial is None else _inertial(inertial, owner),
        collisions=tuple(_geometry(item, description, owner) for item in element.findall("collision")),
        visuals=tuple(_geometry(item, description, owner) for item in element.findall("visual")),
    )


def _inertial(element: ElementTree.Element, owner: str) -> Inertial:
    where = f"{owner}: <inertial>"
    mass_element, inertia_element = element.find("mass"), element.find("inertia")
    if mass_element is None or inertia_element is None:
        raise ValueError(f"{where} needs <mass> and <inertia>")
    mass = _number(mass_element, "value", where)
    if mass < 0.0:
        raise ValueError(f"{where}: mass is {mass}, must not be negative")
    xx, yy, zz = (_number(inertia_element, key, where) for key in ("ixx", "iyy", "izz"))
    xy, xz, yz = (_number(inertia_element, key, where, default=0.0) for key in ("ixy", "ixz", "iyz"))
    if min(xx, yy, zz) < -_INERTIA_ROUNDING:
        raise ValueError(f"{where}: ixx, iyy, izz are {xx}, {yy}, {zz}, must not be negative")
    placement = _placement(element, where)
    rotation = placement[:3, :3]
    inertia = rotation @ np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]) @ rotation.T
    return Inertial(mass, placement[:3, 3], inertia)


def _geometry(element: ElementTree.Element, description: Description, owner: str) -> Geometry:
    where = f"{owner}: <{element.tag}>"
    container = element.find("geometry")
    shapes = [] if container is None else list(container)
    if len(shapes) != 1 or shapes[0].tag not in GEOMETRY_TYPES:
        found = ", ".join(f"<{shape.tag}>" for shape in shapes) or "nothing"
        raise ValueError(f"{where}: <geometry> holds {found}; allowed: one of {', '.join(GEOMETRY_TYPES)}")
    shape, placement = shapes[0], _placement(element, where)
    if shape.tag == "mesh":
        scale = _numbers(shape, "scale", where, count=3, default="1 1 1")
        if 0.0 in scale:
            raise ValueError(f"{where}: mesh scale {scale} must not be zero")
        path = description.resolve(_attribute(shape, "filename", where), owner)
        return Geometry("mesh", placement, path=path, scale=np.array(scale))
    if shape.tag == "box":
        size = _numbers(shape, "size", where, count=3)
    elif shape.tag == "cylinder":
        size = (_number(shape, "radius", where), _number(shape, "length", where))
    else:
        size = (_number(shape, "radius", where),)
    if min(size) <= 0.0:
        raise ValueError(f"{where}: {shape.tag} dimensions {size} must be positive")
    if shape.tag == "box":
        return Geometry("box", placement, size=size)
    return Geometry("cylinder" if shape.tag == "cylinder" else "sphere", placement, size=size)


def _placement(element: ElementTree.Element, owner: str) -> Array:
    """The pose (4, 4) of <origin>: roll, pitch, yaw about fixed axes, translation; identity if absent."""
    origin = element.find("origin")
    if origin is None:
        return np.eye(4)
    where = f"{owner}: <origin>"
    rpy = _numbers(origin, "rpy", where, count=3, default="0 0 0")
    return pose_at(_numbers(origin, "xyz", where, count=3, default="0 0 0"), from_roll_pitch_yaw(rpy))


def _attribute(element: ElementTree.Element, key: str, owner: str) -> str:
    value = element.get(key)
    if not value:
        raise ValueError(f"{owner}: <{element.tag}> has no attribute {key!r}")
    return value


def _number(
    element: ElementTree.Element, key: str, owner: str, *, default: float | None = None, finite: bool = True
) -> float:
    if default is not None and element.get(key) is None:
        return default
    text = _attribute(element, key, owner)
    try:
        value = float(text)
    except ValueError:
        raise ValueError(f"{owner}: {key} is {text!r}, must be a number") from None
    if math.isnan(value) or (finite and math.isinf(value)):
        raise ValueError(f"{owner}: {key} is {text!r}, must be a finite number")
    return value


def _numbers(
    element: ElementTree.Element, key: str, owner: str, *, count: int, default: str | None = None
) -> tuple[float, ...]:
    text = element.get(key) or default
    if text is None:
        raise ValueError(f"{owner}: <{element.tag}> has no attribute {key!r}")
    try:
        values = tuple(float(part) for part in text.split())
    except ValueError:
        values = ()
    if len(values) != count or not all(math.isfinite(value) for value in values):
        raise ValueError(f"{owner}: {key} is {text!r}, must be {count} finite numbers")
    return values
