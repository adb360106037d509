"""How far the arm is from the balls."""

from __future__ import annotations

import time

import coal
import numpy as np

from sidestep._core import BarrierSettings, ClearanceBarrier, GeometricSystem
from sidestep.bench.peers.way import FEWEST, Array, PeerSettings, States, Way, steps_in_cpp
from sidestep.bench.peers.whole_arm import ArmAmongBalls, moving_links
from sidestep.robot import Robot
from sidestep.shapes.mesh_reader import mesh_model


def distance_ways(settings: PeerSettings) -> tuple[States, list[Way]]:
    """How far the arm is from the balls, at the states of `whole_arm_ways`."""
    arm = ArmAmongBalls.of(settings)
    activation = BarrierSettings().activation
    clearances = GeometricSystem([ClearanceBarrier(arm.robot, arm.body, activation=activation)])
    moving = sum(link in moving_links(arm.robot) for link in arm.body.links)
    ways = [
        Way(
            "Sidestep, C++",
            f"clearances of {moving} ellipsoids with derivatives, where below {100.0 * activation:.0f} cm or soon so, "
            "kinematics and the acceleration, around each step of a motion",
            measured=lambda: steps_in_cpp(clearances, arm.start, arm.goal, arm.obstacles, settings.seconds),
        ),
        Way(
            "Coal",
            "the smallest distance of all moving links' meshes, by two trees of boxes, poses given; no derivatives",
            measured=lambda: _coal(arm.robot, arm.balls, arm.states, settings.seconds),
        ),
    ]
    return arm.states, ways


def _coal(robot: Robot, balls: Array, states: States, seconds: float) -> Array:
    """Microseconds of one distance between arm and balls; what sets the poses from Python does not count."""
    meshes = {name: robot.collision_mesh(name) for name in sorted(moving_links(robot))}
    links = {
        name: coal.CollisionObject(mesh_model(mesh)) for name, mesh in meshes.items() if mesh is not None
    }
    arm, scene = coal.DynamicAABBTreeCollisionManager(), coal.DynamicAABBTreeCollisionManager()
    kept = [
        coal.CollisionObject(coal.Sphere(ball[3]), coal.Transform3s(np.eye(3), ball[:3])) for ball in balls
    ]
    for item in kept:  # the managers do not hold them
        scene.registerObject(item)
    for item in links.values():
        arm.registerObject(item)
    scene.setup()
    arm.setup()
    callback = coal.DistanceCallBackDefault()
    times: list[float] = []
    end = time.perf_counter() + seconds
    while len(times) < FEWEST or time.perf_counter() < end:
        q, _, _ = states[len(times) % len(states)]
        for name, item in links.items():
            pose = robot.pose(q, name)
            item.setTransform(coal.Transform3s(pose[:3, :3], pose[:3, 3]))
            item.computeAABB()
        start = time.perf_counter_ns()
        arm.update()
        callback.init()
        arm.distance(scene, callback)
        times.append(1e-3 * (time.perf_counter_ns() - start))
    return np.array(times)
