"""What is taken away from the studio: the scenario as it stands, and a system as Python."""

from __future__ import annotations

import dataclasses
import io
import os
import tempfile
import zipfile
from collections.abc import Collection
from pathlib import Path

import numpy as np
import numpy.typing as npt

from sidestep.scenario import Scenario
from sidestep.scenario.scenario import (
    JointState,
    Obstacle,
    PoseConfig,
    StraightMove,
    Vector3,
)
from sidestep.shapes import Shape
from sidestep.studio.adapter import STILL
from sidestep.studio.archive import unpack
from sidestep.studio.messages import Snapshot
from sidestep.studio.methods import METHODS
from sidestep.studio.scene_obstacle import written_pose
from sidestep.studio.systems import as_file

Array = npt.NDArray[np.float64]

MOST_UNPACKED = 2**28  # bytes of an upload, unpacked: more than the largest clouds that are taken


def scenario_now(snapshot: Snapshot, *, name: str) -> Scenario:
    """The scenario as it stands: arm, goal and obstacles as they are and move now, the method and its numbers.

    What is as it was loaded stays as it was written; see `not_kept` for what a file cannot say.
    """
    numbers = snapshot.numbers[snapshot.method]
    written = as_file(METHODS[snapshot.method], numbers, snapshot.scenario)
    velocity = snapshot.v / max(1.0, snapshot.speed_share)  # the start of a file is within the limits
    return dataclasses.replace(
        written,
        name=name,
        start=written.start if snapshot.time == 0.0 else _state(snapshot.q, velocity),
        goal=written.goal if snapshot.goal_written else _goal(snapshot),
        obstacles=tuple(_obstacle(snapshot, index) for index in range(len(snapshot.things))),
    )


def not_kept(snapshot: Snapshot) -> str:
    """What moves now and rests at the start of a file, in words; "" where nothing is lost."""
    flying = [
        thing.name
        for thing, velocity in zip(snapshot.things, snapshot.velocities, strict=True)
        if thing.obstacle.free and np.linalg.norm(velocity) > STILL
    ]
    return f"At rest in a file, as free obstacles are: {', '.join(flying)}." if flying else ""


def _obstacle(snapshot: Snapshot, index: int) -> Obstacle:
    """An obstacle where it is now, that goes on as it does now."""
    thing, pose = snapshot.things[index], snapshot.poses[index]
    item, velocity = thing.obstacle, _vector(snapshot.velocities[index])
    at_rest = item.free or snapshot.courses[index] == "held"
    move = None if snapshot.courses[index] != "file" else item.motion
    if move is not None:
        rest, velocity = move.end - snapshot.time, (0.0, 0.0, 0.0)
        begin = max(move.begin - snapshot.time, 0.0)
        move = StraightMove(move.to, begin, rest) if rest > begin else None
    if not np.array_equal(pose, thing.start):
        item = thing.at(pose).obstacle
    return dataclasses.replace(
        item, name=thing.name, velocity=(0.0, 0.0, 0.0) if at_rest else velocity, motion=move
    )


def _state(q: Array, v: Array | None = None) -> JointState:
    velocity = tuple(map(float, v)) if v is not None and v.any() else None
    return JointState("rad", tuple(map(float, q)), velocity)


def _vector(values: Array) -> Vector3:
    x, y, z = map(float, values)
    return x, y, z


def _goal(snapshot: Snapshot) -> JointState | PoseConfig:
    if snapshot.goal is not None:
        return _state(snapshot.goal)
    assert snapshot.goal_pose is not None
    posture = snapshot.posture
    found = _state(posture.q) if posture is not None and posture.found else None
    return PoseConfig(snapshot.tip, *written_pose(snapshot.goal_pose), found)


def save_scenario(scenario: Scenario, folder: Path, *, replace: bool = False) -> Path:
    """Writes a scenario as NAME.yaml, with copies of the files that its obstacles name beside it.

    Raises:
        FileExistsError: there is one of this name, and it is not to be replaced.
        OSError: a file of an obstacle cannot be read, or the folder cannot be written to.
    """
    path = folder / f"{scenario.name}.yaml"
    if path.exists() and not replace:
        raise FileExistsError(f"{path} exists")
    copies: dict[Path, Path] = {}  # by what they are copies of
    obstacles = []
    for item in scenario.obstacles:
        shape = item.shape
        if not isinstance(shape, Shape):
            source = scenario.file(shape.file)
            if source not in copies:
                name = f"{scenario.name}-{source.name.removeprefix(f'{scenario.name}-')}"
                copies[source] = _unused(folder / name, copies.values())
            beside = os.path.relpath(
                copies[source], scenario.folder.resolve()
            )  # as its folder is the saved one's
            shape = dataclasses.replace(shape, file=Path(beside).as_posix())
            item = dataclasses.replace(item, shape=shape)
        obstacles.append(item)
    contents = {copy: source.read_bytes() for source, copy in copies.items()}  # one may be another's place
    for copy, content in contents.items():
        copy.write_bytes(content)
    dataclasses.replace(scenario, obstacles=tuple(obstacles)).save(path)
    return path


def _unused(path: Path, taken: Collection[Path]) -> Path:
    """The path, or one with a number where it is taken."""
    found, count = path.resolve(), 2
    while found in taken:
        found, count = path.resolve().with_stem(f"{path.stem}-{count}"), count + 1
    return found


def packed_scenario(scenario: Scenario) -> tuple[str, bytes]:
    """A scenario complete in one file, by name and content: NAME.yaml, or NAME.zip with the files that it names.

    Raises:
        ValueError: its robot is a URDF file, whose meshes would be missing elsewhere.
        OSError: a file of an obstacle cannot be read.
    """
    if scenario.robot.urdf is not None:
        raise ValueError(
            f"the robot is the file {scenario.file(scenario.robot.urdf)}, which with its meshes does not go into a "
            "download; use Save, which names it where it is"
        )
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        path = save_scenario(scenario, folder)
        files = sorted(folder.iterdir())
        if files == [path]:
            return path.name, path.read_bytes()
        buffer = io.BytesIO()
        with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as archive:
            for file in files:
                archive.write(file, file.name)
        return f"{scenario.name}.zip", buffer.getvalue()


def unpacked_scenario(name: str, content: bytes, folder: Path, place: Path) -> Scenario:
    """A scenario of a file that was uploaded: YAML, whose file names refer to `folder`, or a .zip of
    `packed_scenario`, which is unpacked into `place`.

    Raises:
        ValueError: it is neither; names what is wrong with it.
    """
    if not name.lower().endswith(".zip"):
        text = content.decode("utf-8", errors="replace")
        return Scenario.from_text(text, file=name, folder=folder)
    unpack(name, content, place, most=MOST_UNPACKED)
    files = sorted(place.glob("*.yaml"))
    if len(files) != 1:
        raise ValueError(f"{name} holds {len(files)} scenarios (.yaml) at its top; allowed: one")
    return Scenario.load(files[0])
