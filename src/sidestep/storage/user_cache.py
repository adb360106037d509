"""The user's cache: what takes seconds to make, found by the content it was made from."""

from __future__ import annotations

import json
import os
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

import platformdirs

from sidestep.storage.whole_file import write_text

Contents = TypeVar("Contents")

CACHE_VARIABLE = "SIDESTEP_CACHE_DIR"


def cache_root() -> Path:
    """The user's cache: $SIDESTEP_CACHE_DIR, or `sidestep` in the cache directory of the user."""
    override = os.environ.get(CACHE_VARIABLE)
    return Path(override) if override else platformdirs.user_cache_path("sidestep")


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
            write_text(self.path(key), json.dumps(document) + "\n")
        except OSError as error:
            self._writes = False
            warnings.warn(f"{self._what} is not cached: {error}", RuntimeWarning, stacklevel=3)


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
