"""A recorded run as a table that pandas and spreadsheets read."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import numpy.typing as npt

from sidestep.report.recorded_arrays import RecordedArrays

Array = npt.NDArray[np.float64]


def write_recorded_csv(run: RecordedArrays, path: Path) -> None:
    """Writes one row per step: numbers with 9 digits, then status, activity, link and what is nearest in words."""
    numbers = recorded_columns(run)
    words = {"status": run.status, "activity": run.activity, "link": run.link, "nearest": run.nearest}
    with path.open("w", newline="", encoding="utf-8") as stream:
        writer = csv.writer(stream)
        writer.writerow([*numbers, *words])
        for row, texts in zip(
            zip(*numbers.values(), strict=True), zip(*words.values(), strict=True), strict=True
        ):
            writer.writerow([*(f"{value:.9g}" for value in row), *texts])


def recorded_columns(run: RecordedArrays) -> dict[str, Array]:
    """The numbers of the table by name, units in the names."""
    columns: dict[str, Array] = {"time [s]": run.time}
    units = run.arm.robot.coordinate_units

    def add(name: str, values: Array, per: str, *, effort: bool = False) -> None:
        for index, (joint, unit) in enumerate(zip(run.joint_names, units, strict=True)):
            unit = {"rad": "N m", "m": "N"}[unit] if effort else unit
            columns[f"{name} {joint} [{unit}{per}]"] = values[:, index]

    add("measured position", run.q, "")
    add("measured velocity", run.v, "/s")
    add("position", run.position, "")
    add("velocity", run.velocity, "/s")
    add("acceleration", run.acceleration, "/s^2")
    add("torque", run.torque, "", effort=True)
    columns["clearance [m]"] = run.clearance
    columns["speed [m/s]"] = run.speed
    columns["tracking error [rad | m]"] = run.tracking_error
    return columns
