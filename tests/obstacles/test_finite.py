"""Obstacles stay finite."""

import numpy as np
import pytest

import sidestep as ss
from sidestep.system import ClearanceBarrier, GeometricSystem


def moving() -> ss.Obstacles:
    return ss.Obstacles([[0.5, 0.0, 0.0], [0.0, 0.5, 0.0]], 0.1, [[0.1, 0.0, 0.0], [0.0, 0.0, 1e300]])


@pytest.mark.parametrize("duration", [np.nan, np.inf, -np.inf, 1e300, 1e9, -1e9])
def test_a_duration_that_leads_out_of_the_finite_moves_nothing(duration):
    obstacles = moving()
    with pytest.raises(
        ValueError, match=r"duration is .* s, must be finite, as must be where it takes the points"
    ):
        obstacles.advance(duration)
    np.testing.assert_array_equal(obstacles.points, moving().points)
    obstacles.advance(1e-295)
    assert obstacles.points[1, 2] == pytest.approx(1e5)


def test_obstacles_at_rest_refuse_it_too():
    with pytest.raises(ValueError, match="duration is nan"):
        ss.Obstacles([[0.5, 0.0, 0.0]]).advance(np.nan)


@pytest.mark.parametrize(
    ("points", "radii", "message"),
    [
        ([[0, 0, 0], [np.inf, 0, 0]], 0.0, "point 1 is not finite"),
        ([[1e39, 0, 0]], 1e39, "point 0 has radius .*, must be finite, >= 0 and at most 1e9 m"),
    ],
)
def test_what_single_precision_does_not_hold_is_refused(points, radii, message):
    with pytest.raises(ValueError, match=message):
        ss.Obstacles(points, radii)


def test_a_motion_that_overflows_leaves_the_arm_seeing():
    robot = ss.Robot.named("planar2")
    body = ss.Body(
        links=["link1", "link2"],
        weights=[1, 1],
        means=np.tile([0.25, 0, 0], (2, 1)),
        covariances=np.tile(np.diag([0.27, 0.05, 0.05]) ** 2, (2, 1, 1)),
        levels=[1, 1],
    )
    system = GeometricSystem([ClearanceBarrier(robot, body, reach=1.0)])
    obstacles = ss.Obstacles([[0.9, 0.45, 0.0], [9.0, 0.0, 0.0]], 0.05, [[0, 0, 0], [1e307, 0, 0]])
    q = np.array([0.1, 0.2])
    seen = np.array(system.acceleration(q, 0 * q, q, obstacles).clearances.values)
    with pytest.raises(ValueError, match="duration is 100"):
        obstacles.advance(100.0)
    after = system.acceleration(q, 0 * q, q, obstacles)
    assert np.isfinite(after.clearances.values).any()
    np.testing.assert_array_equal(after.clearances.values, seen)


def test_points_of_which_none_is_near_are_warned_of(recwarn: pytest.WarningsRecorder) -> None:
    points = np.array([[0.5, 0.6, 0.7], [0.9, 0.2, 0.3]])
    with pytest.warns(
        RuntimeWarning, match=r"farther than 100 m, the nearest is at \[500, 600, 700\] m; are they"
    ):
        far = ss.Obstacles(1000.0 * points, 0.01)
    np.testing.assert_array_equal(far.points, 1000.0 * points)
    recwarn.clear()
    ss.Obstacles(points)
    ss.Obstacles(np.vstack([1000.0 * points, points]))  # one wall that is far
    ss.Obstacles([[150.0, 0.0, 0.0]], 149.0)  # a ball that reaches to the arm
    assert not recwarn.list


def test_what_is_no_array_is_named() -> None:
    for make in (
        lambda: ss.Obstacles(None),  # type: ignore[arg-type]
        lambda: ss.Obstacles([[1.0, 0.0, 0.0]], None),  # type: ignore[arg-type]
        lambda: ss.Sphere(0.1, None),  # type: ignore[arg-type]
    ):
        with pytest.raises(
            TypeError, match=r"(points|radii|pose) is None, must be an array of real numbers$"
        ):
            make()


def test_points_that_are_not_finite_are_counted_and_it_is_said_what_to_do() -> None:
    points = np.random.default_rng(0).uniform(size=(50, 3))
    points[::7] = np.nan
    with pytest.raises(
        ValueError, match=r"point 0 is not finite, as are 8 of all 50; leave out .*np.isfinite"
    ) as error:
        ss.Obstacles(points)
    kept = points[np.isfinite(points).all(axis=1)]  # as the error says
    assert "points[np.isfinite(points).all(axis=1)]" in str(error.value)
    assert len(ss.Obstacles(kept)) == 42
