"""A hash of what a fitted body depends on."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from sidestep import _core
from sidestep.robot.link import Link

if TYPE_CHECKING:
    import trimesh

_HASH_DECIMALS = 9  # lengths [m] and angles are hashed to 1e-9: below any mesh's accuracy, above rounding


def fingerprint_of(robot: _core.Robot, links: Sequence[Link]) -> str:
    """Hash (64 hex digits) of kinematics and geometry, as `Robot.fingerprint`; `links` in the order of the frames."""
    digest = hashlib.sha256()

    def add(*items: object) -> None:
        for item in items:
            if isinstance(item, np.ndarray):
                item = (np.round(item, _HASH_DECIMALS) + 0.0).tolist()  # + 0.0 makes -0.0 into 0.0
            digest.update(repr(item).encode() + b"\n")

    base = np.linalg.inv(robot.frames[0].placement)
    for joint in robot.joints:
        placement = base @ joint.placement if joint.parent < 0 else joint.placement
        add("joint", joint.name, joint.type.name, joint.parent, placement, joint.axis, joint.coordinate)
        add(joint.multiplier, joint.offset)
    for frame, link in zip(robot.frames, links, strict=True):
        add(
            "link",
            frame.name,
            frame.joint,
            base @ frame.placement if frame.joint < 0 else frame.placement,
        )
        for geometry in link.geometries:
            add(geometry.kind, geometry.placement, geometry.size, geometry.scale)
            if geometry.sweeps:
                add(*geometry.sweeps)
            if geometry.path is not None:
                add(geometry.file.digest)
    return digest.hexdigest()


def surface_hash(mesh: trimesh.Trimesh) -> str:
    """Hash (64 hex digits) of the triangles of a mesh, bit for bit, wherever they were read from."""
    digest = hashlib.sha256(np.ascontiguousarray(mesh.vertices, dtype=np.float64).tobytes())
    digest.update(np.ascontiguousarray(mesh.faces, dtype=np.int64).tobytes())
    return digest.hexdigest()
