"""Triangle meshes: read from files, made coarser, and as Coal takes them."""

from __future__ import annotations

import hashlib
import io
import json
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any
from urllib.parse import unquote

import numpy as np

from sidestep.shapes.collada_file import NOT_FINITE, shape_alone
from sidestep.shapes.mesh_file import fault_in, kind_in

if TYPE_CHECKING:  # they are imported where a mesh is made: they take longer to import than a robot to load
    import coal
    import trimesh

_AS_WRITTEN = ("glb", "gltf")  # formats of which trimesh leaves vertices apart that are written apart


class MeshFile:
    """A mesh file as it was when it was read: hash and triangles come from one read.

    Triangles are shared with each file of the same content, until 256 others have been read.

    Args:
        path: a file that trimesh reads (.stl, .obj, .dae, .ply, .glb …).
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        content = path.read_bytes()
        self.kind = kind_in(content, path.suffix)
        self._content: bytes | None = content
        self._buffers = _buffers(content, path.parent) if self.kind == "gltf" else {}
        self._mesh: trimesh.Trimesh | None = None
        digest = hashlib.sha256(content)
        for buffer in self._buffers.values():
            digest.update(buffer)
        #: Hash (64 hex digits) of the content, with that of the buffers beside it in glTF.
        self.digest = digest.hexdigest()

    def __eq__(self, other: object) -> bool:
        return isinstance(other, MeshFile) and (self.digest, self.kind) == (other.digest, other.kind)

    def __hash__(self) -> int:
        return hash((self.digest, self.kind))

    def triangles(self) -> trimesh.Trimesh:
        """The triangles in the file's coordinates; copy them before you change them. Raises as `read_mesh`."""
        if self._mesh is None:
            self._mesh = _shared(self)
        self._content = None  # not needed again
        return self._mesh

    def read(self) -> trimesh.Trimesh:
        """The triangles in the file's coordinates, anew. Raises as `read_mesh`."""
        content = self._content
        if content is None:
            assert self._mesh is not None  # it was read before the content was dropped
            return self._mesh.copy()
        return _read(self.path, content, self.kind, self._buffers)


@lru_cache(maxsize=256)  # by content
def _shared(file: MeshFile) -> trimesh.Trimesh:
    return file.read()


def _buffers(content: bytes, folder: Path) -> dict[str, bytes]:
    """The files beside a glTF that hold its vertices, by their names in it; those that are there."""
    try:
        names = [buffer.get("uri", "") for buffer in json.loads(content).get("buffers", ())]
        files = {name: folder / unquote(name) for name in names if name and not name.startswith("data:")}
    except (ValueError, AttributeError, TypeError):  # no glTF: the reader says so
        return {}
    return {name: file.read_bytes() for name, file in files.items() if file.is_file()}


def read_mesh(path: Path) -> trimesh.Trimesh:
    """The triangles of a file that trimesh reads (.stl, .obj, .dae, .ply, .glb …), in the file's coordinates.

    The format is that of the content, where it tells. COLLADA is read without its materials.

    Raises:
        ValueError: the file cannot be read as a mesh, holds no triangles, or has vertices that are not finite; says
            why.
    """
    return MeshFile(path).read()


def _read(path: Path, content: bytes, kind: str, buffers: dict[str, bytes]) -> trimesh.Trimesh:
    import trimesh

    fault = fault_in(content, path.suffix)
    if fault:
        raise ValueError(f"mesh file '{path}' {fault}")
    try:
        if kind == "dae":
            # a broken part raises: trimesh would leave it out
            scene = trimesh.load_scene(
                shape_alone(content), file_type="dae", ignore_broken=False, process=False
            )
        else:
            resolver: Any = buffers or trimesh.resolvers.FilePathResolver(str(path))
            scene = trimesh.load_scene(
                io.BytesIO(content), file_type=kind or None, resolver=resolver, process=False
            )
        parts = [part for part in scene.geometry.values() if isinstance(part, trimesh.Trimesh)]
        not_finite = [_not_finite(part) for part in parts]
        if not any(not_finite):
            for part in parts if kind not in _AS_WRITTEN else ():
                part.process()  # merges vertices; it would leave out triangles of such ones without a word
            mesh = scene.to_mesh()
            not_finite = [_not_finite(mesh)]
    except Exception as error:  # the readers behind trimesh raise anything; the user needs the file's name
        raise ValueError(f"mesh file '{path}' cannot be read: {error}") from error
    if any(not_finite):
        raise ValueError(
            f"mesh file '{path}' holds {NOT_FINITE}: {sum(not_finite)} of "
            f"{sum(len(part.vertices) for part in parts)}; its surface would have holes: export it again"
        )
    if not isinstance(mesh, trimesh.Trimesh) or len(mesh.faces) == 0:
        raise ValueError(f"mesh file '{path}' holds no triangles")
    return mesh


def _not_finite(mesh: trimesh.Trimesh) -> int:
    """How many vertices have a coordinate that is nan or inf."""
    return int(np.sum(~np.isfinite(np.asarray(mesh.vertices, dtype=float).reshape(-1, 3)).all(axis=1)))


def simplified(mesh: trimesh.Trimesh, cell: float) -> trimesh.Trimesh:
    """A coarser mesh: vertices in one cube of side `cell` [m] become their mean (Rossignac, Borrel, 1993)."""
    import trimesh

    keys = np.floor(mesh.vertices / cell).astype(np.int64)
    keys -= keys.min(axis=0)
    _, cluster = np.unique(np.ravel_multi_index(keys.T, keys.max(axis=0) + 1), return_inverse=True)
    counts = np.bincount(cluster)
    means = np.stack([np.bincount(cluster, mesh.vertices[:, k]) / counts for k in range(3)], axis=1)
    faces = cluster[mesh.faces]
    distinct = (faces[:, 0] != faces[:, 1]) & (faces[:, 1] != faces[:, 2]) & (faces[:, 2] != faces[:, 0])
    faces = faces[distinct]
    corners = np.sort(faces, axis=1).T
    _, first = np.unique(np.ravel_multi_index(corners, 3 * (len(means),)), return_index=True)
    return trimesh.Trimesh(means, faces[np.sort(first)], process=False)


def mesh_model(mesh: trimesh.Trimesh) -> coal.BVHModelOBBRSS:
    """The triangles of a mesh for Coal: hollow, exact."""
    import coal

    model = coal.BVHModelOBBRSS()
    model.beginModel(len(mesh.faces), len(mesh.vertices))
    model.addVertices(np.asarray(mesh.vertices, dtype=float))
    model.addTriangles(np.asarray(mesh.faces, dtype=np.int64))
    model.endModel()
    return model
