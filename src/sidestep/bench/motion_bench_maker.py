"""Problems of MotionBenchMaker: folders of scene and request pairs, in MoveIt's YAML.

Source: Chamzas et al., "MotionBenchMaker: a tool to generate and benchmark motion planning datasets", 2022.
"""

from __future__ import annotations

import itertools
import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import yaml

from sidestep.math.pose import from_quaternion, pose_at
from sidestep.obstacles import Box, Cylinder, Shape, Sphere

Array = npt.NDArray[np.float64]
Pair = tuple[str, str]

REQUEST = re.compile(r"request(\d+)\.ya?ml")
KINDS = {1: "box", 2: "sphere", 3: "cylinder"}  # MoveIt's numbers of primitives; its files have the names too
_LOADER = getattr(yaml, "CSafeLoader", yaml.SafeLoader)  # the C one reads a folder ten times faster


@dataclass(frozen=True, eq=False)
class MotionBenchMakerProblem:
    """One published problem, as its two files have it.

    Attributes:
        set: its folder. index: its number there.
        start: every joint of the start state by name [rad | m]. goal: the joints that are planned.
        shapes: the obstacles by name, in the frame of the robot's root [m].
        allowed: the pairs of links that may touch.
    """

    set: str
    index: int
    start: Mapping[str, float]
    goal: Mapping[str, float]
    shapes: Mapping[str, Shape]
    allowed: tuple[Pair, ...]

    @property
    def held(self) -> dict[str, float]:
        """The joints that are not planned, such as fingers, and where they stand [rad | m]."""
        return {name: value for name, value in self.start.items() if name not in self.goal}


def read_motion_bench_maker(folder: str | Path) -> tuple[MotionBenchMakerProblem, ...]:
    """Reads every pair `sceneNNNN.yaml`, `requestNNNN.yaml` of a folder and those below it, in order.

    Obstacles are boxes, cylinders and spheres, several per object; an object may have a pose and a frame of
    its own. The robot stands where the request's multi-DOF joint puts it. One goal with a position per joint.

    Raises:
        FileNotFoundError: no such folder, no request in it, or a request without its scene.
        ValueError: what a file has that is not understood: its place, its value and what is allowed.
    """
    folder = Path(folder)
    if not folder.is_dir():
        raise FileNotFoundError(
            f"{folder} is not a folder; the problems are published as folders of YAML pairs"
        )
    requests = sorted(path for path in folder.rglob("request*") if REQUEST.fullmatch(path.name))
    if not requests:
        raise FileNotFoundError(f"{folder} and the folders below it hold no requestNNNN.yaml")
    return tuple(
        read_problem(path.with_name(path.name.replace("request", "scene", 1)), path) for path in requests
    )


def read_problem(scene: Path, request: Path) -> MotionBenchMakerProblem:
    """Reads one pair of files; raises as `read_motion_bench_maker`."""
    if not scene.is_file():
        raise FileNotFoundError(f"{request} has no scene: {scene} does not exist")
    asked, world = _Node.load(request), _Node.load(scene)
    number = REQUEST.fullmatch(request.name)
    state = asked.child("start_state")
    goals = asked.child("goal_constraints").children()
    if len(goals) != 1:
        raise asked.child("goal_constraints").error("one goal", f"{len(goals)} goals")
    return MotionBenchMakerProblem(
        set=request.parent.name,
        index=int(number[1]) if number else 0,
        start=_positions(state.child("joint_state")),
        goal=_goal(goals[0]),
        shapes=_shapes(world, np.asarray(np.linalg.inv(_root_pose(state)), dtype=np.float64)),
        allowed=_allowed_pairs(world),
    )


@dataclass(frozen=True, eq=False)
class _Node:
    """A value of a YAML file that knows its place, for errors."""

    value: Any
    place: str

    @classmethod
    def load(cls, path: Path) -> _Node:
        try:
            return cls(yaml.load(path.read_text(encoding="utf-8"), Loader=_LOADER), f"{path}:")
        except yaml.YAMLError as error:
            raise ValueError(f"{path} is not well-formed YAML: {error}") from error

    def error(self, allowed: str, found: str | None = None) -> ValueError:
        return ValueError(
            f"{self.place} is {repr(self.value) if found is None else found}; allowed: {allowed}"
        )

    def get(self, key: str) -> _Node | None:
        """A value that may be missing or empty."""
        if not isinstance(self.value, dict):
            raise self.error("a mapping")
        found = self.value.get(key)
        return None if found in (None, [], {}, "") else _Node(found, f"{self.place} {key}")

    def child(self, key: str) -> _Node:
        found = self.get(key)
        if found is None:
            raise ValueError(f"{self.place} has no {key!r}, which must be there and not empty")
        return found

    def children(self) -> list[_Node]:
        if not isinstance(self.value, list):
            raise self.error("a list")
        return [_Node(item, f"{self.place}[{k}]") for k, item in enumerate(self.value)]

    def text(self) -> str:
        if not isinstance(self.value, str):
            raise self.error("a name")
        return self.value

    def number(self) -> float:
        if (
            isinstance(self.value, bool)
            or not isinstance(self.value, int | float)
            or not np.isfinite(self.value)
        ):
            raise self.error("a finite number")
        return float(self.value)

    def vector(self, count: int, keys: str) -> Array:
        """Numbers, as a list or under the letters of `keys`."""
        if isinstance(self.value, dict):
            return np.array([_Node(self.value.get(key), f"{self.place} {key}").number() for key in keys])
        if not isinstance(self.value, list) or len(self.value) != count:
            raise self.error(f"{count} numbers")
        return np.array([item.number() for item in self.children()])


def _positions(state: _Node) -> dict[str, float]:
    names, values = state.child("name").children(), state.child("position").children()
    if len(names) != len(values):
        raise state.child("position").error(
            f"{len(names)} positions, one per name", f"{len(values)} positions"
        )
    return {name.text(): value.number() for name, value in zip(names, values, strict=True)}


def _goal(goal: _Node) -> dict[str, float]:
    for other in ("position_constraints", "orientation_constraints", "visibility_constraints"):
        found = goal.get(other)
        if found is not None:
            raise found.error("joint_constraints only", "not empty")
    joints = goal.child("joint_constraints").children()
    return {item.child("joint_name").text(): item.child("position").number() for item in joints}


def _root_pose(state: _Node) -> Array:
    """The pose (4, 4) of the robot's root: of the joints with many degrees of freedom, at most one."""
    joints = state.get("multi_dof_joint_state")
    transforms = None if joints is None else joints.get("transforms")
    if transforms is None:
        return np.eye(4)
    if len(transforms.children()) != 1:
        raise transforms.error("one joint with many degrees of freedom, the robot's root")
    return _pose(transforms.children()[0], "translation", "rotation")


def _shapes(scene: _Node, X_root_world: Array) -> dict[str, Shape]:
    frames = {"": np.eye(4)}
    fixed = scene.get("fixed_frame_transforms")
    for item in [] if fixed is None else fixed.children():
        child = item.child("child_frame_id").text()
        frames[child] = _pose(item.child("transform"), "translation", "rotation")
    attached = scene.child("robot_state").get("attached_collision_objects")
    if attached is not None:
        raise attached.error("no attached objects", "not empty")
    objects = scene.child("world").get("collision_objects")
    shapes: dict[str, Shape] = {}
    for item in [] if objects is None else objects.children():
        for key in ("meshes", "planes"):
            found = item.get(key)
            if found is not None:
                raise found.error(f"primitives only: {', '.join(KINDS.values())}", "not empty")
        header = item.get("header")
        frame = None if header is None else header.get("frame_id")
        if frame is not None and frame.text() not in frames:
            raise frame.error(", ".join(name for name in frames if name) or "no frame: the scene has none")
        X = X_root_world @ frames["" if frame is None else frame.text()]
        own = item.get("pose")
        if own is not None:
            X = X @ _pose(own, "position", "orientation")
        primitives, poses = item.child("primitives").children(), item.child("primitive_poses").children()
        if len(primitives) != len(poses):
            raise item.child("primitive_poses").error(f"{len(primitives)} poses", f"{len(poses)} poses")
        for k, (primitive, pose) in enumerate(zip(primitives, poses, strict=True)):
            name = item.child("id").text() + (f"_{k}" if len(poses) > 1 else "")
            if name in shapes:
                raise item.child("id").error(f"a name that is not taken: there are two objects {name!r}")
            shapes[name] = _shape(primitive, X @ _pose(pose, "position", "orientation"))
    return shapes


def _shape(primitive: _Node, pose: Array) -> Shape:
    kind = primitive.child("type")
    name = KINDS.get(kind.value) if isinstance(kind.value, int) else kind.value
    size = [item.number() for item in primitive.child("dimensions").children()]
    match name, size:
        case "box", [x, y, z]:
            return Box((x, y, z), pose)
        case "cylinder", [length, radius]:
            return Cylinder(radius=radius, length=length, pose=pose)
        case "sphere", [radius]:
            return Sphere(radius, pose)
    raise primitive.error("a box of 3 dimensions, a cylinder of 2 (height, radius), a sphere of 1")


def _pose(node: _Node, position: str, orientation: str) -> Array:
    """A pose (4, 4); quaternions (x, y, z, w) are written with a few digits, and all zero means not turned."""
    place, turn = node.get(position), node.get(orientation)
    quaternion = np.zeros(4) if turn is None else turn.vector(4, "xyzw")
    length = float(np.linalg.norm(quaternion))
    rotation = np.eye(3) if length == 0.0 else from_quaternion(np.roll(quaternion, 1) / length)
    return pose_at(np.zeros(3) if place is None else place.vector(3, "xyz"), rotation)


def _allowed_pairs(scene: _Node) -> tuple[Pair, ...]:
    """The pairs of links that the matrix lets touch; a contact with an object cannot be let."""
    matrix = scene.get("allowed_collision_matrix")
    if matrix is None or matrix.get("entry_names") is None:
        return ()
    names = [item.text() for item in matrix.child("entry_names").children()]
    rows = [
        (item.child("enabled") if isinstance(item.value, dict) else item).children()
        for item in matrix.child("entry_values").children()
    ]
    if len(rows) != len(names) or any(len(row) != len(names) for row in rows):
        raise matrix.child("entry_values").error(f"{len(names)} rows of {len(names)}", "another shape")
    allowed = [
        (names[i], names[j])
        for i, j in itertools.combinations(range(len(names)), 2)
        if rows[i][j].value is True
    ]
    objects = scene.child("world").get("collision_objects")
    solid = set() if objects is None else {item.child("id").text() for item in objects.children()}
    touching = [pair for pair in allowed if solid.intersection(pair)]
    if touching:
        raise matrix.error("pairs of links", f"one that lets {' and '.join(touching[0])} touch")
    return tuple(allowed)
