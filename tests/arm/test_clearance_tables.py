"""Tables of exact clearances: near the distance of the meshes, never far above, and stored."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from sidestep import Body, Obstacles, Robot, shipped_arms
from sidestep._core import BarrierSettings, CoordinateKind
from sidestep.arm.clearance_tables import clearance_tables
from sidestep.arm.link_pairs import barrier_pairs
from sidestep.bench.methods import barrier_system
from sidestep.distance import SelfCollision
from sidestep.storage import user_cache
from sidestep.system import ClearanceTable, ClearanceTableBarrier


@pytest.fixture
def _nothing_stored(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(user_cache.CACHE_VARIABLE, str(tmp_path))
    monkeypatch.setattr(shipped_arms, "FOLDER", tmp_path / "nothing")


@pytest.mark.usefixtures("_nothing_stored")
def test_a_table_is_near_the_distance_and_not_above() -> None:
    robot = Robot.named("planar3")
    found = clearance_tables(robot)
    (table,) = found.tables
    assert found.pairs == ((table.first, table.second),) == (("link1", "link3"),)
    assert table.coordinates == (1, 2)
    check, rng = SelfCollision(robot), np.random.default_rng(1)
    apart, errors, touching = 0, [], 0
    for _ in range(4000):
        q = robot.random_configuration(rng)
        h = table.at(q[1], q[2])[0]
        exact = check.distance_between(q, "link1", "link3")
        if exact == 0.0:
            touching += 1
            assert h < 0.0
        else:
            apart += 1
            # Other samples than those that it was measured by: what it exceeds stays within the floor of the barrier.
            assert h < exact + BarrierSettings().floor
            errors.append(exact - h)
    assert touching > 100
    # A quarter of the spacing of 0.1 rad on a lever of 0.3 m, where creases are smoothed.
    assert np.quantile(errors, 0.9) < 0.0075
    again = clearance_tables(robot).tables[0]  # from its file
    np.testing.assert_array_equal(again.control, table.control)
    assert (again.begin, again.spacing, again.periodic) == (table.begin, table.spacing, table.periodic)


@pytest.mark.usefixtures("_nothing_stored")
def test_a_file_that_cannot_be_read_is_made_again(tmp_path: Path) -> None:
    robot = Robot.named("planar3")
    clearance_tables(robot)
    (path,) = (tmp_path / "tables").iterdir()
    path.write_bytes(b"PK no JSON at all")
    with pytest.warns(
        RuntimeWarning, match="clearance table of a pair in the cache is unreadable and is made again"
    ):
        again = clearance_tables(robot)
    assert len(again.tables) == 1
    assert clearance_tables(robot).pairs == again.pairs


def test_pairs_said_to_be_apart_are() -> None:
    robot = Robot.named("fr3")
    found = clearance_tables(robot)
    assert found.tables == ()
    assert ("fr3_link5", "fr3_link7") in found.apart
    check, rng = SelfCollision(robot), np.random.default_rng(2)
    for _ in range(100):
        q = robot.random_configuration(rng)
        assert min(check.distance_between(q, *pair) for pair in found.apart) > 0.0
    body = Body.cover(robot)
    left = [pair for pair in barrier_pairs(robot, body) if pair[:2] not in found.pairs]
    kinds = [label.kind for label in barrier_system(robot, body).labels]
    assert 0 < len(left) < len(check.pairs)
    assert kinds.count(CoordinateKind.self) == len(left)


def table(**changes: object) -> ClearanceTable:
    given = {
        "coordinates": (0, 1),
        "begin": (-0.3, -np.pi),
        "spacing": (0.1, 2.0 * np.pi / 5),
        "periodic": (False, True),
        "control": np.arange(35.0).reshape(7, 5),
    }
    return ClearanceTable("link1", "link2", **(given | changes))  # type: ignore[arg-type]


def test_between_control_points_of_a_parabola() -> None:
    """B-splines keep lines, and lift a parabola by a third of the square of the spacing."""
    x = -0.3 + 0.1 * np.arange(7)
    parabola = table(control=np.repeat((x**2 - 0.2 * x)[:, None], 5, axis=1))
    for at, angle in ((-0.2, 0.3), (0.07, -9.0), (0.2, 40.0)):
        value, gradient, hessian = parabola.at(at, angle)
        assert value == pytest.approx(at**2 - 0.2 * at + 0.01 / 3.0, abs=1e-12)  # rounding
        np.testing.assert_allclose(gradient, [2.0 * at - 0.2, 0.0], atol=1e-12)
        np.testing.assert_allclose(hessian, [[2.0, 0.0], [0.0, 0.0]], atol=1e-10)
    assert parabola.at(0.7, 0.0)[0] == parabola.at(0.2, 0.0)[0]  # beyond its end
    wave = table(control=np.repeat(np.cos(np.arange(5))[None], 7, axis=0))
    assert wave.at(0.0, 1.0)[0] == pytest.approx(wave.at(0.0, 1.0 + 4.0 * np.pi)[0], abs=1e-12)
    assert wave.at(0.0, np.pi - 1e-9)[0] == pytest.approx(wave.at(0.0, -np.pi)[0], abs=1e-8)
    assert np.isnan(wave.at(np.nan, 0.0)[0])
    assert np.isnan(wave.at(0.0, np.inf)[0])


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"coordinates": (1, 1)}, "both coordinates are 1, must differ"),
        ({"coordinates": (-1, 1)}, "coordinate is -1, must be from 0"),
        ({"spacing": (0.0, 1.0)}, "spacing is 0.0*, must be positive and finite"),
        ({"spacing": (0.1, 0.1)}, "periodic control points span 0.5.* rad, must be 2 pi"),
        ({"begin": (np.nan, 0.0)}, "begin is nan, must be finite"),
        ({"control": np.zeros((3, 5))}, "there are 3 control points in a direction, must be at least 4"),
        ({"control": np.full((7, 5), np.inf)}, "control"),
        ({"control": np.zeros(7)}, r"control"),
    ],
)
def test_what_is_wrong_with_a_table_is_named(changes: dict[str, object], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        table(**changes)


def test_what_is_wrong_with_a_barrier_of_tables_is_named() -> None:
    robot = Robot.named("planar2")
    with pytest.raises(ValueError, match="there is no table"):
        ClearanceTableBarrier(robot, [])
    with pytest.raises(ValueError, match="coordinate is 5, must be from 0 to 1"):
        ClearanceTableBarrier(robot, [table(coordinates=(0, 5))])
    with pytest.raises(ValueError, match="reach is inf"):
        ClearanceTableBarrier(robot, [table()], reach=np.inf)
    barrier = ClearanceTableBarrier(robot, [table(control=np.full((7, 5), 0.02))])
    evaluation = barrier.evaluate(np.zeros(2), np.zeros(2), Obstacles.none())
    # 0.02 (0.05/0.02 - 1)^2 of the default barrier
    assert evaluation.values[0] == pytest.approx(0.045, abs=1e-12)
    assert clearance_tables(robot).pairs == ()
