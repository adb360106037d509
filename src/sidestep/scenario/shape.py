"""Shapes as scenario files write them: solids by their lengths, meshes and point clouds by their files."""

from __future__ import annotations

from dataclasses import MISSING, dataclass, fields
from typing import Any, ClassVar, TypeAlias

from sidestep.shapes import KINDS, Shape


@dataclass(frozen=True, kw_only=True)
class MeshSource:
    """A mesh file and the scale that makes its coordinates metres."""

    kind: ClassVar[str] = "mesh"

    file: str
    scale: float = 1.0


@dataclass(frozen=True, kw_only=True)
class PointSource:
    """A point file, see `load_point_cloud`; lengths in metres."""

    kind: ClassVar[str] = "points"

    radius: float
    file: str
    scale: float = 1.0
    voxel: float | None = None
    viewpoint: bool = False


ObstacleShape: TypeAlias = Shape | MeshSource | PointSource
_SOURCES: dict[str, Any] = {source.kind: source for source in (MeshSource, PointSource)}


def shape_of(document: dict[str, Any]) -> ObstacleShape:
    """The shape of a checked document."""
    kind, given = document["type"], {key: value for key, value in document.items() if key != "type"}
    if kind in _SOURCES:
        read: MeshSource | PointSource = _SOURCES[kind](
            **{key: float(value) if type(value) is int else value for key, value in given.items()}
        )
        return read
    row: list[float] = []
    for entry in KINDS[kind].length_fields():
        value: Any = given.get(entry.name, entry.default)
        row += map(float, value if entry.number > 1 else [value])
    return KINDS[kind].of_lengths(row)


def document_of(shape: ObstacleShape) -> dict[str, Any]:
    """The reverse of `shape_of`, without what equals the default."""
    plain: dict[str, Any] = {"type": shape.kind}
    if isinstance(shape, Shape):
        defaults = [(name, default) for name, _, _, default in shape.length_fields()]
    else:
        defaults = [
            (field.name, None if field.default is MISSING else field.default) for field in fields(shape)
        ]
    for name, default in defaults:
        value = getattr(shape, name)
        if value != default:
            plain[name] = list(value) if isinstance(value, tuple) else value
    return plain


def shape_schema(sources: dict[str, Any]) -> dict[str, Any]:
    """The JSON schema of a shape: of solids by the fields of their classes, of files as `sources` has it."""
    solids = [name for name in KINDS if name not in _SOURCES]
    return {
        **sources,
        "properties": {"type": {"enum": [*solids, *_SOURCES]}},
        "allOf": [*map(_rule, solids), *sources["allOf"]],
    }


def _rule(kind: str) -> dict[str, Any]:
    lengths = KINDS[kind].length_fields()
    positive = {"$ref": "#/$defs/positive"}
    properties: dict[str, Any] = {"type": {}}
    for name, number, about, _ in lengths:
        value = positive if number == 1 else {
            "type": "array", "items": positive, "minItems": number, "maxItems": number
        }  # fmt: skip
        properties[name] = {**value, **({"description": about} if about else {})}
    required = [name for name, _, _, default in lengths if default is None]
    return {
        "if": {"properties": {"type": {"const": kind}}, "required": ["type"]},
        "then": {
            **({"required": required} if required else {}),
            "additionalProperties": False,
            "properties": properties,
        },
    }
