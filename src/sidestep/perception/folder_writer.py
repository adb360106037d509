"""Depth images into a folder."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from pathlib import Path
from types import TracebackType
from typing import Literal

import numpy as np
import numpy.typing as npt

from sidestep.perception.camera_file import write_camera
from sidestep.perception.camera_record import CameraRecord
from sidestep.perception.folder_layout import POSE_COLUMNS
from sidestep.perception.frame import Frame
from sidestep.perception.image_file import write_colour, write_depth
from sidestep.perception.written_cameras import by_name, camera_of, positions_of


class FolderWriter:
    """Writes the folder that `FolderRecording` reads: images at once, the tables at the end of the `with` block.

    One camera's images stand in the folder itself, those of several in a folder each, called like the camera. Depth in
    uint16 becomes `.png` or `.npy`, depth in metres `.npy`; both are read back bit by bit, times and q as well.
    """

    def __init__(
        self,
        path: str | Path,
        cameras: Sequence[CameraRecord],
        *,
        joint_names: Sequence[str] = (),
        kind: Literal["png", "npy"] = "png",
    ) -> None:
        """Makes the folder and writes the cameras.

        Args:
            path: the folder; made, or empty.
            cameras: whose frames come.
            joint_names: the joints, in the order of q; empty: q is not written.
            kind: of the files of uint16 depth.

        Raises:
            FileExistsError: the folder holds something.
            ValueError: there are no cameras, two of one name, or a name with a path in it; `kind` is another.
        """
        self.path = Path(path)
        self._cameras = by_name(cameras)
        if kind not in ("png", "npy"):
            raise ValueError(f"kind is {kind!r}, must be 'png' or 'npy'")
        if self.path.exists() and any(self.path.iterdir()):
            raise FileExistsError(f"folder '{self.path}' is not empty, nothing is overwritten")
        self._kind, self.joint_names = kind, tuple(joint_names)
        names = list(self._cameras)
        self._folders = {name: self.path if len(names) == 1 else self.path / name for name in names}
        self._rows: dict[str, list[list[object]]] = {name: [] for name in names}
        self._states: list[list[float]] = []
        for name, folder in self._folders.items():
            if len(names) > 1 and folder.parent != self.path:
                raise ValueError(f"camera is called {name!r}, must be the name of a folder")
            folder.mkdir(parents=True, exist_ok=True)
            write_camera(folder / "camera.json", self._cameras[name])

    def add(self, frame: Frame) -> None:
        """Writes the image of a frame, and takes its q as a state at its time.

        Raises:
            ValueError: the frame is of no camera given, or of another size or unit, or q of another length.
        """
        camera = camera_of(frame, self._cameras)
        whole = frame.depth.dtype == np.uint16
        if whole and frame.unit != camera.unit:
            raise ValueError(
                f"frame of camera '{camera.name}' has unit {frame.unit} m, must be {camera.unit} as its camera's"
            )
        rows, folder = self._rows[camera.name], self._folders[camera.name]
        file = f"depth_{len(rows):06d}.{self._kind if whole else 'npy'}"
        write_depth(folder / file, frame.depth)
        colour = ""
        if frame.colour is not None:
            colour = f"color_{len(rows):06d}.png"
            write_colour(folder / colour, frame.colour)
        pose = [""] * 12 if frame.pose is None else frame.pose[:3].ravel().tolist()
        rows.append([file, float(frame.time), colour, *pose])
        if frame.q is not None and self.joint_names:
            self.add_state(frame.time, frame.q)

    def add_state(self, time: float, q: npt.ArrayLike) -> None:
        """Takes joint positions q (n,) [rad or m] at a time [s]; between two of them q is read back linearly.

        Raises:
            ValueError: q has another length or is not finite.
        """
        values = positions_of(q, self.joint_names)
        self._states.append([float(time), *values.tolist()])

    def __enter__(self) -> FolderWriter:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """Writes the tables of what has been added so far."""
        for name, folder in self._folders.items():
            _write_table(folder / "frames.csv", ["file", "time", "colour", *POSE_COLUMNS], self._rows[name])
        if self.joint_names:
            _write_table(self.path / "joints.csv", ["time", *self.joint_names], self._states)


def _write_table(path: Path, header: Sequence[str], rows: Sequence[Sequence[object]]) -> None:
    with path.open("w", encoding="utf-8", newline="") as stream:
        # Floats are written as their repr, which is read back bit by bit.
        csv.writer(stream, lineterminator="\n").writerows([header, *rows])
