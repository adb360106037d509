"""Runs parts of the report and writes their files."""

from __future__ import annotations

import csv
import os
import platform
import time as clock
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from sidestep._core import __version__
from sidestep.drawing import style
from sidestep.thesis.reproduce.item import Data, Figure, Item, Table
from sidestep.thesis.reproduce.page import write_page
from sidestep.thesis.reproduce.registry import Part, Settings, select

OnPart = Callable[[Part, int, int], None]


@dataclass(frozen=True, eq=False)
class Outcome:
    """What a run left behind.

    Attributes:
        page: the report.
        items: every figure and table, by name ("figure-5.1").
        seconds: wall time by key of the part.
    """

    page: Path
    items: dict[str, Item]
    seconds: dict[str, float]


def reproduce(
    out: str | Path,
    *,
    only: Sequence[str] = (),
    settings: Settings | None = None,
    on_part: OnPart | None = None,
) -> Outcome:
    """Runs the experiments of the thesis and writes index.html with figures (PNG, SVG) and data (CSV, NPZ).

    Args:
        out: folder, made if absent.
        only: keys of parts, figures, tables or chapters; empty for all.
        settings: how thorough.
        on_part: called with a part, how many are done, and how many there are, before each part.

    Raises:
        ValueError: a key that no part has.
    """
    parts = select(only)
    settings = settings or Settings()
    folder = Path(out)
    folder.mkdir(parents=True, exist_ok=True)
    done: list[tuple[Part, list[Item]]] = []
    files: dict[str, list[Path]] = {}
    seconds: dict[str, float] = {}
    for index, part in enumerate(parts):
        if on_part is not None:
            on_part(part, index, len(parts))
        begin = clock.perf_counter()
        items: list[Item] = []
        with style.applied():
            for item in part.run(settings):
                files[item.name] = _write(item, folder)
                items.append(_without_drawing_cost(item))
        seconds[part.key] = clock.perf_counter() - begin
        done.append((part, items))
    facts = [
        f"Sidestep {__version__}, {cpu_name()}, {os.cpu_count()} logical cores, {platform.system()}, "
        f"Python {platform.python_version()}",
        f"Made by: sidestep reproduce{''.join(f' --only {key}' for key in only)}"
        f"{' --quick' if settings.quick else ''}, {clock.strftime('%Y-%m-%d')}, "
        f"in {sum(seconds.values()):.0f} s",
    ]
    page = folder / "index.html"
    write_page(done, facts, files, page)
    return Outcome(page, {item.name: item for _, items in done for item in items}, seconds)


def cpu_name() -> str:
    """The processor's name, as the operating system tells it."""
    info = Path("/proc/cpuinfo")
    if info.is_file():
        for line in info.read_text(encoding="utf-8", errors="replace").splitlines():
            if line.startswith("model name"):
                return line.split(":", 1)[1].strip()
    return platform.processor() or platform.machine()


def _write(item: Item, folder: Path) -> list[Path]:
    """The files of an item: pictures, and its data as CSV if they are columns of one length, else NPZ."""
    written: list[Path] = []
    if isinstance(item, Figure):
        for kind in ("png", "svg"):
            path = folder / f"{item.name}.{kind}"
            item.drawing.savefig(path, dpi=style.DPI, metadata={"Date": None} if kind == "svg" else None)
            item.drawing.set_layout_engine("none")  # as laid out for the first file
            written.append(path)
    if item.data:
        written.append(_write_data(item.data, folder / item.name))
    elif isinstance(item, Table):
        path = folder / f"{item.name}.csv"
        with path.open("w", newline="", encoding="utf-8") as file:
            csv.writer(file).writerows([item.columns, *item.rows])
        written.append(path)
    return written


def _write_data(data: Data, stem: Path) -> Path:
    arrays = {name: np.asarray(values) for name, values in data.items()}
    lengths = {len(values) if values.ndim else -1 for values in arrays.values()}
    if len(lengths) > 1 or any(values.ndim not in (1, 2) for values in arrays.values()):
        path = stem.with_name(stem.name + ".npz")
        np.savez_compressed(path, allow_pickle=False, **arrays)
        return path
    names, columns = [], []
    for name, values in arrays.items():
        wide = values if values.ndim == 2 else values[:, None]
        names += [f"{name}[{j}]" for j in range(wide.shape[1])] if values.ndim == 2 else [name]
        columns += [[f"{x:.9g}" if isinstance(x, float) else x for x in column] for column in wide.T.tolist()]
    path = stem.with_name(stem.name + ".csv")
    with path.open("w", newline="", encoding="utf-8") as file:
        csv.writer(file).writerows([names, *zip(*columns, strict=True)])
    return path


def _without_drawing_cost(item: Item) -> Item:
    """The item with its drawing emptied: it is on disk, and dozens of canvases are much memory."""
    if isinstance(item, Figure):
        item.drawing.clear()
        return replace(item, drawing=item.drawing)
    return item
