"""Where a robot description comes from: URDF text, xacro macros, and the files it refers to."""

from __future__ import annotations

import codecs
import contextlib
import io
import posixpath
import re
import sys
import tempfile
import types
import xml.etree.ElementTree as ElementTree
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path, PureWindowsPath
from urllib.parse import unquote, urlparse

_XACRO_MARKS = ("ros.org/wiki/xacro", "ros.org/xacro")  # namespaces that xacro documents declare


@dataclass(frozen=True)
class Description:
    """The XML tree of a robot description and the folders its file references are looked up in."""

    root: ElementTree.Element
    label: str  # what errors call the description: its path, or "URDF string"
    folder: Path | None  # of the URDF file, None for a string
    package_dirs: tuple[Path, ...]

    def resolve(self, uri: str, owner: str) -> Path:
        """The file behind `package://NAME/REST`, `file://PATH` or a plain path.

        A package is looked up as PARENT/NAME and as a folder itself called NAME, first in `package_dirs`,
        then in the folders above the URDF; a relative path in the URDF's folder, then in `package_dirs`.

        Raises:
            FileNotFoundError: names `owner`, the reference and the folders searched.
            ValueError: another scheme, or a `package://` reference that leaves its package.
        """
        try:
            parsed = urlparse(uri)
        except ValueError as error:
            raise ValueError(f"{owner} refers to {uri!r}, which is no address: {error}") from error
        parents = () if self.folder is None else (self.folder, *self.folder.parents)
        if parsed.scheme == "package":
            package, rest = _inside_package(
                unquote(parsed.netloc), unquote(parsed.path), f"{owner} refers to {uri!r}"
            )
            searched = [*self.package_dirs, *parents]
            candidates = [
                path
                for base in searched
                for path in ([base / rest] if base.name == package else []) + [base / package / rest]
            ]
        elif parsed.scheme == "file":
            searched, candidates = [], [Path(unquote(parsed.path))]
        elif "://" in uri:
            raise ValueError(f"{owner} refers to {uri!r}; allowed: package://, file:// and plain paths")
        else:
            searched = [*parents[:1], *self.package_dirs]
            candidates = [Path(uri)] if Path(uri).is_absolute() else [base / uri for base in searched]
        for candidate in candidates:
            if candidate.is_file():
                return candidate.resolve()
        folders = ", ".join(str(base) for base in searched) or "no folder (pass package_dirs)"
        raise FileNotFoundError(f"{owner} refers to {uri!r}, which does not exist; searched in: {folders}")


def _inside_package(package: str, path: str, what: str) -> tuple[str, str]:
    """The name of a package and a path in it without `..`, whatever the path is written with.

    Raises:
        ValueError: they name a file outside; begins with `what`.
    """
    rest = posixpath.normpath(path.replace("\\", "/").lstrip("/"))
    leaves = rest.split("/")[0] == ".." or package in (".", "..") or any(mark in package for mark in "/\\")
    if leaves or "\0" in package + rest or PureWindowsPath(rest).drive:
        raise ValueError(f"{what}, which leaves the package; allowed: a file below package://NAME/")
    return package, rest


def read_description(
    source: str | Path, *, package_dirs: Sequence[str | Path], xacro_arguments: Mapping[str, str] | None
) -> Description:
    """Reads a URDF or xacro file, or a string that starts with `<`, and expands xacro where the text uses it.

    Raises:
        FileNotFoundError: no such file. ValueError: malformed XML, a failed xacro expansion.
    """
    directories = tuple(Path(directory).resolve() for directory in package_dirs)
    for directory in directories:
        if not directory.is_dir():
            raise FileNotFoundError(f"package_dirs: {directory} is not a folder")
    folder: Path | None = None
    if isinstance(source, str) and source.lstrip().startswith("<"):
        label, text = "URDF string", source.lstrip()
    else:
        path = Path(source).resolve()
        if not path.is_file():
            raise FileNotFoundError(f"robot description {path} does not exist or is not a file")
        label, text, folder = str(path), read_xml(path), path.parent
    root = parse_xml(text, label)
    if any(mark in tag for mark in _XACRO_MARKS for tag in _qualified_names(root)):
        root = parse_xml(_expand(text, label, folder, directories, dict(xacro_arguments or {})), label)
    elif xacro_arguments:
        raise ValueError(f"{label} uses no xacro, but xacro_arguments are given: {sorted(xacro_arguments)}")
    return Description(root, label, folder, directories)


def read_xml(path: Path) -> str:
    """The text of an XML file, in the encoding of its byte order mark or declaration, UTF-8 without either.

    Raises:
        ValueError: names the file, the encoding and what is allowed.
    """
    content = path.read_bytes()
    marks = {codecs.BOM_UTF8: "utf-8-sig", codecs.BOM_UTF16_LE: "utf-16", codecs.BOM_UTF16_BE: "utf-16"}
    encoding = next((name for mark, name in marks.items() if content.startswith(mark)), "utf-8")
    declared = re.match(rb"""\s*<\?xml\s[^>]*?encoding\s*=\s*["']([^"'>]*)""", content)
    if declared is not None and encoding == "utf-8":
        encoding = declared[1].decode("latin-1")
    try:
        return content.decode(encoding).lstrip()
    except UnicodeDecodeError as error:
        raise ValueError(
            f"{path} is not {encoding} text (byte {error.start}: {error.reason}); allowed: UTF-8, or another "
            f"encoding that the file declares"
        ) from error
    except (LookupError, ValueError) as error:
        raise ValueError(
            f"{path} declares the encoding {encoding!r}, which is unknown; allowed: UTF-8, UTF-16, ISO-8859-1, "
            "or another text encoding that Python knows"
        ) from error


def parse_xml(text: str, label: str) -> ElementTree.Element:
    """The root of a robot description; an encoding that the text declares was that of its file and is not applied.

    Raises:
        ValueError: not XML, or another root than `<robot>`; begins with `label`.
    """
    try:
        root = ElementTree.fromstring(text)
    except (ElementTree.ParseError, ValueError) as error:  # ValueError: characters that no encoding has
        raise ValueError(f"{label} is not well-formed XML: {error}") from error
    if root.tag != "robot":
        raise ValueError(f"{label}: the root element is <{root.tag}>, must be <robot>")
    return root


def _qualified_names(root: ElementTree.Element) -> Iterator[str]:
    """Names of elements, the namespace in braces in front; a declared but unused namespace does not show."""
    return (element.tag for element in root.iter() if isinstance(element.tag, str))


def _expand(
    text: str, label: str, folder: Path | None, package_dirs: tuple[Path, ...], arguments: dict[str, str]
) -> str:
    import xacro

    messages = io.StringIO()  # xacro prints its warnings; they go into the error, or nowhere
    with tempfile.TemporaryDirectory() as temporary:
        path = Path(label)
        if folder is None:
            path = Path(temporary) / "robot.xacro"
            path.write_text(text, encoding="utf-8")
        try:
            with contextlib.redirect_stderr(messages), _findable_packages(package_dirs, folder):
                return str(xacro.process_file(str(path), mappings=arguments).toxml())
        except Exception as error:  # xacro evaluates expressions, so any exception can come out of it
            detail = f"{error} {messages.getvalue()}".strip()
            raise ValueError(f"{label}: xacro expansion failed: {type(error).__name__}: {detail}") from error


@contextlib.contextmanager
def _findable_packages(package_dirs: tuple[Path, ...], folder: Path | None) -> Iterator[None]:
    """Answers xacro's `$(find NAME)`, which asks ROS's ament index, from the same folders as `package://`."""
    name = "ament_index_python.packages"
    parents = () if folder is None else (folder, *folder.parents)

    def get_package_share_directory(package: str) -> str:
        for base in (*package_dirs, *parents):
            for candidate in (base, base / package):
                if candidate.name == package and candidate.is_dir():
                    return str(candidate)
        searched = (
            ", ".join(str(base) for base in (*package_dirs, *parents)) or "no folder (pass package_dirs)"
        )
        raise FileNotFoundError(f"$(find {package}): no such package; searched in: {searched}")

    stand_in = types.ModuleType(name)
    stand_in.get_package_share_directory = get_package_share_directory  # type: ignore[attr-defined]
    parent = types.ModuleType("ament_index_python")
    parent.packages = stand_in  # type: ignore[attr-defined]
    saved = {key: sys.modules.get(key) for key in ("ament_index_python", name)}
    sys.modules.update({"ament_index_python": parent, name: stand_in})
    try:
        yield
    finally:
        for key, module in saved.items():
            if module is None:
                del sys.modules[key]
            else:
                sys.modules[key] = module
