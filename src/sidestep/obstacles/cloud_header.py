"""Text headers of PLY and PCD files."""

from __future__ import annotations

from pathlib import Path

MAX_HEADER = 65_536  # bytes


def read_header(path: Path, end: bytes) -> tuple[list[list[str]], int]:
    """The words of each line of a header up to one that begins with `end`, and the number of bytes it takes."""
    with path.open("rb") as stream:
        start = stream.read(MAX_HEADER)
    lines: list[list[str]] = []
    offset = 0
    for line in start.splitlines(keepends=True):
        offset += len(line)
        lines.append(line.decode("utf-8", errors="replace").split())
        if line.strip().startswith(end):
            return lines, offset
    raise ValueError(f"its header has no line {end.decode()} within {MAX_HEADER} bytes")
