"""The black box of a run: the last half minute of every run on a robot, in the user's cache."""

from __future__ import annotations

import os
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from sidestep._core import Controller
from sidestep.storage.user_cache import cache_root

FOLDER = "black-box"  # in the cache; all boxes of an arm share its bound


def usual_folder(controller: Controller) -> Path:
    """Where the last 30 s of runs of this arm are kept, for `sidestep report`."""
    return cache_root() / FOLDER / controller.arm.name


@contextmanager
def black_box_of(controller: Controller, folder: str | os.PathLike[str] | bool) -> Iterator[Path | None]:
    """Keeps a black box while the block lasts, see `Controller.black_box`; its folder, or None where there is none.

    folder: True: the usual one; False: no black box. Where it cannot be written, a RuntimeWarning says so, and the run
    goes on.
    """
    if folder is False:
        yield None
        return
    place = usual_folder(controller) if folder is True else Path(folder)
    try:
        place.mkdir(parents=True, exist_ok=True)
        box = controller.black_box(place)
    except (OSError, RuntimeError) as error:
        # of whoever called run(): contextmanager, ExitStack and run are between
        warnings.warn(f"no black box of this run: {error}", RuntimeWarning, stacklevel=5)
        box = None
    if box is None:
        yield None
        return
    with box:
        yield place
