"""Obstacles that move without a velocity, and points that flicker: set anew again and again, as a camera does."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

import sidestep as ss
from sidestep.obstacles import pose_at

PERIOD = 0.001
RADIUS = 0.06  # [m] of the ball


class Motion:
    """An ideal arm that holds its neutral posture while `scene(t)` is set at `rate` [Hz]."""

    def __init__(
        self,
        scene: Callable[[float], ss.Obstacles],
        duration: float,
        *,
        rate: float = 30.0,
        jitter: float = 0.0,
        name: str = "fr3",
        output: str = "acceleration",
        change: Callable[[float, ss.Controller], None] = lambda t, controller: None,
    ) -> None:
        arm = ss.Arm.load(name)
        random = np.random.default_rng(1)
        self.controller = ss.Controller(
            arm, ss.ControllerSettings(output=output, synchronous=True, planner=None, look_ahead=None)
        )
        self.controller.set_goal(arm.neutral)
        self.tip = arm.robot.links[-1].name
        q, v, due = arm.neutral.copy(), np.zeros(arm.num_coordinates), 0.0
        self.positions, self.acceleration, self.words = [], 0.0, set()
        for k in range(round(duration / PERIOD)):
            t = k * PERIOD
            if t >= due:
                self.controller.set_obstacles(scene(t))
                due = t + (1.0 + jitter * random.uniform(-1.0, 1.0)) / rate
            change(t, self.controller)
            command = self.controller.step(q, v)
            self.positions.append(q)
            self.acceleration = max(
                self.acceleration, np.max(np.abs(command.acceleration) / arm.limits.acceleration)
            )
            v = v + PERIOD * command.acceleration
            q = q + PERIOD * v
            if k % 10 == 0:
                self.words.update(self.controller.explain().split("; "))
        self.speed = np.max(np.abs(v) / arm.limits.velocity)
        self.moved = np.max(np.abs(np.array(self.positions) - arm.neutral))


def least_clearance(motion: Motion, arm: ss.Arm, start: np.ndarray, velocity: np.ndarray) -> float:
    """The least distance of the exact meshes from the ball, sampled every 10 ms."""
    mesh = {link.name: arm.robot.collision_mesh(link.name) for link in arm.robot.links}
    least = np.inf
    for k in range(0, len(motion.positions), 10):
        centre = start + k * PERIOD * velocity
        for name, triangles in mesh.items():
            if triangles is None:
                continue
            pose = arm.robot.pose(motion.positions[k], name)
            local = pose[:3, :3].T @ (centre - pose[:3, 3])
            # Vertices alone: where the ball comes edges are of some mm, fine enough against its 6 cm.
            least = min(least, np.linalg.norm(triangles.vertices - local, axis=1).min() - RADIUS)
    return least


@pytest.mark.parametrize(
    ("name", "speed", "rate", "jitter"),
    [
        ("fr3", 0.1, 30.0, 0.0),
        ("fr3", 0.3, 30.0, 0.4),
        ("fr3", 0.3, 10.0, 0.0),
        ("ur10", 0.2, 30.0, 0.0),
        ("iiwa", 0.2, 60.0, 0.2),
        ("panda", 0.3, 30.0, 0.0),
        ("xarm7", 0.3, 30.0, 0.0),
    ],
)
def test_a_ball_whose_velocity_nobody_told_touches_nothing(
    name: str, speed: float, rate: float, jitter: float
) -> None:
    """Sets of a ball at rest, each nearer than the last: the arm was touched, and pushed deep in."""
    arm = ss.Arm.load(name)
    links = [link.name for link in arm.robot.links if arm.robot.collision_mesh(link.name) is not None]
    direction = np.array([-1.0, 0.0, 0.0]) if name != "ur10" else np.array([1.0, 0.0, 0.0])
    start = arm.robot.pose(arm.neutral, links[-1])[:3, 3] - 0.35 * direction
    velocity = speed * direction
    motion = Motion(
        lambda t: ss.Obstacles([start + t * velocity], RADIUS),
        0.5 / speed,
        rate=rate,
        jitter=jitter,
        name=name,
    )
    assert least_clearance(motion, arm, start, velocity) > 0.003  # [m] that vertices alone may miss
    found = motion.controller.obstacles.velocities[0]
    np.testing.assert_allclose(found, velocity, atol=0.2 * speed)


@pytest.mark.parametrize("what", ["set_arm", "attach"])
@pytest.mark.parametrize("name", ["fr3", "panda"])
def test_another_body_on_the_way_forgets_nothing(name: str, what: str) -> None:
    """A finer cover, or an object that is gripped, while the ball comes: the sets before count on."""
    arm = ss.Arm.load(name)
    links = [link.name for link in arm.robot.links if arm.robot.collision_mesh(link.name) is not None]
    direction = np.array([-1.0, 0.0, 0.0])
    start, velocity = arm.robot.pose(arm.neutral, links[-1])[:3, 3] - 0.35 * direction, 0.3 * direction
    hand = {"fr3": "fr3_hand", "panda": "panda_hand"}[name]

    def change(t: float, controller: ss.Controller) -> None:
        if round(t / PERIOD) == 800:  # the ball is 5 cm away
            if what == "set_arm":
                controller.set_arm(arm)
            else:
                controller.attach("pen", ss.Sphere(0.01), link=hand, pose=pose_at([0.0, 0.0, 0.12]))

    motion = Motion(
        lambda t: ss.Obstacles([start + t * velocity], RADIUS), 1.6, rate=10.0, name=name, change=change
    )
    assert least_clearance(motion, arm, start, velocity) > 0.003  # [m] that vertices alone may miss


def test_an_arm_calms_down_when_the_ball_stops() -> None:
    arm = ss.Arm.load("fr3")
    direction = np.array([-1.0, 0.0, 0.0])
    start = arm.robot.pose(arm.neutral, "fr3_hand")[:3, 3] - 0.35 * direction
    motion = Motion(lambda t: ss.Obstacles([start + min(0.2 * t, 0.24) * direction], RADIUS), 3.0)
    assert motion.moved > 0.01  # [rad] it gave way
    assert "although" not in motion.controller.explain()
    assert motion.speed < 0.1  # of the limits, on its way back to the goal around the ball


def far_point(arm: ss.Arm) -> np.ndarray:
    return arm.robot.pose(arm.neutral, "fr3_hand_tcp")[:3, 3] + np.array([0.3, 0.3, 0.0])


@pytest.mark.parametrize("rate", [10.0, 30.0, 60.0])
@pytest.mark.parametrize("depth", [-0.003, 0.02])
def test_an_arm_does_not_flee_from_a_point_that_flickers(rate: float, depth: float) -> None:
    """In every other set one more point, inside the margin or the hand: the arm fled at its acceleration limits."""
    arm = ss.Arm.load("fr3")
    inside = point_at(arm, -depth)
    count = [0]

    def scene(_: float) -> ss.Obstacles:
        count[0] += 1
        return ss.Obstacles([far_point(arm)] + ([inside] if count[0] % 2 == 0 else []), 0.005)

    motion = Motion(scene, 2.0, rate=rate)
    assert motion.acceleration == 0.0
    assert motion.moved == 0.0
    assert any("waiting until more sets of obstacles confirm it" in words for words in motion.words)


def point_at(arm: ss.Arm, clearance: float, radius: float = 0.005) -> np.ndarray:
    """Beside the hand, as far as that by the covering body [m]."""
    origin = arm.robot.pose(arm.neutral, "fr3_hand")[:3, 3]
    low, high = 0.0, 0.3
    for _ in range(20):
        middle = 0.5 * (low + high)
        controller = ss.Controller(
            arm, ss.ControllerSettings(synchronous=True, planner=None, look_ahead=None)
        )
        controller.set_obstacles(ss.Obstacles([origin + middle * np.array([1.0, 0.0, 0.0])], radius))
        near = controller.step(arm.neutral, np.zeros(arm.num_coordinates)).clearance < clearance
        low, high = (middle, high) if near else (low, middle)
    return origin + np.array([high, 0.0, 0.0])


def test_an_arm_leaves_what_stays_inside_its_margin() -> None:
    """Three sets in a row show it: then the way out begins."""
    arm = ss.Arm.load("fr3")
    inside = point_at(arm, -0.01)
    motion = Motion(lambda t: ss.Obstacles([inside if t > 0.2 else far_point(arm)], 0.005), 1.5)
    still = np.array(motion.positions)[: round(0.25 / PERIOD)]
    assert np.abs(still - arm.neutral).max() == 0.0  # two sets are not enough
    moved = (
        arm.robot.pose(motion.positions[-1], "fr3_hand")[:3, 3]
        - arm.robot.pose(arm.neutral, "fr3_hand")[:3, 3]
    )
    assert (
        np.linalg.norm(moved) > 0.008
    )  # [m] of the 10 mm of depth and 5 mm of margin, along an ellipsoid's normal


@pytest.mark.parametrize("rate", [30.0, 60.0])
def test_noise_of_what_rests_moves_nothing(rate: float) -> None:
    """400 points on a ball 25 mm from the hand, drawn anew with 3 mm of noise in every set."""
    arm = ss.Arm.load("fr3")
    centre = point_at(arm, 0.025, RADIUS)
    random = np.random.default_rng(2)

    def scene(_: float) -> ss.Obstacles:
        u = random.normal(size=(400, 3))
        u /= np.linalg.norm(u, axis=1)[:, None]
        return ss.Obstacles(centre + u * (RADIUS + 0.003 * random.normal(size=(400, 1))), 0.0)

    motion = Motion(scene, 4.0, rate=rate, jitter=0.2)
    assert motion.acceleration == 0.0
    assert not any("although" in words for words in motion.words)


def test_the_same_obstacles_again_change_no_bit() -> None:
    """What rests: setting it again changes nothing."""
    arm = ss.Arm.load("fr3")
    box = ss.Box((0.2, 0.2, 0.2), pose_at([0.55, 0.35, 0.4]))
    motions = []
    for again in (False, True):
        controller = ss.Controller(arm, ss.ControllerSettings(output="acceleration", synchronous=True))
        controller.set_goal(arm.neutral + np.array([0.8, 0.2, 0.0, 0.3, 0.0, 0.0, 0.0]))
        controller.set_obstacles(box)
        q, v, positions = arm.neutral.copy(), np.zeros(7), []
        for k in range(800):
            if again and k % 33 == 0:
                controller.set_obstacles(box)
            command = controller.step(q, v)
            v = v + PERIOD * command.acceleration
            q = q + PERIOD * v
            positions.append(q)
        motions.append(np.array(positions))
    assert (motions[0] == motions[1]).all()
