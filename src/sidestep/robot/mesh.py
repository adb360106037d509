"""Triangle meshes: read from files, made coarser, and as Coal takes them."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from sidestep.robot.collada_file import NOT_FINITE, shape_alone
from sidestep.robot.mesh_file import fault_of, kind_of

if TYPE_CHECKING:  # they are imported where a mesh is made: they take longer to import than a robot to load
    import coal
    import trimesh

_AS_WRITTEN = ("glb", "gltf")  # formats of which trimesh leaves vertices apart that are written apart


def read_mesh(path: Path) -> trimesh.Trimesh:
    """The triangles of a file that trimesh reads (.stl, .obj, .dae, .ply, .glb …), in the file's coordinates.

    The format is that of the content, where it tells. COLLADA is read without its materials.

    Raises:
        ValueError: the file cannot be read as a mesh, holds no triangles, or has vertices that are not finite; says
            why.
    """
    import trimesh

    fault = fault_of(path)
    if fault:
        raise ValueError(f"mesh file '{path}' {fault}")
    kind = kind_of(path)
    try:
        if kind == "dae":
            # a broken part raises: trimesh would leave it out
            scene = trimesh.load_scene(shape_alone(path), file_type="dae", ignore_broken=False, process=False)
        else:
            scene = trimesh.load_scene(path, file_type=kind or None, process=False)
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
