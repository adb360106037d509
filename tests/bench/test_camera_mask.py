"""What is measured of masks: distances from links, left-over and lost pixels, and a whole trial."""

from __future__ import annotations

from collections import Counter

import numpy as np
import pytest

from sidestep.bench import CameraMaskSettings, ghost_table, mask_table, run_camera_mask
from sidestep.bench.camera_scene import (
    RandomMotion,
    Way,
    as_collision_meshes,
    distance_to_solids,
    table_scene,
    told_noise,
    wrong,
)
from sidestep.bench.link_surfaces import LinkSurfaces, surface_points
from sidestep.bench.mask_measures import (
    ArmTruth,
    MaskedImage,
    MaskMeasures,
    expected_error,
    points_of,
    quantile,
)
from sidestep.bench.moving import maker_and_judge
from sidestep.distance import ExactClearance, SceneObject
from sidestep.math.pose import pose_at, rotation_vector
from sidestep.perception import DepthCamera, DepthNoise, PixelLabel

ARM, OBSTACLE, NOTHING = (int(PixelLabel[name]) for name in ("arm", "obstacle", "nothing"))


def _camera() -> DepthCamera:
    return DepthCamera(
        "front",
        width=4,
        height=3,
        fx=100.0,
        fy=100.0,
        cx=1.0,
        cy=1.0,
        pose=np.eye(4),
        noise=DepthNoise(0.001, 0.002),
        translation_error=0.01,
        rotation_error=0.02,
        clock_error=0.0,
    )


def test_distance_to_links_is_that_of_the_exact_meshes() -> None:
    robot = maker_and_judge("panda")[0].robot
    surfaces, q = LinkSurfaces(robot, "mesh"), robot.neutral
    rng = np.random.default_rng(1)
    points = rng.uniform((-0.3, -0.3, 0.0), (0.6, 0.3, 0.8), (20, 3))
    nearest = surfaces.nearest(points, surfaces.poses(q))
    exact = ExactClearance(robot, (), include_immobile=True)
    for point, distance in zip(points, nearest.distance, strict=True):
        ball = SceneObject.ball("ball", point, radius=1e-6)
        true = exact.among([ball]).distance(q).distance
        if true > 0.02:
            assert true - 1e-5 <= distance <= true + 3e-4  # h^2 / (2 d), h = 2.9 mm
    bounded = surfaces.nearest(points, surfaces.poses(q), within=0.1).distance
    np.testing.assert_array_equal(np.isinf(bounded), nearest.distance >= 0.1)


def test_points_of_a_surface_are_dense() -> None:
    triangle = np.array([[[0.0, 0.0, 0.0], [0.1, 0.0, 0.0], [0.0, 0.1, 0.0]]])
    points = surface_points(triangle)
    inside = np.random.default_rng(0).dirichlet((1.0, 1.0, 1.0), 50) @ triangle[0]
    assert np.linalg.norm(inside[:, None] - points, axis=2).min(axis=1).max() < 2.9e-3


def test_distance_to_solids() -> None:
    scene = [
        SceneObject("table", "box", (1.0, 2.0, 0.04), pose=pose_at((0.0, 0.0, -0.02))),
        SceneObject("can", "cylinder", (0.05, 0.2), pose=pose_at((0.3, 0.0, 0.1))),
        SceneObject.ball("ball", (-0.3, 0.0, 0.1), radius=0.1),
    ]
    points = np.array(
        [[0.0, 0.0, 0.05], [0.3, 0.0, 0.25], [0.4, 0.0, 0.1], [-0.3, 0.0, 0.1], [0.53, 0.0, 0.04]]
    )
    np.testing.assert_allclose(distance_to_solids(scene, points), [0.05, 0.05, 0.05, 0.0, 0.05], atol=1e-12)


def test_a_way_is_as_quick_as_its_limits_allow() -> None:
    way = Way(np.zeros(2), np.array([1.0, -2.0]), 2.0)
    np.testing.assert_allclose(way.at(1.0), [0.5, -1.0])
    np.testing.assert_allclose(way.at(5.0), [1.0, -2.0])
    maker = maker_and_judge("panda")[0]
    rng = np.random.default_rng(0)
    scene = table_scene(maker.robot, rng)
    motion = RandomMotion(maker, scene, rng, duration=1.0)
    times = np.linspace(0.0, motion.ways[0].duration, 400)
    v = np.array([motion.at(t)[1] for t in times])
    a = np.diff(v, axis=0) / (times[1] - times[0])
    fastest = (np.abs(v) / maker.robot.limits.velocity).max()
    hardest = (np.abs(a) / maker.robot.limits.acceleration).max()
    assert max(fastest, hardest) == pytest.approx(1.0, abs=0.02)  # differences of samples


def test_a_wrong_pose_is_off_by_just_so_much() -> None:
    X = pose_at((1.0, 2.0, 3.0))
    off = wrong(X, np.random.default_rng(0), translation=0.01, rotation=0.02)
    assert np.linalg.norm(off[:3, 3] - X[:3, 3]) == pytest.approx(0.01)
    assert np.linalg.norm(rotation_vector(off[:3, :3] @ X[:3, :3].T)) == pytest.approx(0.02)
    assert told_noise("d435", 400.0).quadratic == pytest.approx(0.08 / (400.0 * 0.05))
    with pytest.raises(ValueError, match="noise is 'fog', allowed: none, d435"):
        CameraMaskSettings(noises=("fog",))


def test_expected_error_is_the_sum_of_what_may_be_wrong() -> None:
    p = np.array([[0.0, 0.0, 2.0]])
    error = expected_error(_camera(), p, np.array([0.03]))
    np.testing.assert_allclose(error, 0.01 + 0.02 * 2.0 + 2.0 / 100.0 + 0.03 + 3.0 * (0.001 + 0.002 * 4.0))


def test_left_over_and_lost_pixels_are_counted_by_what_is_true() -> None:
    robot = maker_and_judge("panda")[0].robot
    surfaces, q, camera = LinkSurfaces(robot, "mesh"), robot.neutral, _camera()
    true = np.full((3, 4), 1.0, dtype=np.float32)
    measured = true.copy()
    measured[0, 1], measured[0, 2] = 2.0, 1.5  # of the arm: at what is behind, and in between
    measured[2, 3] = 0.5  # of the world: at something else
    is_arm = np.zeros((3, 4), dtype=bool)
    is_arm[0] = True
    labels = np.full((3, 4), OBSTACLE, dtype=np.uint8)
    labels[0, 3], labels[2], labels[1, 0] = ARM, ARM, NOTHING
    image = MaskedImage(measured, true, is_arm, ~is_arm)
    measures = MaskMeasures()
    left = measures.add_left_over(camera, labels, image, lambda p: np.abs(p[:, 2] - 2.0))
    assert left.sum() == measures.left_over == 3
    assert (measures.left_over_true, measures.left_over_world, measures.arm_pixels) == (1, 1, 4)
    X_WC = pose_at((0.0, 0.0, 1.5))  # looks up, away from the arm
    truth = ArmTruth(X_WC, surfaces.poses(q))
    measures.add_lost(camera, labels, image, surfaces, truth, truth)
    assert (measures.world_pixels, measures.lost, measures.lost_true) == (7, 4, 3)
    points = points_of(camera, true, np.array([[False] * 4, [False] * 4, [True, True, True, False]]))
    np.testing.assert_allclose(points, [[-0.01, 0.01, 1.0], [0.0, 0.01, 1.0], [0.01, 0.01, 1.0]], atol=1e-7)
    nearest = surfaces.nearest(points + X_WC[:3, 3], truth.poses).distance
    assert quantile(measures.distance, 1.0) == pytest.approx(nearest.max(), abs=1e-3)
    error = expected_error(camera, points, np.zeros(3))
    assert quantile(measures.beyond, 1.0) == pytest.approx((nearest - error).max(), abs=1e-3)
    total = MaskMeasures.sum_of([measures.to_document()] * 2)
    assert (total.left_over, total.worst_left_over, total.distance.total()) == (6, 3, 6)


def test_motion_within_the_clock_error_is_seen_from_the_camera() -> None:
    robot = maker_and_judge("panda")[0].robot
    surfaces, q = LinkSurfaces(robot, "mesh"), robot.neutral
    poses = surfaces.poses(q)
    nearest = surfaces.nearest(np.array([[0.0, 0.0, 1.0]]), poses)
    here, shifted = np.eye(4), pose_at((0.0, 0.02, 0.0))
    assert ArmTruth(here, poses, ((here, poses),)).moves(nearest) == pytest.approx(0.0)
    assert ArmTruth(here, poses, ((shifted, poses),)).moves(nearest) == pytest.approx(0.02)


def test_quantiles_of_histograms() -> None:
    assert quantile(Counter({3: 9, 10: 1}), 0.9) == pytest.approx(0.004)
    assert quantile(Counter({3: 9, 10: 1}), 1.0) == pytest.approx(0.011)
    assert quantile(Counter(), 0.5) is None


def test_a_robot_that_looks_like_its_collision_meshes() -> None:
    robot = maker_and_judge("panda")[0].robot
    looks = as_collision_meshes(robot)
    assert [link.visuals for link in looks.links] == [link.geometries for link in robot.links]
    q = robot.random_configuration(np.random.default_rng(0))
    np.testing.assert_array_equal(looks.pose(q, "panda_hand"), robot.pose(q, "panda_hand"))


def test_a_whole_trial_leaves_nothing_of_the_arm_that_was_measured_right() -> None:
    settings = CameraMaskSettings(
        robots=("panda",), noises=("none",), scenes=1, images=2, width=160, height=90
    )
    try:
        rows = run_camera_mask(settings)
    except RuntimeError as error:
        if "which does not start" in str(error):
            pytest.skip(str(error))
        raise
    cell = mask_table(rows, "all")["told"]["all"]
    assert (cell["images"], mask_table(rows, "robot")["exact"]["panda"]["images"]) == (8, 4)
    assert cell["arm_pixels"] > 1000
    assert cell["left_over_true"] == 0
    assert mask_table(rows, "all")["exact"]["all"]["left_over_true"] == 0
    grown = mask_table(rows, "all")
    assert grown["grown 5 cm"]["all"]["lost"] < grown["grown 10 cm"]["all"]["lost"]
    assert ghost_table(rows)["told"]["moments"] == 2
    assert ghost_table(rows)["told"]["near_arm"] == 0
