"""C++ as tokens, and its includes: enough for the structure of formatted code, without a compiler."""

import re
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

_TOKEN = re.compile(
    r"""(?P<skip>\s+|//[^\n]*|/\*.*?\*/)
      | (?P<directive>^[ \t]*\#(?:\\\n|[^\n])*)
      | (?P<text>(?:u8|[uUL])?R"(?P<mark>[^(\s]*)\(.*?\)(?P=mark)"|(?:u8|[uUL])?"(?:\\.|[^"\\\n])*")
      | (?P<number>\.?\d(?:'?[\w.]|(?<=[eEpP])[+-])*)
      | (?P<letter>'(?:\\.|[^'\\\n])+')
      | (?P<word>[A-Za-z_]\w*)
      | (?P<sign>::|->|&&|\|\||[<>=!+*/|&^%-]=|<<|[^\w\s])""",
    re.VERBOSE | re.DOTALL | re.MULTILINE,
)
_PAIRS = {"(": ")", "[": "]", "{": "}"}


class Token(NamedTuple):
    text: str
    line: int


def tokens(code: str) -> list[Token]:
    """Without comments and preprocessor lines; a literal text is one token."""
    result, line = [], 1
    for match in _TOKEN.finditer(code):
        if match.lastgroup not in ("skip", "directive"):
            result.append(Token(match[0], line))
        line += match[0].count("\n")
    return result


def includes(path: Path) -> list[str]:
    """What stands in the quotes of `#include "..."`."""
    return re.findall(r'^\s*#\s*include\s*"([^"]+)"', path.read_text(encoding="utf-8"), flags=re.MULTILINE)


def include_edges(folders: Sequence[Path]) -> dict[Path, set[Path]]:
    """Which file in `folders` includes which: a name means the file beside it, or one in a folder named `include`."""
    files = {
        path for folder in folders for path in folder.rglob("*") if path.suffix in (".hpp", ".cpp", ".inl")
    }
    roots = [folder for folder in folders if folder.name == "include"]
    return {
        path: {
            found
            for name in includes(path)
            for place in (path.parent, *roots)
            if (found := (place / name).resolve()) in files
        }
        for path in files
    }


def code_lines(path: Path) -> int:
    """Lines that are neither blank nor comment."""
    text = re.sub(
        r"""("(?:\\.|[^"\\\n])*"|'(?:\\.|[^'\\\n])+')|//[^\n]*|/\*.*?\*/""",
        lambda match: match[1] or "\n" * match[0].count("\n"),
        path.read_text(encoding="utf-8"),
        flags=re.DOTALL,
    )
    return sum(bool(line.strip()) for line in text.splitlines())


def closing(code: Sequence[Token], start: int) -> int:
    """Index of the bracket that closes the one at `start`."""
    waiting = []
    for index in range(start, len(code)):
        text = code[index].text
        if text in _PAIRS:
            waiting.append(_PAIRS[text])
        elif waiting and text == waiting[-1]:
            waiting.pop()
            if not waiting:
                return index
    raise ValueError(f"line {code[start].line}: {code[start].text} is not closed")


def head(code: Sequence[Token]) -> list[Token]:
    """A declaration without attributes, `alignas(...)`, the word `template`, and what stands in <...>."""
    result: list[Token] = []
    index = 0
    while index < len(code):
        token, end = code[index], None
        if token.text == "<" and not (result and result[-1].text == "operator"):
            end = _template_end(code, index)
        elif token.text == "[" and code[index + 1].text == "[":
            end = closing(code, index)
        elif (
            token.text in ("alignas", "decltype", "noexcept")
            and index + 1 < len(code)
            and code[index + 1].text == "("
        ):
            end = closing(code, index + 1)
        elif token.text == "template":
            end = index
        if end is None:
            result.append(token)
            index += 1
        else:
            index = end + 1
    return result


def _template_end(code: Sequence[Token], start: int) -> int | None:
    """Index of the `>` that closes; None where the `<` compares."""
    depth, index = 0, start
    while index < len(code):
        text = code[index].text
        if text in _PAIRS:
            index = closing(code, index)
        elif text in ("<", ">"):
            depth += 1 if text == "<" else -1
            if depth == 0:
                return index
        elif text in (";", "||"):
            return None
        index += 1
    return None
