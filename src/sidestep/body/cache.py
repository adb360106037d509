"""Fitted bodies kept in the user's cache, found by the content they were fitted from."""

from __future__ import annotations

import hashlib
import json
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

from sidestep.body import file as body_file
from sidestep.body.cover_settings import ALGORITHM_VERSION, CoverSettings
from sidestep.body.fitting import FitSettings
from sidestep.storage.user_cache import cache_root, stored_or_made

if TYPE_CHECKING:
    from collections.abc import Callable

    from sidestep.robot import Robot

CACHE_VERSION = (
    2  # up to 0.2.0 a mesh written anew could leave the body of the old one under the new one's hash
)


def cache_directory() -> Path:
    """Where fitted bodies are kept: `bodies` in the user's cache."""
    return cache_root() / "bodies"


def cache_path(robot: Robot, settings: FitSettings | CoverSettings) -> Path:
    """The file of one fit; its name is a hash of the robot's content, the settings and the file format."""
    content = {
        "fingerprint": robot.fingerprint,
        "name": robot.name,
        "method": type(settings).__name__,
        "settings": asdict(settings),
        "format_version": body_file.FORMAT_VERSION,
        "cache_version": CACHE_VERSION,
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
