"""A robot from whatever names one: a file, its text, or a name."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from sidestep.robot.catalogue import recipe
from sidestep.robot.descriptions import described
from sidestep.robot.model import Robot
from sidestep.robot.source import is_text

OF_NAMES = ("locked", "locked_beyond_limits")  # what `Robot.named` takes


def is_name(source: str | Path) -> bool:
    """Whether this is the name of a robot, not a path or a text."""
    if is_text(source):
        return False
    path = Path(source)
    return not (path.suffix or len(path.parts) != 1 or path.is_file())


def robot_from(source: str | Path, options: Mapping[str, Any]) -> Robot:
    """The robot of a description file or its text, or of a name that `Robot.named` knows.

    Args:
        source: a path, the text, or a name. options: of `Robot.from_urdf`; of a robot of `sidestep.robots()` `locked`
            and `locked_beyond_limits` alone.

    Raises:
        FileNotFoundError, ValueError: as `Robot.from_urdf` and `Robot.named`, or an option that does not suit a name.
    """
    if not is_name(source):
        return Robot.from_urdf(source, **options)
    name = str(source)
    if (file := described(name)) is not None:
        return Robot.from_urdf(file.path, **{"name": name, "package_dirs": file.package_dirs, **options})
    recipe(name)  # raises, with the known names
    refuse_options(options, OF_NAMES, f"robot {name!r}, which has its own")
    return Robot.named(name, **options)


def refuse_options(given: Sequence[str] | Mapping[str, Any], known: Sequence[str], of: str) -> None:
    """Raises ValueError that names an option that is not known, and those that are."""
    for option in given:
        if option not in known:
            allowed = f"; allowed: {', '.join(known)}" if known else ""
            raise ValueError(f"{option} cannot be given for {of}{allowed}")
