"""The file behind a reference of a robot description: package://, model://, file:// and plain paths."""

from __future__ import annotations

import posixpath
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path, PureWindowsPath
from urllib.parse import unquote, urlparse

from sidestep.robot.packages import Packages

_DRIVE = re.compile(r"^/?[A-Za-z]:[\\/]")  # of an absolute path on Windows
_LEAST_TAIL = 2  # parts that a file found by the tail of its path shares with it: a folder and a name


@dataclass(frozen=True)
class Reference:
    """Where a reference leads: `path`, None where there is no such file.

    Args:
        path: the file. elsewhere: it was found by the tail of its path, not at the place that is written.
        failure: why there is none, with the folders searched.
    """

    path: Path | None
    elsewhere: bool = False
    failure: str = ""


def resolve(uri: str, owner: str, packages: Packages) -> Reference:
    """Looks up a reference.

    A package or model is looked up as PARENT/NAME, as a folder itself called NAME, and as a folder whose
    package.xml says NAME; first in `package_dirs`, then in the folders above the description. A relative path
    is looked up in the description's folder, then in `package_dirs`. A path that is not there, of another machine
    or relative to another folder, and one in a package that is not found, are looked up by their tail below the
    same folders and those above the description, the longest tail first.

    Raises:
        ValueError: another scheme, or a `package://` reference that leaves its package; begins with `owner`.
    """
    what = f"{owner} refers to {uri!r}"
    try:
        parsed = urlparse(uri)
    except ValueError as error:
        raise ValueError(f"{what}, which is no address: {error}") from error
    own_folder = packages.parents[:1]
    if parsed.scheme in ("package", "model"):
        name, rest = inside_package(unquote(parsed.netloc), unquote(parsed.path), what)
        candidates = [folder / rest for folder in packages.candidates(name)]
        searched: Sequence[Path] = packages.searched
        tails = [rest] if packages.find(name) is None else []
        advice = (
            "" if packages.find(name) is not None else f"; there is no package {name!r}: pass package_dirs"
        )
    elif "://" in uri and parsed.scheme != "file":
        raise ValueError(f"{what}; allowed: package://, model://, file:// and plain paths")
    else:
        written = unquote(parsed.netloc + parsed.path) if parsed.scheme == "file" else uri
        foreign = _DRIVE.match(written) is not None
        absolute = foreign or Path(written).is_absolute()
        written = written.replace("\\", "/") if foreign else written
        searched = () if absolute else (*own_folder, *packages.package_dirs)
        candidates = [] if foreign else [Path(written)] if absolute else [base / written for base in searched]
        tails = [re.sub(r"^/?[A-Za-z]:", "", written) if foreign else written]
        searched = packages.searched if absolute or len(_parts(written)) >= _LEAST_TAIL else searched
        advice = ""
    for candidate in candidates:
        if candidate.is_file():
            return Reference(candidate.resolve())
    for tail in tails:
        for candidate in _by_tail(tail, packages):
            if candidate.is_file():
                return Reference(candidate.resolve(), elsewhere=True)
    folders = ", ".join(str(base) for base in searched) or "no folder (pass package_dirs)"
    return Reference(None, failure=f"{what}, which does not exist; searched in: {folders}{advice}")


def inside_package(package: str, path: str, what: str) -> tuple[str, str]:
    """The name of a package and a path in it without `..`, whatever the path is written with.

    Raises:
        ValueError: they name a file outside; begins with `what`.
    """
    rest = posixpath.normpath(path.replace("\\", "/").lstrip("/"))
    leaves = rest.split("/")[0] == ".." or package in (".", "..") or any(mark in package for mark in "/\\")
    if leaves or "\0" in package + rest or PureWindowsPath(rest).drive:
        raise ValueError(f"{what}, which leaves the package; allowed: a file below package://NAME/")
    return package, rest


def _by_tail(path: str, packages: Packages) -> Iterator[Path]:
    """Places of a file that is not where it is written: the longest tail of its path first."""
    parts = _parts(path)
    for first in range(max(len(parts) - _LEAST_TAIL + 1, 0)):
        for base in packages.searched:
            yield base.joinpath(*parts[first:])


def _parts(path: str) -> list[str]:
    """Folders and name of a path, without steps upwards."""
    return [part for part in posixpath.normpath(path).split("/") if part not in ("", ".", "..")]
