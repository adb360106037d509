"""Geometric fabrics, run by an interpreter of their own."""

from __future__ import annotations

import json
import subprocess
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from sidestep._core import JointType
from sidestep.bench.peers.serial_chain import SerialChain
from sidestep.bench.peers.way import Array, PeerSettings, States, Way
from sidestep.robot import Robot


def fabrics_way(
    settings: PeerSettings,
    robot: Robot,
    chain: SerialChain,
    radii: Array,
    balls: Array,
    states: States,
    goal: Array,
) -> Way:
    name, work = (
        "fabrics",
        f"one action: a sphere per link, the {len(balls)} balls, limits, to a position; no self-collision",
    )
    if settings.fabrics is None:
        return Way(name, work, missing="needs an environment of its own: --fabrics PYTHON")
    of_link = [radii[np.array(chain.owners) == j].max(initial=0.05) for j in range(chain.num_joints)]
    scene = {
        "urdf": _plain_urdf(robot),
        "root": "link0",
        "links": [f"link{j + 1}" for j in range(chain.num_joints)],
        "radii": {f"link{j + 1}": float(radius) for j, radius in enumerate(of_link)},
        "moved": [f"link{j + 1}" for j in range(chain.num_joints) if _origin_moves(robot, j)],
        "balls": balls.tolist(),
        "limits": [robot.limits.lower.tolist(), robot.limits.upper.tolist()],
        "q": [q.tolist() for q, _, _ in states],
        "v": [v.tolist() for _, v, _ in states],
        "goal": goal.tolist(),
        "goal_position": robot.pose(goal, robot.links[-1].name)[:3, 3].tolist(),
        "seconds": settings.seconds,
    }

    def measured() -> Array:
        script = Path(__file__).with_name("fabrics_alone.py")
        done = subprocess.run(
            [str(settings.fabrics), str(script)], input=json.dumps(scene), capture_output=True, text=True
        )
        if done.returncode != 0:
            last = (done.stderr.strip().splitlines() or ["no message"])[-1]
            raise RuntimeError(f"fabrics, by {settings.fabrics}: {last}")
        return np.array(json.loads(done.stdout.splitlines()[-1]))

    return Way(name, work, measured=measured)


def _origin_moves(robot: Robot, joint: int) -> bool:
    """Whether any joint moves the origin of the frame of another one."""
    frame = next(frame for frame in robot.frames if frame.joint == joint)
    poses = [
        robot.pose(q, frame.name) @ np.linalg.inv(frame.placement)
        for q in (robot.neutral, robot.neutral + 0.3)
    ]
    return bool(np.abs(poses[0][:3, 3] - poses[1][:3, 3]).max() > 1e-9)


def _plain_urdf(robot: Robot) -> str:
    """Joints alone, for readers that know no more."""
    from scipy.spatial.transform import Rotation

    def numbers(values: Array) -> str:
        return " ".join(f"{x:.17g}" for x in values)

    def joints() -> Iterator[str]:
        limits = robot.limits
        for j, joint in enumerate(robot.joints):
            if joint.type != JointType.revolute:
                raise ValueError(f"joint {joint.name!r} of robot {robot.name!r} is not revolute")
            rpy = Rotation.from_matrix(joint.placement[:3, :3]).as_euler("xyz")
            yield (
                f'<joint name="joint{j + 1}" type="revolute"><parent link="link{j}"/><child link="link{j + 1}"/>'
                f'<origin rpy="{numbers(rpy)}" xyz="{numbers(joint.placement[:3, 3])}"/>'
                f'<axis xyz="{numbers(joint.axis)}"/><limit lower="{limits.lower[j]}" upper="{limits.upper[j]}" '
                f'effort="{limits.effort[j]}" velocity="{limits.velocity[j]}"/></joint>'
            )

    links = "".join(f'<link name="link{j}"/>' for j in range(len(robot.joints) + 1))
    return f'<robot name="{robot.name}">{links}{"".join(joints())}</robot>'
