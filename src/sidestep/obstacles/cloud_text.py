"""Points of text files, one a line."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path

import numpy as np

from sidestep.obstacles.cloud_array import Points, array_points, check_rows

COMMENTS = ("#", "//", "%")
AXES = (("x", "y", "z"), ("points:0", "points:1", "points:2"))  # the second: ParaView
ALLOWED = "allowed: x y z and more, between blanks, tabs, commas or semicolons"


def read_text(path: Path) -> Points:
    """Points (N, 3) of the lines: x, y, z first, or where a line above the first point names them.

    Lines above the first point may be titles or comments, or give the number of points. An empty cell is no number.
    """
    lines = path.read_text(encoding="utf-8-sig", errors="replace").splitlines()
    first, titles = _first_point(lines)
    body = lines[first:]
    mark = _separator(body[0])
    count = len(_cells(body[0], mark))
    columns = _columns(titles, count)
    if count <= max(columns):
        raise ValueError(f"line {first + 1} is {body[0][:80]!r}; {ALLOWED}")
    if mark == ";" and "," in body[0]:
        body = [line.replace(",", ".") for line in body]  # 0,5;1,5;2,5
    read = partial(_table, [line for line in body if line.strip()], mark, columns)
    try:
        try:
            points = read()
        except ValueError:
            if mark is None:
                raise
            points = read(converters=_number)  # slower; knows empty cells
    except ValueError as error:
        raise ValueError(fault_in(body, mark=mark, columns=columns, first=first + 1)) from error
    if _axes(titles) is None:
        check_rows((len(points), count))
    return array_points(points)


def fault_in(lines: Sequence[str], *, mark: str | None, columns: Sequence[int], first: int) -> str:
    """What is wrong with the first of some lines that is no point; the number of the first line is `first`."""
    for index, line in enumerate(lines):
        cells = _cells(line, mark)
        if not any(cells):
            continue
        where = f"line {first + index} is {line[:80]!r}"
        if len(cells) <= max(columns):
            return f"{where}, with {len(cells)} of the {max(columns) + 1} columns that are needed"
        for column in columns:
            if cells[column] and not _is_number(cells[column]):
                return f"{where}; {cells[column][:20]!r} is no number"
    return f"not every line is a point; {ALLOWED}"


def _table(
    body: Sequence[str],
    mark: str | None,
    columns: Sequence[int],
    *,
    converters: Callable[[str], float] | None = None,
) -> Points:
    quoted = any('"' in line for line in body)  # NumPy takes no quotes with several kinds of comments
    return np.loadtxt(
        body,
        delimiter=mark,
        usecols=columns,
        ndmin=2,
        comments=COMMENTS[0] if quoted else COMMENTS,
        quotechar='"' if quoted else None,
        converters=converters,
    )


def _number(cell: str) -> float:
    return float(cell) if cell.strip() else float("nan")


def _first_point(lines: Sequence[str]) -> tuple[int, list[str]]:
    """Index of the first line of numbers, and the cells of the last line of titles above it."""
    titles: list[str] = []
    unread: list[int] = []
    for index, line in enumerate(lines):
        comment = line.lstrip().startswith(COMMENTS)
        bare = line.strip().lstrip("#/%").strip() if comment else line
        cells = _cells(bare, _separator(bare))
        if not comment and _is_point(cells, _axes(titles) or [0, 1, 2], titled=bool(titles)):
            alone = len(cells) == 1 and cells[0].isdigit() and index + 1 < len(lines)
            if not alone:  # else the number of points, as .pts and .xyz may begin
                return index, titles
        elif any(cells):
            names = [_title(cell) for cell in cells]
            if not comment or _axes(names) is not None:
                titles = names
            if not comment and _axes(names) is None:
                unread.append(index)
    if unread:
        raise ValueError(f"line {unread[0] + 1} is {lines[unread[0]][:80]!r}; {ALLOWED}")
    raise ValueError("it holds no point")


def _is_point(cells: Sequence[str], columns: Sequence[int], *, titled: bool) -> bool:
    """Whether a line holds numbers where points have their coordinates, or empty cells below titles."""
    held = [cells[column].replace(",", ".") for column in columns if column < len(cells)]
    if not any(held):
        return titled and len(cells) > max(columns)
    numbers = sum(_is_number(cell) for cell in held)
    if 1 < numbers < len([cell for cell in held if cell]):
        raise ValueError(f"{' '.join(cells)[:80]!r} is neither titles nor a point; {ALLOWED}")
    return numbers > 0 and all(not cell or _is_number(cell) for cell in held)


def _is_number(cell: str) -> bool:
    try:
        float(cell)
    except ValueError:
        return False
    return True


def _columns(titles: Sequence[str], count: int) -> list[int]:
    found = _axes(titles)
    if found is None and count > 3 and len(titles) == count:
        raise ValueError(f"its columns are {', '.join(titles)}, none of them x, y and z")
    return found or [0, 1, 2]


def _axes(titles: Sequence[str]) -> list[int] | None:
    for axes in AXES:
        if set(axes) <= set(titles):
            return [list(titles).index(axis) for axis in axes]
    return None


def _title(cell: str) -> str:
    """A column's name, without a unit: "X [m]" and "x(m)" are "x"."""
    return cell.lower().split("[")[0].split("(")[0].strip()


def _separator(line: str) -> str | None:
    """Between the numbers of a line; None for blanks."""
    for comment in COMMENTS:
        line = line.split(comment)[0]
    for mark in ";,":
        if mark in line:
            return mark
    return "\t" if "\t" in line and all(cell.strip() for cell in line.strip().split("\t")) else None


def _cells(line: str, mark: str | None) -> list[str]:
    for comment in COMMENTS:
        line = line.split(comment)[0]
    return [cell.strip().strip('"') for cell in line.split(mark)]
