"""What each stage of `Perception` made of an image."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from sidestep._core import DepthCamera, Perception, PixelLabel

Array = npt.NDArray[np.float64]
CELL_KINDS = ("seen", "remembered", "hidden")


@dataclass(frozen=True, eq=False)
class SeenStages:
    """The last image of a camera, what its pixels show, and the map of all cameras after it.

    Attributes:
        camera: that took the image.
        pose: of its optical frame in the world (4, 4) then.
        time: of capture of the last image that was used [s]; depth, labels and pose are of the last one, also where it
            was refused.
        depth: (H, W) [m]; 0: nothing seen.
        labels: (H, W) of `PixelLabel`.
        centres, radii, ages: of the cells that count as obstacles, (N, 3) [m] in the world, (N,) [m], (N,) [s].
        kinds: (N,) what each is, as a number of `CELL_KINDS`.
        unseen: (M, 3) middles of cells where nobody has looked [m].
    """

    camera: DepthCamera
    pose: Array
    time: float
    depth: npt.NDArray[np.float32]
    labels: npt.NDArray[np.uint8]
    centres: Array
    radii: Array
    ages: Array
    kinds: npt.NDArray[np.intp]
    unseen: Array

    @classmethod
    def of(cls, perception: Perception, name: str) -> SeenStages:
        """What a camera's last image became.

        Raises:
            ValueError: there is no such camera; lists those there are.
        """
        pose = perception.pose(name)
        camera = next(camera for camera in perception.cameras if camera.name == name)
        cells: dict[str, Any] = perception.cells()
        remembered, hidden = cells["remembered"], cells["hidden"]
        return cls(
            camera,
            pose,
            perception.time(name),
            perception.depth(name),
            perception.labels(name),
            cells["centres"],
            cells["radii"],
            cells["ages"],
            np.where(remembered, np.where(hidden, 2, 1), 0),
            perception.unseen(),
        )

    def pixels(self) -> dict[str, int]:
        """Number of pixels by what they show."""
        counts = np.bincount(self.labels.ravel(), minlength=len(PixelLabel))
        return {label.name: int(counts[int(label)]) for label in PixelLabel}

    def cells(self) -> dict[str, int]:
        """Number of cells by what they are."""
        counts = {kind: int((self.kinds == number).sum()) for number, kind in enumerate(CELL_KINDS)}
        return counts | {"unseen": len(self.unseen)}

    def age_words(self, kind: str) -> str:
        """Ages of the cells of a kind that are not seen now: median and oldest; "" where there are none."""
        ages = self.ages[self.kinds == CELL_KINDS.index(kind)] if kind in CELL_KINDS[1:] else self.ages[:0]
        return f"{np.median(ages):.2g} s old, up to {ages.max():.2g} s" if len(ages) else ""
