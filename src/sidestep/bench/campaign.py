"""Campaigns: many tasks over processes, shards and interruptions, one line of JSON for each that is done."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from sidestep import __version__
from sidestep.bench.parallel import Progress, Worker, run_tasks

Row = dict[str, Any]


def run_campaign(
    make: Callable[[], Worker[Any, Row]],
    tasks: Sequence[Any],
    *,
    name: Callable[[Any], str],
    settings: Row,
    file: Path | None = None,
    shard: tuple[int, int] = (1, 1),
    jobs: int = 1,
    progress: Progress | None = None,
) -> list[Row]:
    """The rows of all tasks of a shard, in order; those that the file has already are not run again.

    Args:
        make: makes a worker in each process. tasks: picklable. name: of a task, unique.
        settings: of the campaign; they stand in the file's first line, and a file with others is refused.
        file: rows are appended as they come (JSON lines). None: kept in memory.
        shard: (k, n): the k-th of n equal parts of the tasks, from 1.
        jobs: processes. progress: told of how many are done, of all, and a word.

    Raises:
        ValueError: a shard out of range, or a file of another campaign.
    """
    part, parts = shard
    if not 1 <= part <= parts:
        raise ValueError(f"shard is {part}/{parts}, allowed: 1/{parts} to {parts}/{parts}")
    mine = list(tasks)[part - 1 :: parts]
    head = {"version": __version__, **settings}
    done = {} if file is None else _read(file, head)
    left = [task for task in mine if name(task) not in done]
    if progress is not None:
        progress(len(mine) - len(left), len(mine), "preparing")
    for row in run_tasks(make, left, jobs=jobs) if left else ():
        done[row["name"]] = row
        if file is not None:
            with file.open("a", encoding="utf-8") as lines:
                lines.write(json.dumps(row) + "\n")
        if progress is not None:
            progress(sum(name(task) in done for task in mine), len(mine), row["name"])
    return [done[name(task)] for task in mine]


def _read(file: Path, head: Row) -> dict[str, Row]:
    """The rows of a file by their names; begins a new file. A last line that was cut off is dropped."""
    if not file.exists():
        file.write_text(json.dumps(head) + "\n", encoding="utf-8")
        return {}
    first, *lines = file.read_text(encoding="utf-8").splitlines()
    if json.loads(first) != json.loads(json.dumps(head)):
        raise ValueError(f"{file} is of another campaign: {first}; this one is {json.dumps(head)}")
    rows = []
    for line in lines:
        try:
            rows.append(json.loads(line))
        except json.JSONDecodeError:
            break
    if len(rows) < len(lines):
        file.write_text("\n".join([first, *map(json.dumps, rows)]) + "\n", encoding="utf-8")
    return {row["name"]: row for row in rows}


def parse_shard(text: str) -> tuple[int, int]:
    """(k, n) of "k/n".

    Raises:
        ValueError: it is none.
    """
    part, slash, parts = text.partition("/")
    if not (slash and part.isdigit() and parts.isdigit()):
        raise ValueError(f"shard is {text!r}, allowed: k/n, for example 1/4")
    return int(part), int(parts)
