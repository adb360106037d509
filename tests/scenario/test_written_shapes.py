"""Shapes as scenario files write them."""

from __future__ import annotations

import json
from typing import Any

import pytest

from sidestep.obstacles import Box, Capsule, Cylinder, Plane, Sphere
from sidestep.scenario import schema_text
from sidestep.scenario.shape import MeshSource, ObstacleShape, PointSource, document_of, shape_of

FLOOR = Plane([0, 0, 0], [0, 0, 1])
WRITTEN: list[tuple[dict[str, Any], ObstacleShape]] = [
    ({"type": "sphere", "radius": 0.1}, Sphere(0.1)),
    ({"type": "box", "size": [0.1, 0.2, 0.3]}, Box((0.1, 0.2, 0.3))),
    ({"type": "cylinder", "radius": 0.1, "length": 2.0}, Cylinder(0.1, 2.0)),
    ({"type": "capsule", "radius": 0.1, "length": 2.0}, Capsule(0.1, 2.0)),
    ({"type": "plane"}, FLOOR),
    ({"type": "plane", "extent": 1.5}, Plane([0, 0, 0], [0, 0, 1], extent=1.5)),
    ({"type": "mesh", "file": "a.stl"}, MeshSource(file="a.stl")),
    ({"type": "mesh", "file": "a.stl", "scale": 0.001}, MeshSource(file="a.stl", scale=0.001)),
    (
        {"type": "points", "radius": 0.01, "file": "a.ply", "voxel": 0.1, "viewpoint": True},
        PointSource(file="a.ply", radius=0.01, voxel=0.1, viewpoint=True),
    ),
]


@pytest.mark.parametrize(
    ("document", "shape"), WRITTEN, ids=lambda item: item.get("type", "") if isinstance(item, dict) else ""
)
def test_a_shape_is_read_and_written(document: dict[str, Any], shape: ObstacleShape) -> None:
    assert shape_of(document) == shape
    assert document_of(shape) == document
    assert list(document_of(shape)) == list(document)


def test_whole_numbers_are_lengths_too() -> None:
    assert shape_of({"type": "box", "size": [1, 2, 3]}) == Box((1.0, 2.0, 3.0))
    read = shape_of({"type": "points", "radius": 1, "file": "a.ply", "scale": 2, "viewpoint": False})
    assert isinstance(read, PointSource)
    assert [type(value) for value in (read.radius, read.scale, read.viewpoint)] == [float, float, bool]


def test_what_equals_the_default_is_not_written() -> None:
    assert document_of(shape_of({"type": "plane", "extent": 2.5})) == {"type": "plane"}
    assert document_of(shape_of({"type": "mesh", "file": "a.stl", "scale": 1})) == {
        "type": "mesh",
        "file": "a.stl",
    }


def test_the_schema_has_the_fields_of_the_classes() -> None:
    shape = json.loads(schema_text())["$defs"]["shape"]
    assert shape["properties"]["type"]["enum"] == [
        "sphere",
        "box",
        "cylinder",
        "capsule",
        "plane",
        "mesh",
        "points",
    ]
    rules = {rule["if"]["properties"]["type"]["const"]: rule["then"] for rule in shape["allOf"]}
    assert rules["cylinder"] == {
        "required": ["radius", "length"],
        "additionalProperties": False,
        "properties": {
            "type": {},
            "radius": {"$ref": "#/$defs/positive"},
            "length": {"$ref": "#/$defs/positive"},
        },
    }
    assert rules["box"]["properties"]["size"]["minItems"] == 3
    assert "required" not in rules["plane"]
    assert rules["plane"]["properties"]["extent"]["description"].startswith("Solid below z = 0")
