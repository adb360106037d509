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


def stored_or_fitted(
    robot: Robot, settings: FitSettings | CoverSettings, fit: Callable[[], body_file.BodyContents]
) -> body_file.BodyContents:
    """The stored fit; without one what `fit` gives, which is stored."""
    return stored_or_made(
        cache_path(robot, settings),
        lambda path: body_file.read(path, robot),
        fit,
        body_file.write,
        ("body is unreadable and is fitted again", "the fitted body is not cached"),
    )


def stored_or_made(
    path: Path,
    read: Callable[[Path], Contents],
    make: Callable[[], Contents],
    write: Callable[[Path, Contents], None],
    warning: tuple[str, str],
) -> Contents:
    """What `read` finds in the user's file; without one what `make` gives, which `write` puts there.

    Warns, by the first text, about a file that `read` refuses by an OSError, ValueError or TypeError, and by the second
    about an OSError of `write`: what is not cached is still of use.
    """
    try:
        return read(path)
    except FileNotFoundError:
        pass
    except (ValueError, TypeError, OSError) as error:
        warnings.warn(f"the cached {warning[0]}: {path}: {error}", RuntimeWarning, stacklevel=4)
    made = make()
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        write(path, made)
    except OSError as error:
        warnings.warn(f"{warning[1]}: {error}", RuntimeWarning, stacklevel=4)
    return made
