"""A robot from a file that somebody brings: a description, or an archive of one with its meshes."""

from __future__ import annotations

from pathlib import Path

from sidestep.scenario import Scenario
from sidestep.scenario.scenario import RobotConfig
from sidestep.studio.archive import unpack
from sidestep.studio.start import scenario_of

SUFFIXES = (".urdf", ".xacro", ".xml", ".mjcf")
MOST_UNPACKED = 2**29  # bytes: meshes of an arm are some 10 MB
ROOTS = (b"<robot", b"<mujoco")  # how a description begins, after comments


def scenario_of_upload(name: str, content: bytes, place: Path) -> Scenario:
    """A scenario of the robot in a file, which is written, or unpacked, into the folder `place`.

    Raises:
        ValueError, FileNotFoundError: it is no description or archive of one; or what is wrong with the description.
    """
    suffix = Path(name).suffix.lower()
    if suffix == ".zip":
        unpack(name, content, place, most=MOST_UNPACKED)
        file = _description(name, place)
    elif suffix in SUFFIXES:
        file = place / Path(name).name
        file.write_bytes(content)
    else:
        raise ValueError(f"{name}: allowed are {', '.join((*SUFFIXES, '.zip'))}")
    return scenario_of(RobotConfig(urdf=str(file), package_dirs=() if _is_mjcf(file) else (str(place),)))


def _description(name: str, place: Path) -> Path:
    """The one description in a folder; of several the one nearest to its top, if it is alone there."""
    found = [
        path
        for path in sorted(place.rglob("*"))
        if path.suffix.lower() in SUFFIXES and any(root in path.read_bytes() for root in ROOTS)
    ]
    if not found:
        raise ValueError(f"{name} holds no robot description; allowed: {', '.join(SUFFIXES)}")
    top = min(len(path.parts) for path in found)
    nearest = [path for path in found if len(path.parts) == top]
    if len(nearest) > 1:
        names = ", ".join(path.name for path in nearest)
        raise ValueError(
            f"{name} holds several robot descriptions: {names}; leave one, or put it above the others"
        )
    return nearest[0]


def _is_mjcf(file: Path) -> bool:
    return b"<mujoco" in file.read_bytes()
