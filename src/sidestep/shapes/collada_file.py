"""COLLADA geometry without its materials: what has no part in a shape cannot break it."""

from __future__ import annotations

import io
import xml.etree.ElementTree as ElementTree
from typing import Any

import numpy as np

NOT_FINITE = "vertices that are not finite (nan or inf)"
_MOST = float(np.finfo(np.float32).max)  # more is infinite for the reader behind trimesh
_NO_SHAPE = frozenset(
    (
        *(
            f"library_{kind}"
            for kind in ("materials", "effects", "images", "lights", "cameras", "animations")
        ),
        *(
            f"library_{kind}"
            for kind in ("animation_clips", "physics_materials", "physics_models", "physics_scenes")
        ),
        *("library_force_fields", "bind_material", "instance_light", "instance_camera", "extra"),
        *("instance_physics_scene", "lines", "linestrips"),
    )
)
_UNREAD = {  # elements with a shape that the reader behind trimesh passes over
    "instance_controller": "a skinned or morphed shape",
    "tristrips": "triangle strips",
    "trifans": "triangle fans",
    "convex_mesh": "a convex mesh",
    "spline": "a spline",
}


def shape_alone(content: bytes) -> io.BytesIO:
    """A file's content without materials, lights, cameras and animations, for trimesh.

    Raises:
        ValueError: it is no XML, has a kind of shape that is not read, or vertices that are not finite; does not name
            the file.
    """
    try:
        root = ElementTree.parse(io.BytesIO(content)).getroot()
    except ElementTree.ParseError as error:
        raise ValueError(f"it is no well-formed XML: {error}") from error
    for element in list(root.iter()):
        for child in list(element):
            if _name(child) in _NO_SHAPE:
                element.remove(child)
    for element in root.iter():
        if _name(element) in _UNREAD:
            raise ValueError(f"it holds {_UNREAD[_name(element)]} (<{_name(element)}>), which is not read")
        if _name(element) in ("triangles", "polylist", "polygons"):
            element.attrib.pop("material", None)
    _check_finite(root)
    return io.BytesIO(ElementTree.tostring(root))


def _check_finite(root: ElementTree.Element) -> None:
    """The reader behind trimesh puts 0 in place of a coordinate that is not a number."""
    sources = {element.get("id"): element for element in root.iter() if _name(element) == "source"}
    bad = total = 0
    for element in root.iter():
        if _name(element) != "input" or element.get("semantic") != "POSITION":
            continue
        source = sources.get(element.get("source", "").removeprefix("#"), ElementTree.Element("source"))
        for array in source.iter():
            if _name(array) == "float_array":
                values = [_number(word) for word in (array.text or "").split()]
                points = np.resize(values, (len(values) // 3, 3))
                bad += int(np.sum(~(np.abs(points) <= _MOST).all(axis=1)))
                total += len(points)
    if bad:
        raise ValueError(f"it holds {NOT_FINITE}: {bad} of {total}")


def _number(word: str) -> float:
    try:
        return float(word)
    except ValueError:  # as "-1.#IND", which some compilers write for nan
        return np.nan


def _name(element: ElementTree.Element) -> str:
    tag: Any = element.tag  # comments have a function
    return tag.rpartition("}")[2] if isinstance(tag, str) else ""
