"""Mesh and texture files of an MJCF that cannot be used: visual ones are left out, others are named."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sidestep.shapes.mesh_file import fault_of
from sidestep.shapes.mesh_reader import read_mesh

if TYPE_CHECKING:  # imported where it is used: URDF needs no MuJoCo
    import mujoco

_ABSENT = "does not exist"
_READ = (".stl", ".obj")  # suffixes of meshes that MuJoCo reads, and we
_LISTED = 3  # files in the remark


@dataclass(frozen=True, eq=False)
class LeftOut:
    """What was left out of a model.

    Attributes:
        files: as they are written, with what is wrong. bodies: that had a mesh among them. lighter: whether the mass
            of such a body came from its shapes.
    """

    files: Sequence[str] = ()
    bodies: Sequence[Any] = ()
    lighter: bool = False

    def remark(self) -> str:
        """The sentence of a warning."""
        more = f" and {len(self.files) - _LISTED} more" if len(self.files) > _LISTED else ""
        shown = "; collision shapes are shown in place of the meshes" if self.bodies else ""
        mass = "; masses that come from the shapes lack theirs" if self.lighter else ""
        return f"visual files that cannot be used are left out: {', '.join(self.files[:_LISTED])}{more}{shown}{mass}"


def leave_out_unusable(spec: mujoco.MjSpec, label: str, refusal: str) -> LeftOut:
    """Takes visual meshes and textures whose files cannot be used out of a model that MuJoCo refuses.

    Args:
        spec: not compiled yet. label: of the file, for errors. refusal: what MuJoCo said.

    Raises:
        FileNotFoundError, ValueError: a mesh that is a collision shape cannot be used; names every one.
    """
    import mujoco

    folder = Path(spec.modelfiledir)
    files, bodies, errors, absent = [], [], [], False
    lighter = False
    look = "opening file" in refusal  # else it has found all files, perhaps where we do not know
    for mesh in list(spec.meshes):
        path = folder / spec.meshdir / mesh.file
        fault = _fault(path, look) if mesh.file else ""
        if not fault:
            continue
        geoms = [geom for geom in spec.geoms if geom.meshname == (mesh.name or Path(mesh.file).stem)]
        needed = sorted({geom.parent.name for geom in geoms if not _is_spare(geom)})
        if needed:
            absent = absent or fault == _ABSENT
            errors.append(
                f"{label}: body {', '.join(map(repr, needed))} refers to {mesh.file!r}, which {fault}"
                + (f"; looked for at {path.resolve()}" if fault == _ABSENT else f" ({path.resolve()})")
            )
            continue
        files.append(f"{mesh.file!r} ({fault.partition('; ')[0]})")
        bodies += [geom.parent for geom in geoms]
        lighter = lighter or any(not geom.parent.explicitinertial and geom.mass != 0.0 for geom in geoms)
        for item in (*geoms, mesh):
            spec.delete(item)
    if errors:
        raise (FileNotFoundError if absent else ValueError)("\n".join(errors))
    for texture in spec.textures if look else ():
        written = [name for name in (texture.file, *texture.cubefiles) if name]
        gone = [name for name in written if not (folder / spec.texturedir / name).is_file()]
        if gone:
            files += [f"{name!r} ({_ABSENT})" for name in gone]
            texture.builtin = mujoco.mjtBuiltin.mjBUILTIN_FLAT  # which comes before files
            texture.width = texture.height = 1
    return LeftOut(files, bodies, lighter)


def _fault(path: Path, look: bool) -> str:
    if not path.is_file():
        return _ABSENT if look else ""
    fault = fault_of(path)
    if not fault and path.suffix.lower() in _READ:
        try:
            read_mesh(path)
        except ValueError as error:
            return f"cannot be used: {error}"
    return fault


def _is_spare(geom: Any) -> bool:
    """Whether a shape is drawn alone, on a body that has collision shapes."""

    def collides(shape: Any) -> bool:
        return bool(shape.contype or shape.conaffinity)

    return not collides(geom) and any(collides(other) for other in geom.parent.geoms)
