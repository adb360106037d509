"""Pairs of links with barriers: where samples say that two links touch, their barrier is at its end."""

from pathlib import Path

import numpy as np
import pytest

from sidestep import Body, Obstacles, Robot
from sidestep.arm.link_pairs import NEAR, barrier_pairs
from sidestep.distance import SelfCollision
from sidestep.system import SelfCollisionBarrier


@pytest.fixture(autouse=True)
def cache_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("SIDESTEP_CACHE_DIR", str(tmp_path))
    return tmp_path


@pytest.mark.slow
def test_links_that_touch_have_no_clearance_left() -> None:
    robot = Robot.named("planar3")
    body = Body.cover(robot, components=4)
    (pair,) = barrier_pairs(robot, body)
    assert pair[:2] == ("link1", "link3")
    assert -0.05 < pair[2] <= 0.0  # [m] the links are some 5 cm thick
    barrier, check = SelfCollisionBarrier(robot, body, [pair]), SelfCollision(robot)
    rng, samples, touching, freed = np.random.default_rng(1), 3000, 0, 0
    for _ in range(samples):
        q = robot.random_configuration(rng)
        clearance = barrier.evaluate(q, np.zeros(3), Obstacles.none()).clearances[0]
        if check.touching(q):
            touching += 1
            assert clearance <= NEAR  # [m] other samples than those that it was measured by
        elif clearance > 0.0:
            freed += 1
    assert touching > 50
    assert freed > 0.95 * (samples - touching)


def test_what_lies_between_two_links() -> None:
    check = SelfCollision(Robot.named("planar3"))
    assert check.coordinates_between("link3", "link1") == (1, 2)
    folded = np.array([0.3, 2.6, 2.6])
    assert check.distance_between(folded, "link1", "link3") == 0.0
    straight = np.zeros(3)
    assert check.distance_between(straight, "link1", "link3") == check.distance(straight).distance > 0.1
    assert check.within(folded, "link1", "link3", 0.0)
    distance = check.distance_between(np.array([0.0, 1.9, 1.6]), "link1", "link3")
    assert distance > 0.01
    assert check.within(np.array([0.0, 1.9, 1.6]), "link1", "link3", 1.001 * distance)
    assert not check.within(np.array([0.0, 1.9, 1.6]), "link1", "link3", 0.999 * distance)
    with pytest.raises(ValueError, match=r"\(link1, link2\) is not checked"):
        check.distance_between(straight, "link1", "link2")


def test_a_contact_moves_the_clearance_by_as_much() -> None:
    robot = Robot.named("planar3")
    body = Body.cover(robot, components=4)
    q, v = np.array([0.0, 1.9, 1.6]), np.array([0.3, -0.2, 0.1])
    plain = SelfCollisionBarrier(robot, body, [("link1", "link3")], reach=1.0).evaluate(
        q, v, Obstacles.none()
    )
    moved = SelfCollisionBarrier(robot, body, [("link1", "link3", -0.01)], reach=1.0).evaluate(
        q, v, Obstacles.none()
    )
    np.testing.assert_allclose(moved.clearances, plain.clearances + 0.01, atol=1e-15)
    np.testing.assert_allclose(moved.clearance_rates, plain.clearance_rates, atol=1e-15)
    with pytest.raises(ValueError, match="'link1' and 'link3' is nan m, must be finite"):
        SelfCollisionBarrier(robot, body, [("link1", "link3", float("nan"))])


@pytest.mark.slow
def test_pairs_are_kept_and_made_again_where_they_cannot_be_read(cache_folder: Path) -> None:
    robot = Robot.named("planar3")
    body = Body.cover(robot, components=4)
    pairs = barrier_pairs(robot, body)
    (path,) = (cache_folder / "pairs").iterdir()
    path.write_text('{"contact": -0.25}')
    assert barrier_pairs(robot, body) == (("link1", "link3", -0.25),)  # it is read
    path.write_text("[[")
    with pytest.warns(RuntimeWarning, match="is unreadable and is made again"):
        assert barrier_pairs(robot, body) == pairs
    assert barrier_pairs(robot, body) == pairs  # and written again
    barrier_pairs(robot, Body.cover(robot, components=5))
    assert len(list((cache_folder / "pairs").iterdir())) == 2
