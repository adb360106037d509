"""Reads a run of one's own from its recording or from a black box, to plot it and to write it as a table."""

from __future__ import annotations

import os
from collections.abc import Iterable
from pathlib import Path
from typing import TypeAlias

from sidestep import _core
from sidestep.report.recorded_arrays import RecordedArrays

AnyPath: TypeAlias = "str | os.PathLike[str]"


class RecordedRun(RecordedArrays):
    """A recorded run as arrays, see `RecordedArrays`, that draws itself."""

    def plot(self, path: AnyPath) -> Path:
        """Draws clearance by link, torque and velocity against their limits, status and events.

        Args:
            path: .png for one picture, .html for a page with all; replaced if it exists.

        Raises:
            ValueError: another suffix. OSError: it cannot be written.
        """
        target = Path(path)
        if target.suffix == ".html":
            from sidestep.report.recorded_page import write_recorded_page

            write_recorded_page(self, target)
        elif target.suffix == ".png":
            from sidestep.report.recorded_figures import overview

            overview(self).savefig(target, dpi=120)
        else:
            raise ValueError(f"plot: the suffix is {target.suffix!r}, allowed: .png, .html")
        return target

    def save_csv(self, path: AnyPath) -> Path:
        """Writes one row per step, units in the names of the columns (`pandas.read_csv(path)`).

        Raises:
            OSError: it cannot be written.
        """
        from sidestep.report.recorded_csv import write_recorded_csv

        write_recorded_csv(self, Path(path))
        return Path(path)


def load_recording(path: AnyPath | Iterable[AnyPath], *, scenes: bool = False) -> RecordedRun:
    """Reads a run of one's own: what `Controller.record` or a black box wrote, also where its program was killed.

    Args:
        path: of a recording; or the files of one black box in the order of time; or a folder of black boxes, of
            which the one that was written to last is read.
        scenes: also where the obstacles were, for pictures; of clouds that takes memory.

    Raises:
        OSError: a file cannot be read. ValueError: it is no recording, or written by Sidestep 0.2.
    """
    given = [Path(path)] if isinstance(path, str | os.PathLike) else [Path(one) for one in path]
    paths = newest_black_box(given[0]) if len(given) == 1 and given[0].is_dir() else given
    return RecordedRun(_core.read_recorded_run(paths, scenes=scenes), tuple(paths), scenes)


def newest_black_box(folder: Path) -> list[Path]:
    """The files of the black box in a folder that was written to last, in the order of time.

    Raises:
        ValueError: there is none.
    """
    names = f"{_core.black_box_begin}*{_core.recording_suffix}"
    files = sorted(folder.glob(names))
    if not files:
        raise ValueError(f"{folder}: there is no black box ({names}); name a recording")
    last = max(files, key=lambda file: (file.stat().st_mtime_ns, file.name))
    newest = last.stem.rpartition("-")[0]
    return [file for file in files if file.stem.rpartition("-")[0] == newest]
