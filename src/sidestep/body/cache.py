"""Fitted bodies kept in the user's cache, found by the content they were fitted from."""

from __future__ import annotations

import hashlib
import json
import os
import warnings
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import platformdirs

from sidestep.body import file as body_file
from sidestep.body.cover import ALGORITHM_VERSION, CoverSettings
from sidestep.body.fitting import FitSettings

if TYPE_CHECKING:
    from collections.abc import Callable

    from sidestep.robot import Robot

Contents = TypeVar("Contents")

CACHE_VARIABLE = "SIDESTEP_CACHE_DIR"
CACHE_VERSION = (
    2  # up to 0.2.0 a mesh written anew could leave the body of the old one under the new one's hash
)


def cache_root() -> Path:
    """The user's cache: $SIDESTEP_CACHE_DIR, or `sidestep` in the cache directory of the user."""
    override = os.environ.get(CACHE_VARIABLE)
    return Path(override) if override else platformdirs.user_cache_path("sidestep")


def cache_directory() -> Path:
    """Where fitted bodies are kept: `bodies` in the user's cache."""
    return cache_root() / "bodies"


class ContentStore:
    """Small JSON documents in a folder of the user's cache, each found by a hash of what it was made from.

    Entries are written in one piece, so that programs may share the folder. What cannot be read is made again, and what
    cannot be written is not kept: each with a warning, the latter once.

    Args:
        folder: within the cache. what: the documents hold, for warnings. enabled: whether anything is found and kept.
    """

    def __init__(self, folder: str, what: str, *, enabled: bool = True) -> None:
        self._folder, self._what = cache_root() / folder, what
        self._reads = self._writes = enabled

    def path(self, key: str) -> Path:
        """The file of an entry."""
        return self._folder / f"{key}.json"

    def get(self, key: str, parse: Callable[[Any], Contents]) -> Contents | None:
        """What `parse` makes of an entry; None without one, or where it does not suit."""
        if not self._reads:
            return None
        try:
            return parse(json.loads(self.path(key).read_text(encoding="utf-8")))
        except (FileNotFoundError, NotADirectoryError):
            return None
        except (ValueError, TypeError, LookupError, AttributeError, OSError) as error:
            warnings.warn(
                f"{self._what} in the cache is unreadable and is made again: {self.path(key)}: {error!r}",
                RuntimeWarning,
                stacklevel=3,
            )
            return None

    def put(self, key: str, document: object) -> None:
        """Keeps an entry."""
        if not self._writes:
            return
        try:
            self._folder.mkdir(parents=True, exist_ok=True)
            body_file.write_text(self.path(key), json.dumps(document) + "\n")
        except OSError as error:
            self._writes = False
            warnings.warn(f"{self._what} is not cached: {error}", RuntimeWarning, stacklevel=3)


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
