"""Convex parts of links: they hold the meshes, and bound distances and travel."""

from __future__ import annotations

import coal
import numpy as np
import pytest
from scipy.spatial import ConvexHull

from sidestep import Robot
from sidestep.distance import SelfCollision
from sidestep.distance.link_parts import LinkParts, hulls_apart

Array = np.ndarray


@pytest.fixture(scope="module")
def checked() -> SelfCollision:
    return SelfCollision(Robot.named("ur10"), samples=20)


def _hulls(checked: SelfCollision, q: Array) -> Array:
    """(K,) lower bounds of all pairs of parts."""
    placed = [
        coal.Transform3s(X[:3, :3], X[:3, 3]) for X in (checked.robot.pose(q, n) for n in checked._names)
    ]
    link, parts = checked._parts.link, checked._parts.parts
    return np.array(
        [
            hulls_apart(parts[a].shape, placed[link[a]], parts[b].shape, placed[link[b]])
            for _, a, b in checked._pairs_of_parts
        ]
    )


def test_parts_hold_the_mesh() -> None:
    robot = Robot.named("ur10")
    (parts,) = LinkParts(robot, ["upper_arm_link"]).of_link
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
    assert len(checked._pairs_of_parts) > len(checked.pairs)
    _, a, b = np.array(checked._pairs_of_parts).T
    of_pair = np.array([index for index, _, _ in checked._pairs_of_parts])
    rng = np.random.default_rng(1)
    tight = []
    for _ in range(5):
        q = checked.robot.random_configuration(rng)
        centers, hulls = checked._parts.centers(q[None], np.zeros(1))[0], _hulls(checked, q)
        balls = (
            np.linalg.norm(centers[a] - centers[b], axis=1)
            - checked._parts.radii[a]
            - checked._parts.radii[b]
        )
        assert np.all(
            np.maximum(balls, 0.0) <= np.maximum(hulls, 0.0) + 2e-5
        )  # the error taken off, and GJK's own
        for index, pair in enumerate(checked.pairs):
            distance = checked.distance_between(q, *pair)
            assert hulls[of_pair == index].min() <= distance
            tight.append(distance - hulls[of_pair == index].min())
    assert np.median(tight) < 1e-3  # [m] of 5 to 1000 mm: that is why they are worth it


def test_parts_come_closer_by_no_more_than_their_travel(checked: SelfCollision) -> None:
    rng = np.random.default_rng(2)
    for _ in range(5):
        q = checked.robot.random_configuration(rng)
        step = 0.1 * rng.normal(size=q.shape)
        before, after = (np.maximum(_hulls(checked, at), 0.0) for at in (q, q + step))
        allowed = checked._travel @ np.abs(step)
        assert np.all(np.abs(after - before) <= allowed + 2e-5)  # GJK's error, twice
        assert np.any(np.abs(after - before) > 0.1 * allowed)


def test_a_part_far_from_the_joints_travels_more(checked: SelfCollision) -> None:
    """The upper arm seen from the base: its parts have lever arms of their own about the shoulder."""
    index = checked.pairs.index(("base_link", "upper_arm_link"))
    shoulder = checked._travel[[i == index for i, _, _ in checked._pairs_of_parts]][:, 1]
    assert shoulder.min() < 0.4 < 0.6 < shoulder.max()  # [m]: the hub and the elbow, 0.612 m from it


def test_a_link_without_volume_is_its_mesh(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sidestep.distance.link_parts.convex_parts", lambda triangles: ())
    monkeypatch.setattr("sidestep.distance.link_parts.hull_model", lambda corners: None)
    robot = Robot.named("planar3")
    ((part,),) = LinkParts(robot, ["link1"]).of_link
    assert isinstance(part.shape, coal.BVHModelOBBRSS)
    folded, straight = np.array([0.0, 2.6, 2.6]), np.zeros(3)
    assert SelfCollision(robot).minimum_over(np.array([straight, folded])).distance == 0.0
