"""Which links may touch, and named postures, from an SRDF: the description that MoveIt's setup assistant writes."""

from __future__ import annotations

import itertools
import warnings
from collections.abc import Iterable, Sequence
from pathlib import Path
from xml.etree.ElementTree import Element

import numpy as np
from numpy.typing import NDArray

from sidestep.robot.source import is_text, parse_xml, read_xml

Pair = tuple[str, str]


def read_srdf(source: str | Path, links: Iterable[str]) -> tuple[Pair, ...]:
    """The pairs among `links` that an SRDF lets touch, in the order of the links.

    These are the pairs of `<disable_collisions>`, and all of a link of `<disable_default_collisions>`, without
    those of `<enable_collisions>`. Links of the file that are not asked for are left out.

    Args:
        source: a path, or the XML text itself (starts with `<`).
        links: names.

    Raises:
        FileNotFoundError: there is no such file.
        ValueError: it is not an SRDF, or an element lacks a link.
    """
    root, label = _root(source)

    def named(tag: str, *keys: str) -> set[frozenset[str]]:
        found = set()
        for element in root.findall(tag):
            names = [element.get(key) for key in keys]
            if not all(names):
                raise ValueError(f"{label}: a <{tag}> has {element.attrib}, must name {' and '.join(keys)}")
            found.add(frozenset(name for name in names if name))
        return found

    off = named("disable_collisions", "link1", "link2")
    on = named("enable_collisions", "link1", "link2")
    loose = {name for single in named("disable_default_collisions", "link") for name in single}
    return tuple(
        (a, b)
        for a, b in itertools.combinations(links, 2)
        if frozenset((a, b)) not in on and (frozenset((a, b)) in off or loose.intersection((a, b)))
    )


def read_postures(source: str | Path, joints: Sequence[str]) -> dict[str, tuple[float, ...]]:
    """The `<group_state>`s of an SRDF that give every one of some joints a value: name -> (nv,) [rad | m].

    Raises:
        FileNotFoundError, ValueError: as `read_srdf`.
    """
    return {
        name: tuple(values[joint] for joint in joints)
        for name, values in read_states(source)
        if all(joint in values for joint in joints)
    }


def read_states(source: str | Path) -> list[tuple[str, dict[str, float]]]:
    """The `<group_state>`s of an SRDF, of whatever joints: their names, which several groups may share, and values.

    Raises:
        FileNotFoundError, ValueError: as `read_srdf`.
    """
    root, label = _root(source)
    states = []
    for state in root.findall("group_state"):
        try:
            values = {
                joint.get("name", ""): float(joint.get("value", "").split()[0])
                for joint in state.findall("joint")
            }
        except (ValueError, IndexError):
            raise ValueError(
                f"{label}: the <group_state> {state.get('name')!r} has a joint without a number as value"
            ) from None
        states.append((state.get("name", ""), values))
    return states


def srdf_beside(path: Path, robot: str) -> Path | None:
    """The SRDF that belongs to a URDF or xacro file, None without one.

    It stands beside the file, or in `srdf` or `config` near it, and its `<robot name>` is the robot's. Of several it is
    that with the file's stem.
    """
    return _beside(path, robot)[0]


def _beside(path: Path, robot: str) -> tuple[Path | None, list[str]]:
    """The SRDF as of `srdf_beside`; where there is none, those that cannot be read and seem to be it, and why."""
    folders = [path.parent, path.parent / "srdf", path.parent.parent / "srdf", path.parent.parent / "config"]
    stem = path.name.split(".")[0]
    found = [file for folder in folders if folder.is_dir() for file in sorted(folder.glob("*.srdf"))]
    broken = []
    for file in sorted(found, key=lambda file: file.stem != stem):
        try:
            root, _ = _root(file)
        except ValueError as error:  # broken, or a template
            if file.stem == stem or f'<robot name="{robot}"'.encode() in file.read_bytes():
                broken.append(str(error))
            continue
        if root.tag == "robot" and root.get("name") == robot:
            return file, []
    return None, broken


def srdf_of(srdf: str | Path | None, urdf: str | Path, robot: str) -> str | Path | None:
    """The SRDF that is given, or the one beside a URDF; None without one."""
    return srdf or (None if is_text(urdf) else srdf_beside(Path(urdf), robot))


def read_extras(
    srdf: str | Path | None, urdf: str | Path, robot: str, joints: Sequence[str], links: Iterable[str]
) -> tuple[dict[str, NDArray[np.float64]], tuple[Pair, ...]]:
    """Postures and pairs that may touch, of an SRDF or the one beside a URDF (`srdf_beside`); none without one.

    Warns of one beside it that cannot be read.
    """
    file = srdf_of(srdf, urdf, robot)
    if not file and not is_text(urdf):
        for fault in _beside(Path(urdf), robot)[1]:
            warnings.warn(
                f"{fault}; the SRDF was not read: postures and pairs that may touch are missing",
                RuntimeWarning,
                stacklevel=3,
            )
    if not file:
        return {}, ()
    postures = {name: np.array(values) for name, values in read_postures(file, joints).items()}
    return postures, read_srdf(file, links)


def _root(source: str | Path) -> tuple[Element, str]:
    """The root element of an SRDF, and what errors call it."""
    if is_text(source):
        label, text = "SRDF string", source.lstrip()
    else:
        label = str(source)
        if not Path(source).is_file():
            raise FileNotFoundError(f"SRDF {label} does not exist or is not a file")
        text = read_xml(Path(source))
    return parse_xml(text, label), label
