"""Classes, methods, functions and enums of C++ files: a reader of declarations, not of expressions."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

from cpp_tokens import Token, closing, head, tokens


@dataclass
class Method:
    """A member function as it is declared; `body` is None where it is defined elsewhere."""

    name: str
    has_parameters: bool
    is_const: bool
    is_static: bool
    body: list[str] | None


@dataclass
class Class:
    """A class with its data members and methods, without those of the classes inside it."""

    name: str
    bases: list[str] = field(default_factory=list)
    members: list[str] = field(default_factory=list)
    methods: list[Method] = field(default_factory=list)


@dataclass
class Function:
    """A function that is defined here; `lines` from its first to the closing bracket."""

    name: str
    lines: int
    body: list[str]


@dataclass
class File:
    """What is declared and defined in a file."""

    classes: list[Class] = field(default_factory=list)
    functions: list[Function] = field(default_factory=list)
    enums: list[str] = field(default_factory=list)


def read(path: Path) -> File:
    return read_text(path.read_text(encoding="utf-8"))


def read_text(code: str) -> File:
    reader = _Reader(tokens(code))
    reader.scope(0, len(reader.code), "", None)
    return reader.file


class _Reader:
    def __init__(self, code: list[Token]) -> None:
        self.code = code
        self.file = File()

    def scope(self, start: int, end: int, outer: str, owner: Class | None) -> None:
        """Reads the declarations of a namespace or, with `owner`, of a class."""
        index = start
        while index < end:
            index = self.declaration(index, end, outer, owner)

    def declaration(self, start: int, end: int, outer: str, owner: Class | None) -> int:
        """Reads one declaration; the index behind it."""
        index = start
        while index < end:
            text = self.code[index].text
            if text == ";":
                self.plain(self.code[start:index], owner)
                return index + 1
            if text in ("(", "["):
                index = closing(self.code, index) + 1
            elif (
                text == ":" and owner is not None and index == start + 1 and self.code[start].text in _ACCESS
            ):
                return index + 1
            elif text == "{":
                close = closing(self.code, index)
                words = [token.text for token in head(self.code[start:index])]
                if "namespace" in words or words[:1] == ["extern"]:
                    self.scope(index + 1, close, outer, None)
                    return close + 1
                if _is_type(words):
                    rest = self.type(start, index, close, outer)
                    if owner is not None and self.code[rest].text != ";":  # `struct Name {...} member;`
                        return self.declaration(rest, end, outer, owner)
                    return rest + 1
                if _has_parameters_list(words) and not _is_initializer(words):
                    self.function(start, index, close, words, outer, owner)
                    return (
                        close
                        + 1
                        + (self.code[close + 1 : close + 2] != [] and self.code[close + 1].text == ";")
                    )
                index = close + 1
            else:
                index += 1
        return end

    def type(self, start: int, opening: int, close: int, outer: str) -> int:
        """Reads a class or an enum; the index behind its closing bracket."""
        words = [token.text for token in head(self.code[start:opening])]
        first = next(i for i, word in enumerate(words) if word in _TYPES)
        names, bases = _split_bases(words[first:])
        name = "::".join(
            [
                *([outer] if outer else []),
                *(word for word in names if word not in _TYPE_WORDS and word != "::"),
            ]
        )
        if words[first] == "enum":
            self.file.enums.append(name)
        else:
            owner = Class(name, bases)
            self.file.classes.append(owner)
            self.scope(opening + 1, close, name, owner)
        return close + 1

    def function(
        self, start: int, opening: int, close: int, words: list[str], outer: str, owner: Class | None
    ) -> None:
        body = [token.text for token in self.code[opening + 1 : close]]
        name = _name_of(words)
        lines = self.code[close].line - self.code[start].line + 1
        self.file.functions.append(Function(f"{outer}::{name}" if owner is not None else name, lines, body))
        if owner is not None:
            self.method(words, owner, body)

    def plain(self, code: Sequence[Token], owner: Class | None) -> None:
        """A declaration that ends with a semicolon."""
        if owner is None:
            return
        declaration = head(code)
        words = [token.text for token in declaration]
        if not words or words[0] in _NO_MEMBER or (words[0] in _TYPES and len(words) <= 3):
            return
        if _has_parameters_list(words):
            self.method(words, owner, None)
        elif "static" not in words:
            owner.members += _declared(declaration)

    def method(self, words: list[str], owner: Class, body: list[str] | None) -> None:
        if words[0] == "friend":
            return
        name = _name_of(words)
        if "operator" in words or name in (owner.name.rsplit("::", 1)[-1], "~"):
            return
        opening = _parameters(words)
        close = _close(words, opening)
        if "delete" in words[close:]:
            return
        tail = words[close + 1 :]
        const = "const" in tail[: tail.index("->") if "->" in tail else len(tail)]
        owner.methods.append(Method(name, close > opening + 1, const, "static" in words, body))


def _is_type(words: list[str]) -> bool:
    """Whether that is the head of a class or an enum with a body."""
    first = next((i for i, word in enumerate(words) if word in _TYPES), None)
    return first is not None and "(" not in words and "=" not in words and words[0] != "friend"


def _split_bases(words: list[str]) -> tuple[list[str], list[str]]:
    if ":" not in words:
        return words, []
    colon = words.index(":")
    bases = [word for word in words[colon + 1 :] if word.isidentifier() and word not in (*_ACCESS, "virtual")]
    return words[:colon], bases


def _parameters(words: list[str]) -> int | None:
    """Index of the bracket that begins the parameters: behind a name, and before any `=`."""
    for index, word in enumerate(words):
        if word == "=" and "operator" not in words[:index]:
            return None
        if word == "(" and index > 0 and (words[index - 1].isidentifier() or "operator" in words[:index]):
            if words[index - 1] in ("explicit", "requires"):
                continue
            if words[index - 1] == "operator" and words[index + 1 : index + 2] == [")"]:
                continue  # operator()
            return index
    return None


def _has_parameters_list(words: list[str]) -> bool:
    return _parameters(words) is not None


def _close(words: list[str], opening: int | None) -> int:
    assert opening is not None
    return closing([Token(word, 0) for word in words], opening)


def _is_initializer(words: list[str]) -> bool:
    """Whether a `{` behind these words initialises a member in the list of a constructor."""
    tail = words[_close(words, _parameters(words)) + 1 :]
    return ":" in tail and tail[-1].isidentifier() and tail[-1] not in ("try",)


def _name_of(words: list[str]) -> str:
    index = _parameters(words)
    assert index is not None
    name = words[index - 1]
    if index > 1 and words[index - 2] == "~":
        return "~"
    while index > 2 and words[index - 2] == "::":
        index -= 2
        name = f"{words[index - 1]}::{name}"
    return name


def _declared(code: Sequence[Token]) -> list[str]:
    """The names in `int a = 0, b{1}, c[2];`."""
    names, last, index, initial = [], "", 0, False
    while index < len(code):
        text = code[index].text
        if text == ",":
            names.append(last)
            initial = False
        elif text in ("=", ":"):
            initial = True
        elif text in ("(", "[", "{"):
            index = closing(code, index)
            initial = initial or text == "{"
        elif not initial and text.isidentifier():
            last = text
        index += 1
    return [*names, last]


_ACCESS = ("public", "protected", "private")
_TYPES = ("class", "struct", "union", "enum")
_TYPE_WORDS = (*_TYPES, "final")
_NO_MEMBER = ("using", "typedef", "friend", "static_assert")
