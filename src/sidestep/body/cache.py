"""Fitted bodies kept in the user's cache, found by the content they were fitted from."""

from __future__ import annotations

import hashlib
import json
import os
import warnings
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

import platformdirs

from sidestep.body import file as body_file
from sidestep.body.cover import ALGORITHM_VERSION, CoverSettings
from sidestep.body.fitting import FitSettings

if TYPE_CHECKING:
    from sidestep.robot import Robot

CACHE_VARIABLE = "SIDESTEP_CACHE_DIR"
SHIPPED = Path(__file__).parent / "covers"  # made by benchmarks/ship_covers.py, under the names of the cache


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
    """The stored fit, the user's or one that comes with Sidestep, or None if there is none.

    Warns about an entry that cannot be read.
    """
    path = cache_path(robot, settings)
    for stored in (path, SHIPPED / path.name):
        try:
            return body_file.read(stored, robot)
        except FileNotFoundError:
            continue
        except (ValueError, OSError) as error:
            warnings.warn(
                f"cached body is unreadable and is fitted again: {error}", RuntimeWarning, stacklevel=3
            )
            return None
    return None


def write(robot: Robot, settings: FitSettings | CoverSettings, contents: body_file.BodyContents) -> None:
    """Stores a fit; warns if the cache cannot be written, because a fit without a cache is still a fit."""
    path = cache_path(robot, settings)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        body_file.write(path, contents)
    except OSError as error:
        warnings.warn(f"the fitted body is not cached: {error}", RuntimeWarning, stacklevel=3)
