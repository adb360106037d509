"""MJCF through MuJoCo's compiler, and what the file says that a compiled model does not hold."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sidestep.robot.degrees import looks_like_degrees
from sidestep.robot.mjcf_assets import LeftOut, leave_out_unusable
from sidestep.robot.source import is_text, read_xml

if TYPE_CHECKING:  # imported where it is used: URDF needs no MuJoCo
    import mujoco

_INCLUDE = re.compile(r"""<include\s[^>]*?file\s*=\s*["']([^"']+)""")


@dataclass(frozen=True, eq=False)
class Compiled:
    """A compiled model.

    Attributes:
        model: fixed bodies and visual shapes are in it.
        name: of the model.
        ranges: by joint index, ranges [rad | m] that end where they begin, or before; MuJoCo takes them as none.
        degrees: angles of a file in radians that look like degrees, in words.
        left_out: visual files that cannot be used.
    """

    model: mujoco.MjModel
    name: str
    ranges: Mapping[int, tuple[float, float]]
    degrees: tuple[str, ...]
    left_out: LeftOut


def compiled(source: str | Path, label: str) -> Compiled:
    """Compiles MJCF, a file or its text; without visual meshes and textures that are not there.

    Raises:
        FileNotFoundError: a file that it refers to is missing. ValueError: MuJoCo refuses it. Begins with `label`.
    """
    import mujoco

    left_out = LeftOut()
    # MuJoCo's own cache takes a file for unchanged that was written anew.
    mujoco.mj_clearCache(mujoco.mj_getCache())
    try:
        spec = _spec(source)
        model = spec.compile()
    except ValueError as error:
        try:
            spec = _spec(source)
        except ValueError:
            raise _refused(label, error) from error
        left_out = leave_out_unusable(spec, label, str(error))
        if not left_out.files:
            raise _refused(label, error) from error
        try:
            model = spec.compile()
        except ValueError as other:
            raise _refused(label, other) from other
    _refuse_inverted_forces(spec, label)
    return Compiled(model, spec.modelname, _ranges(spec), tuple(_odd_angles(spec)), left_out)


def _refused(label: str, error: ValueError) -> Exception:
    kind = FileNotFoundError if "opening file" in str(error) else ValueError
    return kind(f"{label} is refused by MuJoCo: {error}")


def _spec(source: str | Path) -> mujoco.MjSpec:
    import mujoco

    spec = mujoco.MjSpec.from_string(source) if is_text(source) else _parsed(Path(source).resolve())
    spec.compiler.fusestatic = False  # fixed bodies are links, with names
    spec.compiler.discardvisual = False
    return spec


def _parsed(path: Path) -> mujoco.MjSpec:
    """MuJoCo reads files of two suffixes alone; of another it gets the text, and what that includes."""
    import mujoco

    if path.suffix.lower() in (".xml", ".urdf"):
        return mujoco.MjSpec.from_file(str(path))
    text = read_xml(path)
    spec = mujoco.MjSpec.from_string(text, include=_included(text, path.parent))
    spec.modelfiledir = str(path.parent)
    return spec


def _included(text: str, folder: Path) -> dict[str, bytes]:
    """The files that MJCF text includes, and those that they include, by the names they are referred to."""
    found: dict[str, bytes] = {}
    for name in _INCLUDE.findall(text):
        if (folder / name).is_file() and name not in found:
            found[name] = (folder / name).read_bytes()
            found |= _included(found[name].decode("utf-8", errors="replace"), folder)
    return found


def _refuse_inverted_forces(spec: mujoco.MjSpec, label: str) -> None:
    """MuJoCo takes an inverted range as none: the joint would have no effort limit."""
    import mujoco

    auto = mujoco.mjtLimited.mjLIMITED_AUTO
    written = [
        *((f"joint {j.name!r}: actuatorfrcrange", j.actfrclimited, j.actfrcrange) for j in spec.joints),
        *((f"actuator {a.name!r}: forcerange", a.forcelimited, a.forcerange) for a in spec.actuators),
        *((f"actuator {a.name!r}: ctrlrange", a.ctrllimited, a.ctrlrange) for a in spec.actuators),
    ]
    for what, limited, (lower, upper) in written:
        if limited == auto and lower > upper:
            raise ValueError(f"{label}: {what}: lower limit {lower} must be below upper {upper}")


def _ranges(spec: mujoco.MjSpec) -> dict[int, tuple[float, float]]:
    import mujoco

    found = {}
    for joint in spec.joints:
        lower, upper = (float(end) for end in joint.range)
        auto = joint.limited == mujoco.mjtLimited.mjLIMITED_AUTO
        if auto and lower >= upper and (lower, upper) != (0.0, 0.0):  # 0 0 is MuJoCo's default, no range
            unit = math.radians(1.0) if _turns(joint) and _in_degrees(spec, joint) else 1.0
            found[int(joint.id)] = (unit * lower, unit * upper)
    return found


def _odd_angles(spec: mujoco.MjSpec) -> Iterator[str]:
    import mujoco

    for joint in spec.joints:
        if not _turns(joint) or _in_degrees(spec, joint):
            continue
        limited = joint.limited != mujoco.mjtLimited.mjLIMITED_FALSE
        ends = (("lower limit", joint.range[0]), ("upper limit", joint.range[1])) if limited else ()
        for what, angle in (*ends, ("ref", joint.ref)):
            if looks_like_degrees(float(angle)):
                yield f"{what} {angle:g} of joint {joint.name!r}"
    for kind, items in (("body", spec.bodies), ("geom", spec.geoms), ("site", spec.sites)):
        for item in items:
            turned = item.alt.type == mujoco.mjtOrientation.mjORIENTATION_EULER
            if turned and not _in_degrees(spec, item) and any(looks_like_degrees(a) for a in item.alt.euler):
                angles = " ".join(f"{angle:g}" for angle in item.alt.euler)
                yield f"euler {angles!r} of {kind} {item.name!r}"


def _turns(joint: Any) -> bool:
    import mujoco

    return bool(joint.type == mujoco.mjtJoint.mjJNT_HINGE)


def _in_degrees(spec: mujoco.MjSpec, item: Any) -> bool:
    """Whether angles of an element are in degrees; one of an attached model has its own compiler."""
    return bool(getattr(item, "compiler", spec.compiler).degree)
