"""Fitted bodies kept in the user's cache, found by the content they were fitted from."""

from __future__ import annotations

import hashlib
import json
import os
import warnings
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

import platformdirs

from sidestep.body import file as body_file
from sidestep.body.cover import ALGORITHM_VERSION, CoverSettings
from sidestep.body.fitting import FitSettings

if TYPE_CHECKING:
    from collections.abc import Callable

    from sidestep.robot import Robot

Contents = TypeVar("Contents")

CACHE_VARIABLE = "SIDESTEP_CACHE_DIR"


def cache_directory() -> Path:
    """Where fitted bodies are kept: $SIDESTEP_CACHE_DIR/bodies, or the user's cache directory."""
    override = os.environ.get(CACHE_VARIABLE)
    root = Path(override) if override else platformdirs.user_cache_path("sidestep")
    return root / "bodies"


def cache_path(robot: Robot, settings: FitSettings | CoverSettings) -> Path:
    """The file of one fit; its name is a hash of the robot's content, the settings and the file format."""
    content = {
        "fingerprint": robot.fingerprint,
        "name": robot.name,
        "method": type(settings).__name__,
        "settings": asdict(settings),
        "format_version": body_file.FORMAT_VERSION,
    }
    if isinstance(settings, CoverSettings):
        content["algorithm_version"] = ALGORITHM_VERSION
    key = hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()
    return cache_directory() / f"{key}.json"


def read(robot: Robot, settings: FitSettings | CoverSettings) -> body_file.BodyContents | None:
    """The stored fit, or None if there is none; warns about an entry that cannot be read."""
    return read_stored(
        cache_path(robot, settings),
        lambda stored: body_file.read(stored, robot),
        "cached body is unreadable and is fitted again",
    )


def write(robot: Robot, settings: FitSettings | CoverSettings, contents: body_file.BodyContents) -> None:
    """Stores a fit; warns if the cache cannot be written, because a fit without a cache is still a fit."""
    write_stored(
        cache_path(robot, settings),
        lambda path: body_file.write(path, contents),
        "the fitted body is not cached",
    )


def read_stored(path: Path, reader: Callable[[Path], Contents], warning: str) -> Contents | None:
    """What `reader` makes of the user's file; None without one.

    A file that `reader` refuses by an OSError, ValueError or TypeError gives `warning` and None.
    """
    try:
        return reader(path)
    except FileNotFoundError:
        pass
    except (ValueError, TypeError, OSError) as error:
        warnings.warn(f"{warning}: {path}: {error}", RuntimeWarning, stacklevel=4)
    return None


def write_stored(path: Path, writer: Callable[[Path], None], warning: str) -> None:
    """Has `writer` write the user's file; an OSError gives `warning`."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        writer(path)
    except OSError as error:
        warnings.warn(f"{warning}: {error}", RuntimeWarning, stacklevel=4)
