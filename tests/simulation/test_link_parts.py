"""Convex parts of links: they hold the meshes, and bound distances and travel."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial import ConvexHull

from sidestep import Robot, SelfCollision
from sidestep.simulation.link_parts import LinkPart, PairsOfParts, link_parts


@pytest.fixture(scope="module")
def checked() -> SelfCollision:
    return SelfCollision(Robot.named("ur10"), samples=20)


def test_parts_hold_the_mesh() -> None:
    robot = Robot.named("ur10")
    parts = link_parts(robot, "upper_arm_link")
    assert len(parts) > 1
    mesh = robot.collision_mesh("upper_arm_link")
    assert mesh is not None
    points = np.concatenate([mesh.vertices, mesh.triangles_center])
    beyond = [ConvexHull(p.corners).equations @ np.c_[points, np.ones(len(points))].T for p in parts]
    assert (
        np.min([planes.max(axis=0) for planes in beyond], axis=0).max() < 1e-6
    )  # [m] single precision of STL
    for part in parts:
        assert np.linalg.norm(part.corners - part.center, axis=1).max() == pytest.approx(part.radius)


def test_gaps_of_parts_are_no_more_than_the_distance(checked: SelfCollision) -> None:
    robot, parts = checked.robot, checked._parts
    assert len(parts.links) > len(checked.pairs)
    names = checked._names
    rng = np.random.default_rng(1)
    tight = []
    for _ in range(5):
        q = robot.random_configuration(rng)
        poses = np.array([robot.pose(q, name) for name in names])
        balls = parts.balls_apart(poses[None])[0]
        for index, pair in enumerate(checked.pairs):
            a, b = (names.index(name) for name in pair)
            of_pair = np.flatnonzero(parts.links == index)
            hulls = np.array([parts.hulls_apart(int(k), poses[a], poses[b]) for k in of_pair])
            distance = checked.distance_between(q, *pair)
            assert np.all(balls[of_pair] <= hulls + 2e-5)  # the error taken off, and GJK's own
            assert hulls.min() <= distance
            tight.append(distance - hulls.min())
    assert np.median(tight) < 1e-3  # of 5 to 1000 mm: that is why they are worth it


def test_parts_come_closer_by_no_more_than_their_travel(checked: SelfCollision) -> None:
    robot, parts, names = checked.robot, checked._parts, checked._names
    rng = np.random.default_rng(2)
    for _ in range(5):
        q = robot.random_configuration(rng)
        step = 0.1 * rng.normal(size=q.shape)
        apart = []
        for at in (q, q + step):
            poses = {name: robot.pose(at, name) for name in names}
            ends = [checked.pairs[index] for index in parts.links]
            apart.append([parts.hulls_apart(k, poses[a], poses[b]) for k, (a, b) in enumerate(ends)])
        change = np.abs(np.diff(np.maximum(apart, 0.0), axis=0)[0])
        assert np.all(change <= parts.travel @ np.abs(step) + 2e-5)  # GJK's error, twice
        assert np.any(change > 0.1 * parts.travel @ np.abs(step))


def test_a_part_far_from_the_joints_travels_more(checked: SelfCollision) -> None:
    """The upper arm seen from the base: its parts have lever arms of their own about the shoulder."""
    index = checked.pairs.index(("base_link", "upper_arm_link"))
    shoulder = checked._parts.travel[checked._parts.links == index][:, 1]
    assert shoulder.min() < 0.4 < 0.6 < shoulder.max()  # [m]: the hub and the elbow, 0.612 m from it


def test_a_flat_link_is_its_mesh(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sidestep.simulation.link_parts.convex_parts", lambda triangles: ())
    robot = Robot.named("planar3")
    (part,) = link_parts(robot, "link1")
    assert isinstance(part, LinkPart)
    pairs = SelfCollision(robot)
    assert isinstance(pairs._parts, PairsOfParts)
    folded, straight = np.array([0.0, 2.6, 2.6]), np.zeros(3)
    assert pairs.minimum_over(np.array([straight, folded])).distance == 0.0
