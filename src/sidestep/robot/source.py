"""Where a robot description comes from: URDF text, xacro macros, and the files it refers to."""

from __future__ import annotations

import codecs
import contextlib
import io
import re
import sys
import tempfile
import types
import warnings
import xml.etree.ElementTree as ElementTree
import xml.parsers.expat as expat
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import TypeAlias, TypeGuard

import numpy as np

from sidestep.robot.formats import macros_alone, other_root, refuse_content
from sidestep.robot.packages import Packages

_XACRO_MARKS = ("ros.org/wiki/xacro", "ros.org/xacro")  # namespaces that xacro documents declare
_SUBSTITUTION = re.compile(r"\$\((?:find|arg|env|optenv|dirname|eval)\b[^)]*\)")
_EXPRESSION = re.compile(r"\$\{[^}]*\}")
_ARGUMENT = re.compile(r"""<xacro:arg\s[^>]*?\bname\s*=\s*["']([^"']+)""")
_CONDITIONAL_INCLUDE = re.compile(
    r"<xacro:(if|unless)\b(?:(?!</xacro:\1>).)*?<xacro:include\b", re.DOTALL
)  # one that may not have been read
_AGAIN = 10  # times that xacro includes a file before it gives up, if that includes itself
XacroValue: TypeAlias = str | float | bool


@dataclass(frozen=True)
class Description:
    """The XML tree of a robot description and the packages its file references are looked up in."""

    root: ElementTree.Element
    label: str  # what errors call the description: its path, or "URDF string"
    packages: Packages


def is_text(source: str | Path) -> TypeGuard[str]:
    """Whether a source is a description's text itself, not a path: it starts with `<`."""
    return isinstance(source, str) and source.lstrip().startswith("<")


def read_description(
    source: str | Path,
    *,
    package_dirs: Sequence[str | Path],
    xacro_arguments: Mapping[str, XacroValue] | None,
) -> Description:
    """Reads a URDF or xacro file, or a string that starts with `<`, and expands xacro where the text uses it.

    Raises:
        FileNotFoundError: no such file. ValueError: malformed XML, a failed xacro expansion, an argument that the
            file does not have.
    """
    directories = tuple(Path(directory).resolve() for directory in package_dirs)
    for directory in directories:
        if not directory.is_dir():
            raise FileNotFoundError(f"package_dirs: {directory} is not a folder")
    folder: Path | None = None
    if is_text(source):
        label, text = "URDF string", source.lstrip()
    else:
        path = Path(source).resolve()
        if not path.is_file():
            raise FileNotFoundError(f"robot description {path} does not exist or is not a file")
        refuse_content(path)
        label, text, folder = str(path), read_xml(path), path.parent
    packages = Packages(directories, folder)
    root = parse_xml(text, label)
    if _uses_xacro(root, text, label):
        macros = [
            (element.get("name", ""), element.get("params", ""))
            for element in root.iter()
            if isinstance(element.tag, str) and element.tag.endswith("}macro")
        ]
        root = parse_xml(_expand(text, label, folder, packages, _as_text(xacro_arguments or {})), label)
        if macros and root.find("link") is None:
            raise ValueError(macros_alone(label, macros))
    elif xacro_arguments:
        raise ValueError(f"{label} uses no xacro, but xacro_arguments are given: {sorted(xacro_arguments)}")
    return Description(root, label, packages)


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
        root = _tree(text)
    except (ElementTree.ParseError, ValueError) as error:  # ValueError: characters that no encoding has
        raise ValueError(f"{label} is not well-formed XML: {error}") from error
    if root.tag != "robot":
        raise ValueError(f"{label}: the root element is <{root.tag}>, must be <robot>{other_root(root.tag)}")
    return root


def _tree(text: str) -> ElementTree.Element:
    """The tree of XML text; of prefixes that nothing declares, such as <drake:joint>, tags and keys have the name.

    One of xacro is an error, since its elements would count as nothing.
    """
    try:
        return ElementTree.fromstring(text)
    except ElementTree.ParseError as error:
        if error.code != expat.errors.codes[expat.errors.XML_ERROR_UNBOUND_PREFIX] or "<xacro:" in text:
            raise
    builder = ElementTree.TreeBuilder()
    parser = expat.ParserCreate()
    parser.StartElementHandler = builder.start
    parser.EndElementHandler = builder.end
    parser.CharacterDataHandler = builder.data
    try:
        parser.Parse(text, True)
    except expat.ExpatError as error:
        raise ElementTree.ParseError(str(error)) from error
    return builder.close()


def _uses_xacro(root: ElementTree.Element, text: str, label: str) -> bool:
    """Whether elements of xacro, or its substitutions such as `$(find NAME)`, are in a description.

    A namespace that is declared and not used does not show. Expressions `${…}` in attributes count where the
    namespace is declared or the file is called .xacro: elsewhere they may be meant for another program.
    """
    xacro = label.lower().endswith(".xacro") or any(mark in text for mark in _XACRO_MARKS)
    for element in root.iter():
        if not isinstance(element.tag, str):  # a comment
            continue
        if any(mark in element.tag for mark in _XACRO_MARKS):
            return True
        if any(_SUBSTITUTION.search(value) for value in (*element.attrib.values(), element.text or "")):
            return True
        if xacro and any(_EXPRESSION.search(value) for value in element.attrib.values()):
            return True
    return False


def _as_text(arguments: Mapping[str, XacroValue]) -> dict[str, str]:
    """Values of `<xacro:arg>` as xacro takes them: text, true and false in lower case."""
    texts = {}
    for name, value in arguments.items():
        if isinstance(value, bool | np.bool_):
            texts[name] = "true" if value else "false"
        elif isinstance(value, str | int | float | np.integer | np.floating):
            texts[name] = str(value)
        else:
            raise ValueError(
                f"xacro_arguments: {name!r} is {value!r}, must be a text, a number, True or False"
            )
    return texts


class _Arguments(dict[str, str]):
    """The values of arguments, which note what xacro asks for."""

    def __init__(self, values: Mapping[str, str]) -> None:
        super().__init__(values)
        self.asked: set[str] = set()

    def __contains__(self, name: object) -> bool:
        self.asked.add(str(name))
        return super().__contains__(name)

    def __getitem__(self, name: str) -> str:
        self.asked.add(name)
        return super().__getitem__(name)


def _expand(text: str, label: str, folder: Path | None, packages: Packages, arguments: dict[str, str]) -> str:
    import xacro

    messages = io.StringIO()  # xacro prints its warnings; they go into the error, or nowhere
    known = _Arguments(arguments)
    already = len(xacro.all_includes)
    with tempfile.TemporaryDirectory() as temporary:
        path = Path(label)
        if folder is None:
            path = Path(temporary) / "robot.xacro"
            path.write_text(text, encoding="utf-8")
        try:
            with contextlib.redirect_stderr(messages), _findable(packages, text, label):
                expanded = str(xacro.process_file(str(path), mappings=known).toxml())
        except Exception as error:  # xacro evaluates expressions, so any exception can come out of it
            detail = f"{error} {messages.getvalue()}".strip()
            if isinstance(error, RecursionError):
                detail = _endless(xacro.all_includes[already:]) or detail
            raise ValueError(f"{label}: xacro expansion failed: {type(error).__name__}: {detail}") from error
    _check_arguments(arguments, known.asked, label, [text, *_texts(xacro.all_includes[already:])])
    return expanded


def _endless(included: Sequence[str]) -> str:
    """Which file includes itself, "" if none does."""
    name, count = Counter(included).most_common(1)[0] if included else ("", 0)
    return f"{name} is included in itself, by <xacro:include>" if count > _AGAIN else ""


def _texts(files: Sequence[str]) -> list[str]:
    return [Path(file).read_text("utf-8", "replace") for file in set(files) if Path(file).is_file()]


def _check_arguments(given: Mapping[str, str], asked: set[str], label: str, texts: Sequence[str]) -> None:
    """Refuses arguments that no file of a description has; warns where a file that was not read may have them."""
    names = asked.union(*(_ARGUMENT.findall(text) for text in texts))
    unknown = [name for name in given if name not in names]
    if not unknown:
        return
    said = (
        f"{label}: xacro_arguments has {', '.join(map(repr, unknown))}, which no <xacro:arg> defines; "
        f"those of the file are: {', '.join(sorted(names)) or 'none'}"
    )
    if not any(_CONDITIONAL_INCLUDE.search(text) for text in texts):
        raise ValueError(said)
    warnings.warn(
        f"{said}; files that are included on a condition may have more", RuntimeWarning, stacklevel=5
    )


@contextlib.contextmanager
def _findable(packages: Packages, text: str, label: str) -> Iterator[None]:
    """Answers xacro's `$(find NAME)`, which asks ROS's ament index, from the same folders as `package://`.

    Of a package that is not found, a folder above the description that has the file counts, with a warning.
    """
    name = "ament_index_python.packages"

    def get_package_share_directory(package: str) -> str:
        folder = packages.find(package) or _standing_in(package)
        if folder is not None:
            return str(folder)
        searched = ", ".join(str(base) for base in packages.searched) or "no folder (pass package_dirs)"
        raise FileNotFoundError(f"$(find {package}): no such package; searched in: {searched}")

    @cache
    def _standing_in(package: str) -> Path | None:
        for rest in re.findall(rf"\$\(find\s+{re.escape(package)}\s*\)/*([^\s\"'<>$]+)", text):
            for base in packages.parents:
                if "/" in rest and (base / rest).is_file():
                    warnings.warn(
                        f"{label}: there is no package {package!r}; {base} is taken for it, which has {rest}; "
                        "check that it is the right one",
                        RuntimeWarning,
                        stacklevel=2,
                    )
                    return base
        return None

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
