"""Shapes of an MJCF, as MuJoCo compiles them."""

from __future__ import annotations

import contextlib
import hashlib
import re
import tempfile
from collections.abc import Iterable
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from sidestep.math.pose import from_quaternion, pose_at
from sidestep.robot.link import Array, Geometry
from sidestep.shapes import KINDS
from sidestep.storage.user_cache import cache_root
from sidestep.storage.whole_file import write_bytes

if TYPE_CHECKING:  # imported where it is used: URDF needs no MuJoCo
    import mujoco

_SUBDIVISIONS = 4  # of an ellipsoid's icosahedron, as of a sphere's
_TRIANGLE = np.dtype(
    [("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")]
)  # of binary STL


def shapes_of(
    model: mujoco.MjModel, geoms: Iterable[int]
) -> tuple[list[Geometry], list[Geometry], list[str]]:
    """The shapes of a body that can collide, the others, and the kinds of those without volume (plane, hfield).

    A geom can collide if its contype or conaffinity is not zero. Some shapes become several, see `Shape.parts`.
    """
    collisions: list[Geometry] = []
    visuals: list[Geometry] = []
    without_volume = []
    for geom in geoms:
        shapes = _shapes(model, geom)
        if not shapes:
            without_volume.append(_kind(model, geom))
        collides = bool(model.geom_contype[geom]) or bool(model.geom_conaffinity[geom])
        (collisions if collides else visuals).extend(shapes)
    return collisions, visuals, without_volume


def _kind(model: mujoco.MjModel, geom: int) -> str:
    import mujoco

    return str(mujoco.mjtGeom(int(model.geom_type[geom])).name).removeprefix("mjGEOM_").lower()


def _shapes(model: mujoco.MjModel, geom: int) -> list[Geometry]:
    quaternion = np.array(model.geom_quat[geom], dtype=float)
    X = pose_at(model.geom_pos[geom], from_quaternion(quaternion / np.linalg.norm(quaternion)))
    match name := _kind(model, geom):
        case "ellipsoid":
            return [
                Geometry("mesh", X, path=_unit_sphere(), scale=np.array(model.geom_size[geom], dtype=float))
            ]
        case "mesh" | "sdf":
            return [Geometry("mesh", X, path=_mesh_file(model, int(model.geom_dataid[geom])))]
    kind = KINDS.get(name)
    if kind is None or not kind.bounded:
        return []
    shape = kind.of_mujoco(model.geom_size[geom].tolist())
    return [Geometry(part.kind, X @ X_part, size=part.lengths) for part, X_part in shape.parts()]


def _mesh_file(model: mujoco.MjModel, mesh: int) -> Path:
    """A mesh as MuJoCo holds it, scaled and in its own frame, which `geom_pos` and `geom_quat` place."""
    first, count = int(model.mesh_vertadr[mesh]), int(model.mesh_vertnum[mesh])
    at, faces = int(model.mesh_faceadr[mesh]), int(model.mesh_facenum[mesh])
    vertices = np.asarray(model.mesh_vert[first : first + count], dtype=float)
    return _stored(vertices, model.mesh_face[at : at + faces], str(model.mesh(mesh).name) or f"mesh{mesh}")


def _unit_sphere() -> Path:
    return _stored(*_unit_sphere_surface(), "unit_sphere")  # again where the cache was emptied


@cache
def _unit_sphere_surface() -> tuple[Array, npt.NDArray[np.integer]]:
    import trimesh

    ball = trimesh.creation.icosphere(subdivisions=_SUBDIVISIONS)
    return np.asarray(ball.vertices), np.asarray(ball.faces)


def _stored(vertices: Array, faces: npt.NDArray[np.integer], name: str) -> Path:
    """A binary STL in the user's cache, or in a folder of this process where that cannot be written."""
    triangles = np.zeros(len(faces), dtype=_TRIANGLE)
    triangles["corners"] = vertices[faces]
    content = bytes(80) + np.uint32(len(faces)).tobytes() + triangles.tobytes()
    digest = hashlib.sha256(content).hexdigest()[:16]
    file = f"{re.sub(r'[^A-Za-z0-9_.-]', '_', name)[:60]}-{digest}.stl"
    with contextlib.suppress(OSError):
        return _written(cache_root() / "meshes" / file, content)
    return _written(_own_folder() / file, content)


def _written(path: Path, content: bytes) -> Path:
    if not path.is_file() or path.stat().st_size != len(content):
        path.parent.mkdir(parents=True, exist_ok=True)
        write_bytes(path, content)
    return path


@cache
def _own_folder() -> Path:
    return Path(tempfile.mkdtemp(prefix="sidestep-meshes-"))
