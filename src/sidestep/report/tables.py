"""The log of a run as files that NumPy and pandas read."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import numpy.typing as npt

from sidestep.scenario.result import ScenarioResult
from sidestep.simulation import SimulationRun

Array = npt.NDArray[np.float64]


def write_npz(result: ScenarioResult, path: Path) -> None:
    """Writes every time series as one array, SI units (`numpy.load(path)`)."""
    run = result.run
    series: dict[str, Array] = {
        "time": run.time,
        "q": run.q,
        "v": run.v,
        "wanted_acceleration": run.wanted,
        "achieved_acceleration": run.achieved,
        "switch": run.switch,
        "psi": run.values,
        "object_poses": run.object_poses,
        "start": run.start,
        "goal": run.goal,
        "clearance_time": result.clearance_time,
        "clearance": result.clearance,
    }
    if isinstance(run, SimulationRun):
        series |= {"solved_acceleration": run.solved, "torque": run.torque}
    names = {
        "coordinate_names": np.array(run.robot.coordinate_names),
        "object_names": np.array([item.name for item in run.objects], dtype=str),
        "system_status": np.array(run.system_status),
    }
    np.savez_compressed(path, **series, **names)  # type: ignore[arg-type]


def write_csv(result: ScenarioResult, path: Path) -> None:
    """Writes one row per control step, units in the column names (`pandas.read_csv(path)`)."""
    columns = csv_columns(result)
    with path.open("w", newline="", encoding="utf-8") as stream:
        writer = csv.writer(stream)
        writer.writerow(columns)
        writer.writerows([f"{value:.9g}" for value in row] for row in np.column_stack(list(columns.values())))


def csv_columns(result: ScenarioResult) -> dict[str, Array]:
    """The columns of the table by name; the clearance is interpolated between the samples it is known at."""
    run, robot = result.run, result.run.robot
    columns: dict[str, Array] = {"time [s]": run.time}

    def add(symbol: str, values: Array, unit: str, effort: bool = False) -> None:
        names = zip(robot.coordinate_names, robot.coordinate_units, strict=True)
        for index, (name, base) in enumerate(names):
            base = {"rad": "N m", "m": "N"}[base] if effort else base
            columns[f"{symbol} {name} [{base}{unit}]"] = values[:, index]

    add("position", run.q, "")
    add("velocity", run.v, "/s")
    add("wanted acceleration", run.wanted, "/s^2")
    add("achieved acceleration", run.achieved, "/s^2")
    if isinstance(run, SimulationRun):
        add("solved acceleration", run.solved, "/s^2")
        add("torque", run.torque, "", effort=True)
    for index in range(run.switch.shape[1] if result.switched else 0):
        columns[f"switch {index + 1} [-]"] = run.switch[:, index]
    columns |= embedding_columns(result)
    if len(result.clearance):
        columns["clearance [m]"] = np.interp(run.time, result.clearance_time, result.clearance)
    for index, item in enumerate(run.objects):
        for axis, name in enumerate("xyz"):
            columns[f"{item.name} {name} [m]"] = run.object_poses[:, index, axis]
    return columns


def embedding_columns(result: ScenarioResult) -> dict[str, Array]:
    """Psi by name: of the method custom every coordinate, of the others the largest of the barriers with one name."""
    names, values = result.embedding_names, result.run.values
    if result.scenario.method == "custom":
        return {f"psi {index + 1} {name} [-]": values[:, index] for index, name in enumerate(names)}
    every = np.array(names, dtype=str)
    return {f"barrier {name} [-]": values[:, every == name].max(axis=1) for name in dict.fromkeys(names)}
