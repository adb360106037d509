"""Exact clearance against closed forms, brute force, and obstacles that fall between two samples."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from sidestep import ExactClearance, Robot, SceneObject
from sidestep.distance import sweep
from sidestep.distance.travel import travel_per_joint
from sidestep.math.pose import from_quaternion, pose_vector

STRETCHED = np.zeros(2)  # planar2: link2 is a box from x = 0.5 to 1, y and z within half its width


def _placed(x: float, y: float, z: float) -> np.ndarray:
    pose = np.eye(4)
    pose[:3, 3] = x, y, z
    return pose


def _half_width() -> float:
    mesh = Robot.named("planar2").collision_mesh("link2")
    assert mesh is not None
    return float(mesh.bounds[1, 1])


def _box_distance(point: np.ndarray, low: np.ndarray, high: np.ndarray) -> float:
    """Signed distance of a point to a solid box, in closed form."""
    outside = np.maximum(np.maximum(low - point, point - high), 0.0)
    if outside.any():
        return float(np.linalg.norm(outside))
    return -float(np.minimum(point - low, high - point).min())


def test_ball_distance_is_exact_outside_across_and_inside_the_surface() -> None:
    robot = Robot.named("planar2")
    w = _half_width()
    rng = np.random.default_rng(1)
    for _ in range(200):
        center = rng.uniform([0.1, -2 * w, -2 * w], [0.4, 2 * w, 2 * w])
        ball = SceneObject.ball("ball", center, radius=0.6 * w)
        found = ExactClearance(robot, [ball]).distance(STRETCHED)
        # link1 alone is the nearest: a box from x = 0 to 0.5
        expected = _box_distance(center, np.array([0.0, -w, -w]), np.array([0.5, w, w])) - 0.6 * w
        assert found.distance == pytest.approx(expected, abs=1e-7)  # Coal's own tolerance is 1e-8
        assert found.link == "link1"


def test_nearest_points_and_names() -> None:
    w = _half_width()
    ball = SceneObject.ball("ball", [0.75, 0.3, 0.0], radius=0.05)
    far = SceneObject.ball("far", [3.0, 0.0, 0.0], radius=0.05)
    found = ExactClearance(Robot.named("planar2"), [far, ball]).distance(STRETCHED)
    assert (found.link, found.obstacle) == ("link2", "ball")
    np.testing.assert_allclose(found.point_on_link, [0.75, w, 0.0], atol=1e-6)
    np.testing.assert_allclose(found.point_on_obstacle, [0.75, 0.25, 0.0], atol=1e-6)
    assert found.distance == pytest.approx(0.25 - w, abs=1e-7)


def test_empty_scene() -> None:
    exact = ExactClearance(Robot.named("planar2"), [])
    assert exact.distance(STRETCHED).distance == np.inf
    assert exact.minimum_over(np.zeros((3, 2))).clearance.distance == np.inf
    np.testing.assert_array_equal(exact.series(np.zeros((3, 2))), np.full(3, np.inf))


def test_box_and_cylinder_and_mesh_apart() -> None:
    robot, w = Robot.named("planar2"), _half_width()
    pose = _placed(0.75, 0.3, 0.0)
    side = trimesh.creation.box(extents=(0.1, 0.1, 0.1))
    for item in (
        SceneObject("box", "box", size=(0.1, 0.1, 0.1), pose=pose),
        SceneObject("cylinder", "cylinder", size=(0.05, 0.2), pose=pose),
        SceneObject("mesh", "mesh", pose=pose, mesh=side),
    ):
        found = ExactClearance(robot, [item]).distance(STRETCHED)
        assert found.distance == pytest.approx(0.25 - w, abs=1e-6), (
            item.name
        )  # GJK's tolerance on curved shapes


@pytest.mark.parametrize("kind", ["sphere", "box", "mesh"])
def test_what_is_wholly_inside_a_link_overlaps(kind: str) -> None:
    """The mesh is hollow for Coal: without the winding number these would count as clear."""
    r = 0.2 * _half_width()
    pose = _placed(0.75, 0.0, 0.0)
    item = {
        "sphere": SceneObject("inside", "sphere", size=(r,), pose=pose),
        "box": SceneObject("inside", "box", size=(r, r, r), pose=pose),
        "mesh": SceneObject("inside", "mesh", pose=pose, mesh=trimesh.creation.box(extents=(r, r, r))),
    }[kind]
    assert ExactClearance(Robot.named("planar2"), [item]).distance(STRETCHED).distance < 0.0


@pytest.mark.parametrize("kind", ["sphere", "box", "mesh"])
def test_a_link_wholly_inside_an_object_overlaps(kind: str) -> None:
    item = {
        "sphere": SceneObject.ball("around", [0.75, 0, 0], radius=2.0),
        "box": SceneObject("around", "box", size=(4, 4, 4)),
        "mesh": SceneObject("around", "mesh", mesh=trimesh.creation.box(extents=(4, 4, 4))),
    }[kind]
    assert ExactClearance(Robot.named("planar2"), [item]).distance(STRETCHED).distance < 0.0


def test_thin_obstacle_between_two_samples_is_found() -> None:
    """A 1 mm needle that a quarter turn sweeps over: free at both samples, hit in between."""
    robot = Robot.named("planar2")
    at = 0.8 * np.array([np.cos(0.7), np.sin(0.7)])
    needle = SceneObject("needle", "cylinder", size=(5e-4, 0.5), pose=_placed(at[0], at[1], 0.0))
    exact = ExactClearance(robot, [needle])
    samples = np.array([[0.0, 0.0], [np.pi / 2, 0.0]])
    assert exact.series(samples).min() > 0.3
    worst = exact.minimum_over(samples)
    assert worst.clearance.distance <= 0.0
    assert worst.clearance.link == "link2"
    assert worst.sample * np.pi / 2 == pytest.approx(0.7, abs=0.1)  # the link is 0.1 rad wide from there


@pytest.mark.parametrize("kind", ["flat", "box", "needle", "inside"])
def test_objects_of_every_shape_bound_the_distance_from_below(kind: str) -> None:
    """The motion's minimum is the distance where it was found, and dense samples have none smaller."""
    box = trimesh.creation.box(extents=(0.1, 0.1, 0.1))
    flat = trimesh.Trimesh([[0, 0, 0], [0.1, 0, 0], [0, 0.1, 0], [0.1, 0.1, 0]], [[0, 1, 2], [1, 3, 2]])
    item = {
        "flat": SceneObject("item", "mesh", pose=_placed(0.6, 0.7, 0.3), mesh=flat),  # no volume
        "box": SceneObject("item", "mesh", pose=_placed(0.6, 0.7, 0.3), mesh=box),
        "needle": SceneObject("item", "cylinder", size=(5e-4, 0.5), pose=_placed(0.8, 0.8, 0.0)),
        "inside": SceneObject(
            "item", "mesh", mesh=trimesh.creation.box(extents=(4, 4, 4))
        ),  # hollow, around all
    }[kind]
    exact = ExactClearance(Robot.named("planar2"), [item])
    samples = np.array([[0.0, 0.0], [np.pi / 2, 0.3]])
    worst = exact.minimum_over(samples)
    dense = exact.series(np.linspace(*samples, 2001)).min()
    assert dense - 1e-3 <= worst.clearance.distance <= dense + 1e-3
    at = samples[0] + worst.sample * (samples[1] - samples[0])
    assert exact.distance(at).distance == pytest.approx(worst.clearance.distance, abs=1e-9)


def test_flying_ball_between_two_samples_is_found() -> None:
    robot = Robot.named("planar2")
    ball = SceneObject.ball("ball", [0.7, -1.0, 0.0], radius=1e-3)
    poses = np.array([[pose_vector(_placed(0.7, y, 0.0))] for y in (-1.0, 1.0)])
    exact = ExactClearance(robot, [ball])
    still = np.zeros((2, 2))
    assert exact.series(still, poses).min() > 0.9
    assert exact.minimum_over(still, poses).clearance.distance < 0.0


def test_turning_bar_between_two_samples_is_found() -> None:
    robot = Robot.named("planar2")
    bar = SceneObject("bar", "box", size=(0.6, 2e-3, 2e-3), pose=_placed(1.25, 0.0, 0.0))
    exact = ExactClearance(robot, [bar])
    turns = np.linspace(np.pi / 2, -np.pi / 2, 2001) / 2
    center = np.broadcast_to([1.25, 0.2, 0.0], (2001, 3))
    quaternions = np.column_stack([np.cos(turns), 0 * turns, 0 * turns, np.sin(turns)])
    poses = np.column_stack([center, quaternions])[:, None, :]
    dense = exact.series(np.zeros((2001, 2)), poses).min()
    assert exact.series(np.zeros((2, 2)), poses[[0, -1]]).min() > dense + 0.05
    worst = exact.minimum_over(np.zeros((2, 2)), poses[[0, -1]])
    # within the tolerance above; dense sampling misses at most half a step, 0.25 mm at the bar's end
    assert dense - 1e-3 <= worst.clearance.distance <= dense + 1e-3


@pytest.mark.parametrize("seed", range(4))
def test_minimum_agrees_with_brute_force_on_the_fr3(seed: int) -> None:
    robot = Robot.named("fr3_arm")
    rng = np.random.default_rng(seed)
    start, goal = robot.random_configuration(rng), robot.random_configuration(rng)
    balls = [SceneObject.ball(f"b{i}", rng.uniform(-0.6, 0.8, 3), radius=0.03) for i in range(3)]
    exact = ExactClearance(robot, balls)
    samples = np.linspace(start, goal, 5)  # coarse: about 0.5 rad of every joint between two samples
    worst = exact.minimum_over(samples, tolerance=1e-3)
    dense = exact.series(np.linspace(start, goal, 4001)).min()
    # within the tolerance above the dense minimum; dense sampling itself misses at most half a step, 0.5 mm
    assert worst.clearance.distance <= dense + 1e-3
    assert worst.lower_bound <= dense
    assert worst.clearance.distance >= dense - 1e-3
    assert worst.checks < 4001 * 7 * 3 / 5  # skips most of what dense sampling does


def test_a_diverged_motion_ends_with_an_honest_bound(monkeypatch: pytest.MonkeyPatch) -> None:
    """A ball above the base is 0.71 m from link 1 at every angle, so that each check gains one tolerance only."""
    monkeypatch.setattr(sweep, "FINE_CHECKS", 500)
    exact = ExactClearance(Robot.named("planar2"), [SceneObject.ball("ball", [0.0, 0.0, 0.8], radius=0.05)])
    still = exact.minimum_over(np.zeros((2, 2)))
    for turns in (1e3, 1e12, 1e300):  # at 1e12 the finer steps are below the rounding of the travel
        wild = exact.minimum_over(np.outer(np.linspace(0.0, 1.0, 50), [turns, -turns]))
        assert wild.checks <= 2 * 500 + 16 * 3 + 3  # fine, coarse, the first look, and one per pair
        assert wild.lower_bound == wild.clearance.distance - wild.tolerance
        assert wild.lower_bound < still.clearance.distance
        assert wild.tolerance > 1e-3
    assert still.tolerance == 1e-3


def test_series_is_the_distance_at_each_sample() -> None:
    robot = Robot.named("fr3_arm")
    rng = np.random.default_rng(3)
    path = np.linspace(robot.random_configuration(rng), robot.random_configuration(rng), 60)
    balls = [SceneObject.ball(f"b{i}", rng.uniform(-0.6, 0.8, 3), radius=0.03) for i in range(3)]
    exact = ExactClearance(robot, balls)
    np.testing.assert_array_equal(exact.series(path), [exact.distance(q).distance for q in path])


@pytest.mark.parametrize("name", ["fr3", "ur5", "planar3"])
def test_travel_bound_holds(name: str) -> None:
    robot = Robot.named(name)
    rng = np.random.default_rng(0)
    for link in robot.links:
        mesh = robot.collision_mesh(link.name)
        if mesh is None:
            continue
        bound = travel_per_joint(robot, link.name, mesh.vertices)
        for _ in range(20):
            q = robot.random_configuration(rng)
            step = rng.normal(size=q.shape) * 0.2
            moved = _vertices(robot, q + step, link.name) - _vertices(robot, q, link.name)
            assert np.linalg.norm(moved, axis=1).max() <= np.abs(step) @ bound + 1e-12


def test_immobile_links_only_on_request() -> None:
    robot = Robot.named("fr3_arm")
    ball = SceneObject.ball("ball", [0.0, 0.0, 0.02], radius=0.01)  # inside the base
    assert ExactClearance(robot, [ball]).distance(robot.neutral).link != "fr3_link0"
    found = ExactClearance(robot, [ball], include_immobile=True).distance(robot.neutral)
    assert found.link == "fr3_link0"
    assert found.distance < 0.0


@pytest.mark.parametrize(
    ("trajectory", "tolerance", "message"),
    [
        (np.zeros((3, 4)), 1e-3, r"shape \(3, 4\), expected \(T, 2\)"),
        (np.zeros((0, 2)), 1e-3, "T > 0"),
        (np.full((2, 2), np.nan), 1e-3, "finite"),
        (np.zeros((2, 2)), 0.0, "tolerance must be positive"),
    ],
)
def test_bad_trajectory(trajectory: np.ndarray, tolerance: float, message: str) -> None:
    ball = SceneObject.ball("ball", [0, 1, 0], radius=0.1)
    with pytest.raises(ValueError, match=message):
        ExactClearance(Robot.named("planar2"), [ball]).minimum_over(trajectory, tolerance=tolerance)


def test_pose_vector_round_trip() -> None:
    rng = np.random.default_rng(0)
    for _ in range(50):
        pose = trimesh.transformations.random_rotation_matrix(rng.random(3))
        vector = pose_vector(pose)
        assert vector[3] >= 0.0
        np.testing.assert_allclose(from_quaternion(vector[3:]), pose[:3, :3], atol=1e-12)


def _vertices(robot: Robot, q: np.ndarray, link: str) -> np.ndarray:
    mesh, X = robot.collision_mesh(link), robot.pose(q, link)
    assert mesh is not None
    return mesh.vertices @ X[:3, :3].T + X[:3, 3]
