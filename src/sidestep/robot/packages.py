"""ROS packages among the folders of a description: by the folder's name, or by <name> in package.xml."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from functools import cached_property
from pathlib import Path

_NAME = re.compile(rb"<name>\s*([^<\s]+)\s*</name>")
_DEPTH = 2  # folders below one of `package_dirs` that are looked through: workspace/repository/package
_MOST_FOLDERS = 2000  # looked through in one folder: a workspace has hundreds


class Packages:
    """Finds packages in `package_dirs` first, then in the folders above a description.

    Args:
        package_dirs: folders that hold packages, or are one.
        folder: of the description; None for a text.
    """

    def __init__(self, package_dirs: Sequence[Path], folder: Path | None) -> None:
        self.package_dirs = tuple(package_dirs)
        self.parents = () if folder is None else (folder, *folder.parents)

    @property
    def searched(self) -> tuple[Path, ...]:
        """The folders that are searched, in order."""
        return (*self.package_dirs, *self.parents)

    def candidates(self, name: str) -> Iterator[Path]:
        """Folders that may be the package called `name`, likeliest first."""
        for base in self.searched:
            if base.name == name:
                yield base
            yield base / name
        yield from self._declared.get(name, ())

    def find(self, name: str) -> Path | None:
        """The first folder that is the package called `name`, None if there is none."""
        return next((folder for folder in self.candidates(name) if folder.is_dir()), None)

    @cached_property
    def _declared(self) -> dict[str, list[Path]]:
        """Folders by the name that their package.xml declares."""
        found: dict[str, list[Path]] = {}
        for folder in self._with_manifest():
            name = _declared_name(folder)
            if name and folder not in found.setdefault(name, []):
                found[name].append(folder)
        return found

    def _with_manifest(self) -> Iterator[Path]:
        for base in self.package_dirs:
            yield from _manifests(base, _DEPTH)
        own = next((parent for parent in self.parents if (parent / "package.xml").is_file()), None)
        yield from (parent for parent in self.parents if (parent / "package.xml").is_file())
        if own is not None:  # packages beside the description's own: those of its repository and workspace
            yield from _manifests(own.parent, 1)


def _manifests(base: Path, depth: int) -> Iterator[Path]:
    """Folders with a package.xml from `base` down; a package holds no other."""
    if (base / "package.xml").is_file():
        yield base
        return
    if depth == 0:
        return
    try:
        below = sorted(path for path in base.iterdir() if path.is_dir() and not path.name.startswith("."))
    except OSError:  # a folder that may not be read holds no package for us
        return
    for path in below[:_MOST_FOLDERS]:
        yield from _manifests(path, depth - 1)


def _declared_name(folder: Path) -> str:
    try:
        match = _NAME.search((folder / "package.xml").read_bytes())
    except OSError:
        return ""
    return "" if match is None else match[1].decode("utf-8", errors="replace")
