"""Self-collision on exact meshes: which pairs count, and the smallest distance of a motion."""

from __future__ import annotations

import numpy as np
import pytest

from sidestep import Robot
from sidestep.distance import SelfCollision, self_collision, sweep


@pytest.fixture(scope="module")
def planar() -> SelfCollision:
    return SelfCollision(Robot.named("planar3"))


@pytest.fixture(scope="module")
def fr3() -> SelfCollision:
    return SelfCollision(Robot.named("fr3"), samples=20)


def test_adjacent_and_rigid_pairs_are_left_out_and_named(fr3: SelfCollision) -> None:
    assert fr3.left_out["fr3_link3", "fr3_link4"] == "adjacent"
    assert fr3.left_out["fr3_hand", "fr3_leftfinger"] == "rigid"
    assert ("fr3_link5", "fr3_link7") in fr3.pairs
    assert not set(fr3.pairs) & set(fr3.left_out)


def test_a_folded_arm_touches_itself(planar: SelfCollision) -> None:
    assert planar.pairs == (("link1", "link3"),)
    assert planar.touching(np.zeros(3)) == ()
    assert planar.touching(np.array([0.0, 2.6, 2.6])) == (("link1", "link3"),)
    assert planar.distance(np.array([0.0, 2.6, 2.6])).distance == 0.0


def test_a_pair_may_be_allowed_to_touch() -> None:
    check = SelfCollision(Robot.named("planar3"), allowed=[("link3", "link1")])
    assert check.left_out["link1", "link3"] == "allowed"
    assert check.distance(np.array([0.0, 2.6, 2.6])).pair == ()
    with pytest.raises(ValueError, match="nowhere"):
        SelfCollision(Robot.named("planar3"), allowed=[("link1", "nowhere")])


def test_what_always_touches_is_left_out(monkeypatch: pytest.MonkeyPatch) -> None:
    robot = Robot.named("planar3")
    folded = np.array([0.0, 2.6, 2.6])
    monkeypatch.setattr(robot, "random_configuration", lambda rng: folded)
    assert SelfCollision(robot, samples=5).left_out["link1", "link3"] == "always"


@pytest.mark.slow
def test_the_minimum_of_a_motion_is_that_of_dense_samples(fr3: SelfCollision) -> None:
    rng = np.random.default_rng(3)
    for _ in range(3):
        path = np.array([fr3.robot.random_configuration(rng) for _ in range(3)])
        found = fr3.minimum_over(path, tolerance=1e-3)
        at = np.linspace(0.0, 2.0, 401)
        dense = min(
            fr3.distance(np.array([np.interp(t, range(3), path[:, j]) for j in range(7)])).distance
            for t in at
        )
        # never above the densest look by more than its tolerance, and a distance that really occurs
        assert found.distance <= dense + 1e-3
        here = [np.interp(found.sample, range(3), path[:, j]) for j in range(7)]
        assert fr3.distance(np.array(here)).distance == pytest.approx(found.distance, abs=1e-9)


def test_a_diverged_motion_ends(monkeypatch: pytest.MonkeyPatch, planar: SelfCollision) -> None:
    monkeypatch.setattr(sweep, "FINE_CHECKS", 300)
    calls = []
    apart = self_collision.hulls_apart
    monkeypatch.setattr(self_collision, "hulls_apart", lambda *given: calls.append(1) or apart(*given))
    waving = np.zeros((10_000, 3))
    waving[1::2, 2] = 2.0  # there and back; link 3 never comes to link 1
    least = planar.distance(waving[1]).distance
    assert least > 0.1
    found = planar.minimum_over(waving)
    assert least <= found.distance  # how far above, no tolerance says any more; but it occurs
    there = planar.distance(np.array([0.0, 0.0, 2.0 * (1.0 - abs(found.sample % 2.0 - 1.0))]))
    assert found.distance == pytest.approx(there.distance, abs=1e-9)
    first_looks = 16 * len(planar._pairs_of_parts)
    assert 300 < len(calls) <= 2 * 300 + first_looks + 1  # fine, coarse, the first guess, one above


def test_a_touch_between_samples_is_found(planar: SelfCollision) -> None:
    """Both ends are free; link 3 turns through link 1 on the way."""
    ends = np.array([[0.0, 2.6, 1.2], [0.0, 2.6, 2.0 * np.pi - 2.7]])
    assert not any(planar.touching(q) for q in ends)
    assert planar.minimum_over(ends).distance == 0.0


def test_bad_trajectories_are_refused(planar: SelfCollision) -> None:
    with pytest.raises(ValueError, match="shape"):
        planar.minimum_over(np.zeros((2, 4)))
    with pytest.raises(ValueError, match="finite"):
        planar.minimum_over(np.full((2, 3), np.nan))
    with pytest.raises(ValueError, match="tolerance"):
        planar.minimum_over(np.zeros((2, 3)), tolerance=0.0)


def test_travel_bounds_how_far_two_links_approach() -> None:
    robot = Robot.named("planar3")
    check, rng = SelfCollision(robot), np.random.default_rng(0)
    travel = check.travel_between("link1", "link3")
    assert travel[0] == 0.0  # turns both
    assert (travel[1:] > 0.2).all()  # [m/rad] levers of links of some 0.3 m
    for _ in range(200):
        q, step = robot.random_configuration(rng), rng.uniform(-0.3, 0.3, 3)
        lost = check.distance_between(q, "link1", "link3") - check.distance_between(
            q + step, "link1", "link3"
        )
        assert lost <= travel @ np.abs(step) + 1e-9  # rounding
