"""An object of the scene in a MuJoCo model."""

from __future__ import annotations

import mujoco
import numpy as np
import trimesh

from sidestep.distance.scene import SceneObject
from sidestep.math.pose import pose_vector
from sidestep.simulation.contacts import ARM_BIT, SCENE_BIT

OBSTACLE_COLOUR = (0.80, 0.15, 0.13, 1.0)


def add_object(spec: mujoco.MjSpec, item: SceneObject, owners: dict[str, tuple[str, str]]) -> None:
    """Adds it as a body with one geom: that of its shape in MuJoCo, or else the hull of its triangles.

    Raises:
        ValueError: its triangles have no volume.
    """
    pose = pose_vector(item.pose)
    body = spec.worldbody.add_body(name=f"object:{item.name}", pos=pose[:3], quat=pose[3:])
    if item.motion == "free":
        body.add_freejoint()
        body.gravcomp = 1.0
    body.mocap = item.motion == "moving"
    name = f"object:{item.name}"
    kind, shape = "mesh", item.shape
    if shape.mujoco_factors:
        kind = shape.kind
    elif not add_mesh(spec, name, shape.surface()):
        raise ValueError(f"object {item.name!r}: its mesh is flat or empty, MuJoCo needs a volume")
    body.add_geom(
        name=name,
        type=getattr(mujoco.mjtGeom, f"mjGEOM_{kind.upper()}"),
        meshname=name if kind == "mesh" else "",
        size=shape.mujoco_size(),
        rgba=OBSTACLE_COLOUR,
        contype=SCENE_BIT,
        conaffinity=ARM_BIT,
        mass=item.mass,
    )
    owners[name] = ("object", item.name)


def add_mesh(spec: mujoco.MjSpec, name: str, mesh: trimesh.Trimesh) -> bool:
    """Adds a mesh asset; False for a flat or empty one, which has no hull to collide."""
    if len(mesh.faces) < 4 or np.linalg.matrix_rank(mesh.vertices - mesh.vertices[0], tol=1e-6) < 3:
        return False
    spec.add_mesh(
        name=name,
        uservert=np.asarray(mesh.vertices, dtype=float).ravel(),
        userface=np.asarray(mesh.faces, dtype=int).ravel(),
        inertia=mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL,
    )
    return True
