"""What a file is that is no URDF, and how to make a URDF or MJCF of it."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from sidestep.shapes.mesh_file import LFS_POINTER

_FROM_CAD = (
    "it holds shapes without joints; export URDF from the CAD program (Onshape: onshape-to-robot, SolidWorks: "
    "sw_urdf_exporter, Fusion: fusion2urdf)"
)
_FROM_MESH = (
    "it holds a shape without joints; write a URDF whose links refer to it: "
    '<collision><geometry><mesh filename="…"/></geometry></collision>'
)
_FROM_USD = "export URDF from the program that wrote it (Isaac Sim: the URDF exporter)"
_SDF = (
    "convert it to URDF, for example by sdf2urdf.py of pysdf (https://github.com/andreasbihlmaier/pysdf) or "
    "sdformat_urdf of ROS 2; many robots of Gazebo also come as URDF or xacro"
)

_ROOTS = {  # root elements of XML files
    "sdf": ("SDF, Gazebo's format", _SDF),
    "gazebo": ("SDF, Gazebo's format", _SDF),
    "COLLADA": ("a COLLADA mesh", _FROM_MESH),
    "mujocoinclude": ("a part of an MJCF", "load the file that includes it, whose root element is <mujoco>"),
    "srdf": ("SRDF", "it says which links may touch; load the URDF that it belongs to"),
}
_BEGINNINGS = (  # of files that are not XML
    (b"ISO-10303-21", "a STEP file", _FROM_CAD),
    (b"#usda", "a USD file", _FROM_USD),
    (b"PXR-USDC", "a USD file", _FROM_USD),
    (b"solid", "an STL mesh", _FROM_MESH),
    (b"glTF", "a glTF mesh", _FROM_MESH),
    (b"ply", "a PLY mesh", _FROM_MESH),
    (b"#VRML", "a VRML or Webots file", "in Webots: right-click the robot, Export URDF"),
)
_SUFFIXES = {
    **dict.fromkeys((".step", ".stp", ".iges", ".igs", ".sldasm", ".sldprt"), ("a CAD file", _FROM_CAD)),
    **dict.fromkeys((".stl", ".obj", ".ply", ".glb", ".gltf"), ("a mesh", _FROM_MESH)),
    **dict.fromkeys((".usd", ".usda", ".usdc", ".usdz"), ("a USD file", _FROM_USD)),
}


def refuse_content(path: Path) -> None:
    """Raises ValueError for a file that is no XML, with what it is and how to convert it."""
    with path.open("rb") as file:
        head = file.read(256)
    if head.startswith(LFS_POINTER):
        raise ValueError(
            f"{path} is a Git LFS pointer, not the file itself; run `git lfs pull` in its repository"
        )
    if not head.strip():
        raise ValueError(f"{path} is empty; a URDF begins with <robot>")
    begins = head.removeprefix(b"\xef\xbb\xbf").lstrip()
    if begins.startswith((b"<", b"\xff\xfe", b"\xfe\xff")):  # XML, also in UTF-16
        return
    found = next(((what, advice) for mark, what, advice in _BEGINNINGS if begins.startswith(mark)), None)
    found = found or _SUFFIXES.get(path.suffix.lower())
    if found is not None:
        raise ValueError(f"{path} is {found[0]}, not URDF: {found[1]}")


def other_root(tag: str) -> str:
    """What an error about a root element adds: what the file is, and how to convert it; "" if that is not known."""
    found = _ROOTS.get(tag)
    return "" if found is None else f"; it is {found[0]}: {found[1]}"


def macros_alone(label: str, macros: Sequence[tuple[str, str]]) -> str:
    """The error about a xacro file that defines macros (name, params) and calls none."""
    name, params = macros[0]
    arguments = "".join(f' {key.split(":=")[0].lstrip("*")}="…"' for key in params.split() if "*" not in key)
    file = Path(label).name if label != "URDF string" else "FILE.xacro"
    return (
        f"{label} has no link: it defines the xacro macros {', '.join(known for known, _ in macros)} and calls none. "
        f'Load a file that does: <robot name="…" xmlns:xacro="http://www.ros.org/wiki/xacro">'
        f'<xacro:include filename="{file}"/><xacro:{name}{arguments}/></robot>'
    )
