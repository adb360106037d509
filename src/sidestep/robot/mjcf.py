"""MJCF: a robot from a file of MuJoCo, which parses and compiles it."""

from __future__ import annotations

import re
import warnings
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from sidestep.math.pose import about_axis, from_quaternion, pose_at
from sidestep.robot.degrees import warn_of_degrees
from sidestep.robot.formats import other_root
from sidestep.robot.link import Array, Inertial, Link
from sidestep.robot.mjcf_compile import Compiled, compiled
from sidestep.robot.mjcf_geometry import shapes_of
from sidestep.robot.mjcf_joints import (
    SLIDE_VELOCITY,
    TURN_VELOCITY,
    Actuation,
    Coupling,
    actuation,
    couplings,
    limit_of,
    name_of,
)
from sidestep.robot.source import is_text
from sidestep.robot.urdf_elements import Urdf, UrdfJoint, UrdfMimic

if TYPE_CHECKING:  # imported where it is used: URDF needs no MuJoCo
    import mujoco

WORLD = "world"  # MuJoCo's name of body 0, here that of the root link
_PROLOGUE = re.compile(r"(?:\s|<\?.*?\?>|<!--.*?-->|<![A-Z][^>]*>)*<([\w:.-]+)", re.DOTALL)
_LISTED = 6  # names in a warning


@dataclass(frozen=True, eq=False)
class Mjcf:
    """What an MJCF says of a robot.

    Attributes:
        urdf: links and joints, as of a URDF; the root link is the world.
        allowed_pairs: links of `<exclude>`, which may touch.
        keyframes: name of each, with the position of every joint [rad | m].
        without_velocity, without_effort: joints of which the file gives no such limit.
    """

    urdf: Urdf
    allowed_pairs: tuple[tuple[str, str], ...]
    keyframes: Mapping[str, Mapping[str, float]]
    without_velocity: tuple[str, ...]
    without_effort: tuple[str, ...]

    def postures(self, coordinates: Sequence[str]) -> dict[str, Array]:
        """The keyframes as configurations (nv,)."""
        return {name: np.array([at[joint] for joint in coordinates]) for name, at in self.keyframes.items()}


def warn_of_defaults(
    mjcf: Mjcf, coordinates: Sequence[str], velocity_limits: object, effort_limits: object
) -> None:
    """One warning of limits that neither the file nor the caller gives."""
    parts = []
    for what, lacking, given, instead in (
        (
            "velocity",
            mjcf.without_velocity,
            velocity_limits,
            f"taken as {TURN_VELOCITY} rad/s, {SLIDE_VELOCITY} m/s",
        ),
        ("effort", mjcf.without_effort, effort_limits, "taken as unlimited"),
    ):
        known = given if isinstance(given, Mapping) else () if given is None else coordinates
        names = [name for name in coordinates if name in lacking and name not in known]
        if names:
            parts.append(f"no {what} limits for {_listed(names)} ({instead}; give {what}_limits)")
    if parts:
        warnings.warn(f"{mjcf.urdf.label} has {'; '.join(parts)}", RuntimeWarning, stacklevel=3)


def is_mjcf(source: str | Path) -> bool:
    """Whether the root element of a file, or of XML text, is `<mujoco>`; False without such a file."""
    return _root_element(source) == "mujoco"


def _root_element(source: str | Path) -> str:
    """The name of the root element; "" without one."""
    if is_text(source):
        text = source
    elif Path(source).is_file():
        text = Path(source).read_bytes().decode("utf-8-sig", errors="replace")
    else:
        return ""
    first = _PROLOGUE.match(text)
    return "" if first is None else first[1]


def no_mjcf(source: str | Path) -> Exception:
    """The error for a source that is not MJCF."""
    if is_text(source) or Path(source).is_file():
        label = "the text" if is_text(source) else source
        hint = other_root(_root_element(source))
        return ValueError(f"{label} is no MJCF: its root element must be <mujoco>{hint}")
    return FileNotFoundError(f"robot description {Path(source).resolve()} does not exist or is not a file")


def read_mjcf(source: str | Path) -> Mjcf:
    """Reads what `is_mjcf` takes.

    Raises:
        FileNotFoundError: a file that it refers to is missing; a visual mesh or texture is left out.
        ValueError: MuJoCo refuses it, or nothing in it moves.
        ModuleNotFoundError: MuJoCo is not installed; says how to install it.
    """
    label = "MJCF string" if is_text(source) else str(Path(source).resolve())
    whole = compiled(source, label)
    warn_of_degrees(label, whole.degrees, stacklevel=3)
    return _Reader(whole, label).read()


@dataclass
class _Reader:
    """Turns one compiled model into links and joints."""

    whole: Compiled
    label: str
    links: dict[str, Link] = field(default_factory=dict)
    joints: dict[str, UrdfJoint] = field(default_factory=dict)
    link_of: dict[int, str] = field(default_factory=dict)  # body -> its link
    no_velocity: list[str] = field(default_factory=list)
    no_effort: list[str] = field(default_factory=list)
    locked: list[str] = field(default_factory=list)  # ball and free joints
    shown: list[str] = field(default_factory=list)  # links of which visual shapes stand for collision shapes
    ignored: list[str] = field(default_factory=list)  # shapes without volume

    def __post_init__(self) -> None:
        self.model: mujoco.MjModel = self.whole.model
        self.undrawn = {int(body.id) for body in self.whole.left_out.bodies}

    def read(self) -> Mjcf:
        model = self.model
        driven = actuation(model)
        followed, remarks = couplings(model, driven)
        roots, left_out = self._robot_roots(driven)
        kept = sorted(body for root in roots for body in self._subtree(root))
        self.link_of = {0: WORLD, **{body: name_of(model, "body", body) for body in kept}}
        self.links[WORLD] = Link(WORLD)
        for body in kept:
            self._add_body(body, followed, driven)
        texts = (
            (left_out, "{} left out: not part of the robot"),
            (self.locked, "joints {} (ball or free) are held where the file puts them"),
            (self.shown, "bodies {} have no collision shapes; their visual ones are used"),
            (self.ignored, "shapes without volume are left out: {}"),
            (self._loops(), "links {} close loops, which are left open; lock the joints in between"),
        )
        if self.whole.left_out.files:
            remarks.append(self.whole.left_out.remark())
        for remark in [*(text.format(_listed(names)) for names, text in texts if names), *remarks]:
            warnings.warn(f"{self.label}: {remark}", RuntimeWarning, stacklevel=4)
        return Mjcf(
            Urdf(self.whole.name or "robot", self.label, self.links, self.joints, WORLD),
            self._excluded(),
            self._keyframes(),
            tuple(self.no_velocity),
            tuple(self.no_effort),
        )

    def _subtree(self, root: int) -> list[int]:
        parents, inside = self.model.body_parentid, {root}
        for body in range(root + 1, self.model.nbody):  # MuJoCo numbers parents before their children
            if int(parents[body]) in inside:
                inside.add(body)
        return sorted(inside)

    def _robot_roots(self, driven: Actuation) -> tuple[list[int], list[str]]:
        """The children of the world that belong to the robot, and what is left out.

        They move by hinges or slides; the actuated ones alone if there are such. What has a free joint is an object.
        """
        import mujoco

        model = self.model
        tops = [body for body in range(1, model.nbody) if model.body_parentid[body] == 0]
        free = int(mujoco.mjtJoint.mjJNT_FREE)
        single = (int(mujoco.mjtJoint.mjJNT_HINGE), int(mujoco.mjtJoint.mjJNT_SLIDE))
        joints = {top: self._joints_of(self._subtree(top)) for top in tops}
        movable = [top for top in tops if any(model.jnt_type[j] in single for j in joints[top])]
        if not movable:
            raise ValueError(f"{self.label} has no body that moves by a hinge or slide joint: it is no arm")
        standing = [top for top in movable if not any(model.jnt_type[j] == free for j in joints[top])]
        actuated = [top for top in movable if driven.joints.intersection(joints[top])]
        roots = actuated or standing or movable
        left_out = []
        others = [top for top in tops if top not in roots and self._has_shape(top)]
        if others:
            left_out.append(f"bodies {_listed(name_of(model, 'body', top) for top in others)}")
        flat = (int(mujoco.mjtGeom.mjGEOM_PLANE), int(mujoco.mjtGeom.mjGEOM_HFIELD))
        solid = sum(int(model.geom_type[g]) not in flat for g in self._geoms_of(0))
        if solid:
            left_out.append(f"{solid} shapes of the world itself")
        return roots, left_out

    def _joints_of(self, bodies: Iterable[int]) -> list[int]:
        model = self.model
        return [
            joint
            for body in bodies
            for joint in range(
                model.body_jntadr[body], model.body_jntadr[body] + int(model.body_jntnum[body])
            )
        ]

    def _geoms_of(self, body: int) -> range:
        first = int(self.model.body_geomadr[body])
        return range(first, first + int(self.model.body_geomnum[body]))

    def _has_shape(self, top: int) -> bool:
        return any(len(self._geoms_of(body)) for body in self._subtree(top))

    def _add_body(self, body: int, followed: Mapping[int, Coupling], driven: Actuation) -> None:
        """The link of a body, behind the joints that move it, and a link for each of its named sites."""
        import mujoco

        model, name = self.model, self.link_of[body]
        parent = self.link_of[int(model.body_parentid[body])]
        X = _pose(model.body_pos[body], model.body_quat[body])  # of the body in `parent`
        moving = []
        for joint in self._joints_of([body]):
            if int(model.jnt_type[joint]) in (mujoco.mjtJoint.mjJNT_FREE, mujoco.mjtJoint.mjJNT_BALL):
                self.locked.append(name_of(model, "joint", joint))
            else:
                moving.append(joint)
        for joint in moving:
            coupling = followed.get(joint)
            axis = np.array(model.jnt_axis[joint], dtype=float)
            turns = int(model.jnt_type[joint]) == int(mujoco.mjtJoint.mjJNT_HINGE)
            anchor = np.array(model.jnt_pos[joint], dtype=float) if turns else np.zeros(3)
            reference = float(model.qpos0[model.jnt_qposadr[joint]])
            if coupling is not None and coupling.source is None:  # held at a value by an equality
                X = X @ pose_at(anchor) @ _moved(turns, axis, coupling.offset - reference) @ pose_at(-anchor)
                continue
            title = name_of(model, "joint", joint)
            whole = joint == moving[-1] and not anchor.any()
            child = name if whole else self._new_link(f"{name}_at_{title}")
            limit = limit_of(model, joint, driven, self.whole.ranges)
            if not driven.velocity.get(joint):
                self.no_velocity.append(title)
            if limit.effort is None or not np.isfinite(limit.effort):
                self.no_effort.append(title)
            self.joints[title] = UrdfJoint(
                name=title,
                type="prismatic" if not turns else "revolute" if np.isfinite(limit.upper) else "continuous",
                parent=parent,
                child=child,
                placement=X @ pose_at(anchor) @ _moved(turns, axis, -reference),
                axis=axis,
                limit=limit,
                mimic=None
                if coupling is None or coupling.source is None
                else UrdfMimic(
                    joint=name_of(model, "joint", coupling.source),
                    multiplier=coupling.multiplier,
                    offset=coupling.offset,
                ),
            )
            parent, X = child, pose_at(-anchor)
        if name != parent:
            self._fix(parent, name, X)
        collisions, visuals, without_volume = shapes_of(model, self._geoms_of(body))
        self.ignored.extend(f"{name} ({kind})" for kind in without_volume)
        if body in self.undrawn:
            visuals = []  # whole or not at all: half a link would be drawn
        if visuals and not collisions:
            self.shown.append(name)
        self.links[name] = Link(name, self._inertial(body), tuple(collisions), tuple(visuals))
        for site in range(model.nsite):
            if int(model.site_bodyid[site]) == body and model.site(site).name:
                frame = self._new_link(model.site(site).name, clash="_site")
                self._fix(name, frame, _pose(model.site_pos[site], model.site_quat[site]))

    def _new_link(self, name: str, clash: str = "_") -> str:
        while name in self.links or name in self.link_of.values():
            name += clash
        self.links[name] = Link(name)
        return name

    def _fix(self, parent: str, child: str, placement: Array) -> None:
        name = f"{child}_fixed"
        moving = {name_of(self.model, "joint", index) for index in range(self.model.njnt)}
        while name in moving or name in self.joints:
            name += "_"
        axis = np.array([1.0, 0.0, 0.0])
        self.joints[name] = UrdfJoint(
            name=name,
            type="fixed",
            parent=parent,
            child=child,
            placement=placement,
            axis=axis,
            limit=None,
            mimic=None,
        )

    def _inertial(self, body: int) -> Inertial | None:
        """Mass properties of a body in its own axes; MuJoCo holds them in the principal ones."""
        model = self.model
        if not model.body_mass[body] > 0.0:
            return None
        R = _pose(model.body_ipos[body], model.body_iquat[body])[:3, :3]
        inertia = R @ np.diag(model.body_inertia[body]) @ R.T
        return Inertial(float(model.body_mass[body]), np.array(model.body_ipos[body]), inertia)

    def _excluded(self) -> tuple[tuple[str, str], ...]:
        """A signature is body1 << 16 | body2, see mjModel.exclude_signature."""
        pairs = [(int(both) >> 16, int(both) & 0xFFFF) for both in self.model.exclude_signature]
        return tuple(
            (self.link_of[a], self.link_of[b])
            for a, b in pairs
            if a in self.link_of and b in self.link_of and 0 not in (a, b)
        )

    def _keyframes(self) -> dict[str, dict[str, float]]:
        model = self.model
        places = {
            name_of(model, "joint", index): int(model.jnt_qposadr[index])
            for index in range(model.njnt)
            if name_of(model, "joint", index) in self.joints
        }
        return {
            model.key(key).name or f"key{key}": {
                name: float(model.key_qpos[key][at]) for name, at in places.items()
            }
            for key in range(model.nkey)
        }

    def _loops(self) -> list[str]:
        import mujoco

        model = self.model
        kinds = (int(mujoco.mjtEq.mjEQ_CONNECT), int(mujoco.mjtEq.mjEQ_WELD))
        sites = int(mujoco.mjtObj.mjOBJ_SITE)
        closed = []
        for index in range(model.neq):
            if int(model.eq_type[index]) not in kinds:
                continue
            ends = [int(model.eq_obj1id[index]), int(model.eq_obj2id[index])]
            if int(model.eq_objtype[index]) == sites:
                ends = [int(model.site_bodyid[end]) for end in ends]
            if all(end > 0 and end in self.link_of for end in ends):
                closed.append(" and ".join(self.link_of[end] for end in ends))
        return closed


def _pose(position: Any, quaternion: Any) -> Array:
    unit = np.array(quaternion, dtype=float)
    return pose_at(np.array(position, dtype=float), from_quaternion(unit / np.linalg.norm(unit)))


def _moved(turns: bool, axis: Array, value: float) -> Array:
    return pose_at(np.zeros(3), about_axis(axis, value)) if turns else pose_at(value * axis)


def _listed(names: Iterable[str]) -> str:
    every = list(names)
    more = f" and {len(every) - _LISTED} more" if len(every) > _LISTED else ""
    return ", ".join(every[:_LISTED]) + more
