"""Mesh files as bytes: what is wrong with one, what it holds, and how large it is, without reading its triangles."""

from __future__ import annotations

import contextlib
import mmap
import re
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

LFS_POINTER = b"version https://git-lfs"  # begins what stands for a file that Git LFS has not fetched
_STL_HEADER = 84  # bytes: 80 of text, 4 of the number of triangles
_STL_TRIANGLE = 50  # bytes
_TAIL = 4096  # bytes at an end of a file, in which its header or last element is looked for
_MOST_TEXT = 2_000_000  # bytes of a text file whose vertices are read for its size: a tenth of a second
_OBJ_VERTEX = re.compile(rb"^v[ \t]+(\S+)[ \t]+(\S+)[ \t]+(\S+)", re.MULTILINE)
_OBJ_FACE = re.compile(rb"^\s*f[ \t]", re.MULTILINE)
_PLY_FACES = re.compile(rb"^element[ \t]+face[ \t]+(\d+)", re.MULTILINE)
_STL_VERTEX = re.compile(rb"\bvertex\s+(\S+)\s+(\S+)\s+(\S+)")
_COLLADA_END = re.compile(rb"</(?:\w+:)?COLLADA\s*>")


Content: TypeAlias = bytes | mmap.mmap  # of a file


def fault_of(path: Path) -> str:
    """What is wrong with a mesh file, "" if nothing is seen; looks at its size, beginning and end."""
    with _mapped(path) as content:
        return fault_in(content, path.suffix)


def extents_of(path: Path) -> NDArray[np.float64] | None:
    """The edges (3,) of the box around a mesh, in the file's unit; None where that takes reading it as a mesh."""
    with _mapped(path) as content:
        return _extents_in(content, path.suffix)


@contextlib.contextmanager
def _mapped(path: Path) -> Iterator[Content]:
    """The content of a file, of which only what is looked at is read."""
    with path.open("rb") as file:
        if path.stat().st_size == 0:  # which cannot be mapped
            yield b""
            return
        with mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as content:
            yield content


def fault_in(content: Content, suffix: str) -> str:
    """What is wrong with the content of a mesh file, "" if nothing is seen; `suffix` of the file's name."""
    size = len(content)
    if size == 0:
        return "is empty (0 bytes)"
    head, tail = content[:_STL_HEADER], content[max(size - _TAIL, 0) :]
    if head.startswith(LFS_POINTER):
        return "is a Git LFS pointer, not the mesh; run `git lfs pull` in its repository"
    kind = kind_in(content, suffix)
    if kind == "stl" and _is_binary_stl(content):
        count = int.from_bytes(head[80:84], "little")
        if count == 0:
            return "holds no triangles: its header says 0"
        if size < _STL_HEADER + _STL_TRIANGLE * count:
            there = max(size - _STL_HEADER, 0) // _STL_TRIANGLE
            return f"is truncated: its header says {count} triangles, {there} are there"
    elif kind == "stl":
        if size > _TAIL or b"facet" in tail:
            return "" if b"endsolid" in tail else "is truncated: it has no endsolid"
        return "holds no triangles" if b"endsolid" in tail else "is truncated: it ends in its header"
    elif kind == "dae" and _COLLADA_END.search(tail) is None:
        return "is truncated: it does not end with </COLLADA>"
    elif kind == "obj" and size <= _MOST_TEXT and _OBJ_FACE.search(content) is None:
        return "holds no triangles"
    elif kind == "ply" and (faces := _PLY_FACES.search(content[:_TAIL])) is not None and int(faces[1]) == 0:
        return "holds no triangles: its header says 0"
    elif kind == "glb" and len(head) >= 12 and size < int.from_bytes(head[8:12], "little"):
        return f"is truncated: its header says {int.from_bytes(head[8:12], 'little')} bytes, {size} are there"
    return ""


def kind_in(content: Content, suffix: str) -> str:
    """The format of a mesh file, as the suffix of its name would be: by content where it tells, else by name."""
    head = content[:1024]
    suffix = suffix.lower().lstrip(".")
    if head.startswith(b"glTF"):
        return "glb"
    if head.startswith((b"ply\n", b"ply\r")):
        return "ply"
    if b"<COLLADA" in head:
        return "dae"
    if suffix == "stl":
        return "stl"
    if head.lstrip().startswith(b"solid") and b"facet" in head:
        return "stl"
    whole = _STL_HEADER + _STL_TRIANGLE * int.from_bytes(head[80:84], "little")
    if len(head) >= _STL_HEADER and len(content) == whole:
        return "stl"
    return suffix


def _extents_in(content: Content, suffix: str) -> NDArray[np.float64] | None:
    kind = kind_in(content, suffix)
    if kind == "obj" or (kind == "stl" and not _is_binary_stl(content)):
        if len(content) > _MOST_TEXT:
            return None
        return _size((_OBJ_VERTEX if kind == "obj" else _STL_VERTEX).findall(content))
    if kind != "stl":
        return None
    count = max(len(content) - _STL_HEADER, 0) // _STL_TRIANGLE
    rows = np.ndarray((count, _STL_TRIANGLE), np.uint8, content, offset=_STL_HEADER if count else 0)
    corners = np.ascontiguousarray(rows[:, 12:48]).view("<f4").reshape(-1, 3)
    del rows  # a map is not closed while an array looks at it
    return _size(corners)


def _size(corners: NDArray[np.float32] | Sequence[tuple[bytes, ...]]) -> NDArray[np.float64] | None:
    """Edges (3,) of the box around corners (N, 3); None where they are no finite numbers."""
    try:
        array = np.asarray(corners, dtype=np.float64)
    except ValueError:
        return None
    if not len(array) or not np.isfinite(array).all():
        return None
    return np.asarray(array.max(axis=0) - array.min(axis=0), dtype=np.float64)


def _is_binary_stl(content: Content) -> bool:
    """Whether an STL is not text: many binary ones begin with "solid" as text does."""
    head = content[:1024]
    if not head.lstrip().startswith(b"solid"):
        return True
    size = len(content)
    if len(head) >= _STL_HEADER and size == _STL_HEADER + _STL_TRIANGLE * int.from_bytes(
        head[80:84], "little"
    ):
        return True
    return re.search(rb"[^\t\n\v\f\r -\xff]", head) is not None
