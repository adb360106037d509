"""Points of PLY files."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from sidestep.obstacles.cloud_array import Points, array_points
from sidestep.obstacles.cloud_header import read_header


def read_ply(path: Path) -> Points:
    """Vertices (N, 3) of a PLY file without faces, ASCII or binary of either byte order."""
    from trimesh.exchange.ply import load_ply

    num_vertices = _check_size(path)
    if num_vertices == 0:
        return np.zeros((0, 3))
    try:
        with path.open("rb") as stream:
            contents = load_ply(stream, fix_texture=False, skip_materials=True)
    except Exception as error:  # trimesh raises anything
        raise ValueError("its points do not fit its header; the file is damaged or cut short") from error
    faces = contents.get("faces")
    if faces is not None and len(faces):
        raise ValueError(
            f"it is a mesh of {len(faces)} faces, not a cloud; MeshShape(path) samples its surface"
        )
    points = array_points(contents.get("vertices"))
    if num_vertices != len(points):  # trimesh lets a short ASCII file pass
        raise ValueError(f"it announces {num_vertices} points and holds {len(points)}")
    return points


def _check_size(path: Path) -> int:
    """The number of vertices announced; refuses more than the file holds, before anything of that size is made.

    Every row of an element takes at least a byte for each property.
    """
    lines, begin = read_header(path, b"end_header")
    elements: list[tuple[str, int]] = []
    properties: list[list[str]] = []
    for words in lines:
        if words[:1] == ["element"]:
            if len(words) != 3 or not (words[2].isascii() and words[2].isdigit()):
                raise ValueError(f"its header says {' '.join(words)!r}; it must be: element NAME NUMBER")
            elements.append((words[1], int(words[2])))
            properties.append([])
        elif words[:1] == ["property"] and elements:
            properties[-1].append(words[-1])
    size = path.stat().st_size
    least = sum(number * max(1, len(held)) for (_, number), held in zip(elements, properties, strict=True))
    if least > size - begin + 1:  # the last line may end with the file
        name, number = max(elements, key=lambda element: element[1])
        raise ValueError(
            f"it announces {number} of element {name}, which is more than the {size} bytes of the file hold"
        )
    vertices = [index for index, (name, _) in enumerate(elements) if name == "vertex"]
    if len(vertices) != 1:
        raise ValueError(f"its elements are {', '.join(name for name, _ in elements)}; one must be vertex")
    held = properties[vertices[0]]
    if not {"x", "y", "z"} <= set(held):
        raise ValueError(f"its vertices have no x, y, z; they have {', '.join(held) or 'nothing'}")
    return elements[vertices[0]][1]
