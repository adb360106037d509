"""Recordings of short motions of every kind: what a change of the controller's code is compared by."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path

from sidestep._core import ReplayResult, black_box_begin, recording_suffix
from sidestep._core import replay as replay_one
from sidestep.bench.parallel import Progress

FOLDER_VARIABLE = "SIDESTEP_RECORD"  # names the folder in which every controller of a program is recorded
SUFFIXES = (recording_suffix, ".step")  # what can be replayed; the second is of Sidestep 0.2


@contextmanager
def recording_to(folder: Path) -> Iterator[None]:
    """Every controller that is made in the block, here and in processes started there, is recorded in the folder."""
    before = os.environ.get(FOLDER_VARIABLE)
    os.environ[FOLDER_VARIABLE] = str(folder)
    try:
        yield
    finally:
        if before is None:
            del os.environ[FOLDER_VARIABLE]
        else:
            os.environ[FOLDER_VARIABLE] = before


def record_all(
    folder: Path, *, only: Sequence[str] = (), progress: Progress | None = None
) -> tuple[list[Path], list[str]]:
    """Records short motions of every kind.

    Args:
        folder: must be new, or have no recordings.
        only: names of cases to record, see `recorded_cases.cases`; all if there are none.
        progress: told of how many are done, of all, and a word about the last one.

    Returns:
        The recordings; and what was left out, with the reason.

    Raises:
        ValueError: an unknown case; the folder has recordings already.
    """
    from sidestep.bench.recorded_cases import cases  # not above: who replays needs no simulator

    chosen = cases()
    if unknown := sorted(set(only) - {case.name for case in chosen}):
        raise ValueError(f"no case {unknown[0]!r}; there are: {', '.join(case.name for case in chosen)}")
    if _recordings_below(folder):
        raise ValueError(f"{folder} has recordings already; name a new folder")
    chosen = [case for case in chosen if not only or case.name in only]
    left_out = []
    for done, case in enumerate(chosen):
        if progress is not None:
            progress(done, len(chosen), case.name)
        with recording_to(folder / case.name):
            try:
                case.run()
            except ImportError as error:
                left_out.append(f"{case.name}: {error}")
    if progress is not None:
        progress(len(chosen), len(chosen), "done")
    return sorted(folder.rglob(f"*{recording_suffix}")), left_out


def replay_all(
    paths: Sequence[Path], *, jobs: int, progress: Progress | None = None
) -> list[tuple[Path, ReplayResult]]:
    """Replays recordings, in threads.

    Args:
        paths: of files, or of folders with any below them. jobs: threads.
        progress: told of how many are done, of all, and a word about the last one.

    Raises:
        OSError: one cannot be read. ValueError: one is no recording; there is none.
    """
    files: list[Path] = []
    for path in paths:
        files += _recordings_below(path) if path.is_dir() else [path]
    if not files:
        raise ValueError(f"{', '.join(map(str, paths))}: there is no recording (*{recording_suffix})")
    results = []
    with ThreadPoolExecutor(max_workers=jobs) as pool:
        for path, result in zip(files, pool.map(replay_one, files), strict=True):
            results.append((path, result))
            if progress is not None:
                progress(len(results), len(files), f"{path.name}: {'equal' if result.equal else 'not equal'}")
    return results


def _recordings_below(folder: Path) -> list[Path]:
    found = [path for suffix in SUFFIXES for path in folder.rglob(f"*{suffix}")]
    return sorted(path for path in found if not path.name.startswith(black_box_begin))
