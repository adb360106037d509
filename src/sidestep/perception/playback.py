"""A recording played through `Perception`."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from sidestep._core import Perception, PerceptionReport, PerceptionSettings
from sidestep.arm import Arm
from sidestep.controller import Controller
from sidestep.perception.camera_record import CameraRecord
from sidestep.perception.feed import take
from sidestep.perception.frame import Frame
from sidestep.perception.recording import Recording
from sidestep.perception.seen_stages import SeenStages

Array = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class PlayedFrame:
    """An image, where the arm was (nv,), and what became of it."""

    frame: Frame
    q: Array
    report: PerceptionReport


class Playback:
    """A `Perception` with a controller of its own, fed with the images and joint states of a recording.

    Attributes:
        recording, arm: what is played, and with which arm.
        perception: with the cameras of the recording.
        skipped: number of images at whose time the recording has no joint state.
    """

    def __init__(
        self,
        recording: Recording,
        arm: Arm,
        *,
        q: npt.ArrayLike | None = None,
        records: Sequence[CameraRecord] | None = None,
        settings: PerceptionSettings | None = None,
        camera_options: Mapping[str, Any] | None = None,
    ) -> None:
        """Prepares cameras and controller.

        Args:
            recording: where images and joint states come from.
            arm: in view, or beside it.
            q: (nv,) where the arm stands all the time; None: as the recording says.
            records: of the cameras, in place of what the recording says of them.
            settings: of `Perception`.
            camera_options: of `DepthCamera` by name, such as `far` or `translation_error`; None: its default.

        Raises:
            ValueError: nobody says where a camera is or where the joints are; names them, and those there are.
        """
        names = list(arm.robot.coordinate_names)
        self._q = None if q is None else np.asarray(q, dtype=np.float64)
        self._order = None if q is not None else joint_order(recording.joint_names, names)
        self.recording, self.arm, self.skipped = recording, arm, 0
        options = {name: value for name, value in (camera_options or {}).items() if value is not None}
        self._controller = Controller(arm)
        told = recording.cameras if records is None else records
        self.perception = Perception(
            self._controller, [record.camera(**options) for record in told], settings
        )

    def play(self) -> Iterator[PlayedFrame]:
        """Takes the images one by one; one without a joint state is skipped, and counted."""
        for frame in self.recording.frames():
            q = self._positions(frame)
            if q is None:
                self.skipped += 1
                continue
            yield PlayedFrame(frame, q, take(self.perception, replace(frame, q=q)))

    def stages(self, camera: str) -> SeenStages:
        """What the last image of a camera became."""
        return SeenStages.of(self.perception, camera)

    def _positions(self, frame: Frame) -> Array | None:
        if self._order is None:
            return self._q
        return None if frame.q is None else np.asarray(frame.q[self._order])


def joint_order(recorded: Sequence[str], joints: Sequence[str]) -> list[int]:
    """Where the joints of an arm are among those of a recording.

    Raises:
        ValueError: one is missing; names it, and those there are.
    """
    if not recorded:
        raise ValueError(
            "the recording has no joint states, so nobody knows where the arm is in its images; it needs joints.csv in "
            f"a folder, or /joint_states in a bag, with {', '.join(joints)}, or an arm that stands at a given q"
        )
    missing = [name for name in joints if name not in recorded]
    if missing:
        raise ValueError(
            f"the recording has no joint {', '.join(missing)} of the arm; it has {', '.join(recorded)}"
        )
    return [list(recorded).index(name) for name in joints]
