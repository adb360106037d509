"""Shapes of a URDF: <visual> and <collision> as geometry, with what is wrong with their mesh files."""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from sidestep.robot.elements import attribute, number, numbers, placement, short
from sidestep.robot.link import Array, Geometry
from sidestep.robot.references import resolve
from sidestep.robot.remarks import Remarks
from sidestep.robot.source import Description
from sidestep.shapes import KINDS
from sidestep.shapes.mesh_file import fault_of

THICKNESS = (
    1e-3  # [m] of a shape that is written without one: thin against any arm, thick enough to be covered
)

NO_GEOMETRY = "holds no <geometry>, and is left out"
NO_SHAPE = "stands in <geometry> and is no shape that is known; it is ignored"
SEVERAL_SHAPES = "<geometry> holds several shapes, where one is allowed; all are kept, at the same place"
NO_SIZE = "has the size zero, and is left out"
FLAT = f"has a size of zero in some direction; {THICKNESS * 1e3:g} mm are taken there"
ONE_SCALE = "scale is one number, where three are asked for; it is taken for all axes"
ELSEWHERE = "is found elsewhere than written, by the tail of its path; check that it is the right file"
NO_VISUAL = "the mesh of a <visual> cannot be used; the collision shape is shown in its place"


@dataclass
class Shapes:
    """The geometry of one link, and the mesh files that it lacks.

    Args:
        collisions, visuals: what can be used. faults: of collision meshes; visual_faults: of visual ones.
        missing: whether a file is not there at all.
    """

    collisions: list[Geometry] = field(default_factory=list)
    visuals: list[Geometry] = field(default_factory=list)
    faults: list[str] = field(default_factory=list)
    visual_faults: list[tuple[str, str]] = field(default_factory=list)  # what was written, and what is wrong
    missing: bool = False


def shapes_of(element: ElementTree.Element, description: Description, owner: str, remarks: Remarks) -> Shapes:
    """The shapes of a link. Files of visuals that cannot be used are faults where the link has no collision shape.

    Raises:
        ValueError: an element, its owner and what is allowed.
    """
    found = Shapes()
    for tag, into in (("collision", found.collisions), ("visual", found.visuals)):
        for item in element.findall(tag):
            into += _geometries(item, _Place(f"{owner}: <{tag}>", owner, description, remarks, found))
    if found.visual_faults and not found.faults:
        if found.collisions:
            for written, fault in found.visual_faults:
                remarks.add(NO_VISUAL, f"{short(owner)}: {written!r} {fault.partition('; ')[0]}")
            found.visuals.clear()  # whole or not at all: half a link would be drawn
            found.missing = False
        else:
            found.faults += [
                f"{owner} refers to {text!r}, which {fault}" for text, fault in found.visual_faults
            ]
    return found


def _allowed() -> list[str]:
    """The elements that are shapes: a mesh, and solids, those of most lengths first."""
    solids = [kind for kind in KINDS.values() if kind.bounded and kind.length_fields()]
    solids.sort(key=lambda kind: -sum(entry.number for entry in kind.length_fields()))
    return ["mesh", *(kind.kind for kind in solids)]


@dataclass(frozen=True)
class _Place:
    """The <collision> or <visual> that is read, and where goes what is found out about it."""

    where: str
    owner: str
    description: Description
    remarks: Remarks
    found: Shapes


def _geometries(element: ElementTree.Element, place: _Place) -> list[Geometry]:
    where, remarks = place.where, place.remarks
    container = element.find("geometry")
    inside = [] if container is None else [item for item in container if isinstance(item.tag, str)]
    shapes = [item for item in inside if item.tag in _allowed()]
    if not inside:
        remarks.add(NO_GEOMETRY, short(where))
        return []
    if not shapes:
        names = ", ".join(f"<{shape.tag}>" for shape in inside)
        raise ValueError(f"{where}: <geometry> holds {names}; allowed: one of {', '.join(_allowed())}")
    for other in inside:
        if other not in shapes:
            remarks.add(NO_SHAPE, f"{short(where)} <{other.tag}>")
    if len(shapes) > 1:
        remarks.add(SEVERAL_SHAPES, short(where))
    X = placement(element, where, remarks)
    made = [_shape(shape, X, place) for shape in shapes]
    return [geometry for geometry in made if geometry is not None]


def _shape(shape: ElementTree.Element, X: Array, place: _Place) -> Geometry | None:
    if shape.tag == "mesh":
        return _mesh(shape, X, place)
    where, remarks = place.where, place.remarks
    kind = KINDS[shape.tag]
    size: tuple[float, ...] = ()
    for name, count, *_ in kind.length_fields():
        one = count == 1
        size += (number(shape, name, where),) if one else numbers(shape, name, where, remarks, count=count)
    if min(size) < 0.0:
        raise ValueError(f"{where}: {shape.tag} dimensions {size} must not be negative")
    what = f"{short(where)} {shape.tag} {size}"
    if max(size) == 0.0:
        remarks.add(NO_SIZE, what)
        return None
    if min(size) > 0.0:
        return Geometry(shape.tag, X, size=size)
    simpler = kind.where_flat(size)
    if simpler is not None:
        return Geometry(simpler.kind, X, size=simpler.lengths)
    remarks.add(FLAT, what)
    return Geometry(shape.tag, X, size=tuple(value or THICKNESS for value in size))


def _mesh(shape: ElementTree.Element, X: Array, place: _Place) -> Geometry | None:
    where, owner, remarks, found = place.where, place.owner, place.remarks, place.found
    scale = numbers(shape, "scale", where, remarks, count=3, default="1 1 1", fewer=(1,))
    if len(scale) == 1:
        remarks.add(ONE_SCALE, f"{short(where)} {shape.get('scale')!r}")
        scale = scale * 3
    if 0.0 in scale:
        raise ValueError(f"{where}: mesh scale {scale} must not be zero")
    written = attribute(shape, "filename", where)
    visual = where.endswith("<visual>")
    reference = resolve(written, owner, place.description.packages)
    path: Path | None = reference.path
    if path is None:
        found.missing = True
        fault = reference.failure
        if visual:
            found.visual_faults.append((written, fault.partition(", which ")[2]))
        else:
            found.faults.append(fault)
        return None
    if reference.elsewhere:
        remarks.add(ELSEWHERE, f"{written!r} at {path}")
    fault = fault_of(path)
    if fault and visual:
        found.visual_faults.append((written, fault))
    elif fault:
        found.faults.append(f"{owner} refers to {written!r}, which {fault}")
    return None if fault else Geometry("mesh", X, path=path, scale=np.array(scale))
