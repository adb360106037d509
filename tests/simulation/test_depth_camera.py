"""Simulated depth cameras against closed forms and ray casts."""

from __future__ import annotations

import sys
from dataclasses import dataclass, field, replace
from typing import Any

import mujoco
import numpy as np
import pytest
from stand_ins import PENDULUM

from sidestep import Robot, SceneObject
from sidestep.math.pose import pose_at
from sidestep.simulation import D435, SimulatedCamera, SimulationModel, build_model, look_at
from sidestep.simulation.depth_renderer import DepthRenderer

OPTICAL_X_FORWARD = np.array(
    [[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]]
)  # looks along the world's x
TOLERANCE = 1e-4  # [m]


@dataclass(frozen=True)
class Pinhole:
    name: str = "front"
    width: int = 160
    height: int = 120
    fx: float = 140.0
    fy: float = 125.0
    cx: float = 91.3
    cy: float = 43.8
    distortion_model: str = "none"
    pose: np.ndarray = field(default_factory=lambda: pose_at((0.0, 0.0, 0.0), OPTICAL_X_FORWARD))
    link: str = ""
    near: float = 0.1
    far: float = 10.0


def _camera(model: SimulationModel, pinhole: Pinhole | None = None, **settings: Any) -> SimulatedCamera:
    """The camera, or a skipped test where OpenGL does not start, which its own test shows to be said."""
    try:
        return SimulatedCamera(model, pinhole or Pinhole(), **settings)
    except RuntimeError as error:
        if "which does not start" in str(error):
            pytest.skip(str(error))
        raise


def _ball_model(*, radius: float = 0.2, distance: float = 1.0, motion: str = "fixed") -> SimulationModel:
    """A ball on the world's x axis in front of a pendulum, whose bob is below the origin."""
    ball = SceneObject.ball("ball", (distance, 0.0, 0.0), radius=radius, motion=motion)
    return build_model(Robot.from_urdf(PENDULUM), [ball])


def _rays(pinhole: Pinhole) -> np.ndarray:
    """Directions (H, W, 3) in the optical frame with z = 1."""
    v, u = np.mgrid[: pinhole.height, : pinhole.width].astype(float)
    return np.stack([(u - pinhole.cx) / pinhole.fx, (v - pinhole.cy) / pinhole.fy, np.ones_like(u)], axis=-1)


def _clear_of_edges(geom: np.ndarray) -> np.ndarray:
    """Pixels all of whose neighbours show the same geom."""
    clear = np.zeros(geom.shape, dtype=bool)
    around = [
        geom[1 + dv : geom.shape[0] - 1 + dv, 1 + du : geom.shape[1] - 1 + du]
        for dv in (-1, 0, 1)
        for du in (-1, 0, 1)
    ]
    clear[1:-1, 1:-1] = np.all([other == around[4] for other in around], axis=0)
    return clear


def test_depth_of_a_sphere_is_the_closed_form() -> None:
    pinhole, radius, distance = Pinhole(pose=pose_at((-0.5, 0.1, 0.05), OPTICAL_X_FORWARD)), 0.2, 1.0
    model = _ball_model(radius=radius, distance=distance)
    image = _camera(model, pinhole).capture(mujoco.MjData(model.model), 0.0)
    rays = _rays(pinhole)
    centre = OPTICAL_X_FORWARD.T @ (np.array([distance, 0.0, 0.0]) - pinhole.pose[:3, 3])
    a, b = (rays**2).sum(axis=-1), rays @ centre
    inside = b**2 - a * (centre @ centre - radius**2)
    hit = inside > 0.0
    expected = np.where(hit, (b - np.sqrt(np.where(hit, inside, 0.0))) / a, 0.0)
    ball = image.owner == 2
    assert (ball != hit).sum() <= 4  # of the pixels whose centre is on the outline, by rounding
    # The facets are up to 3e-4 of the radius inside along the normal, more along rays that graze.
    facing = inside > 0.2 * a * radius**2
    cosine = np.sqrt(np.where(hit, inside, 1.0) / a) / radius
    inward = (image.depth - expected)[facing]
    assert (inward < (3e-4 * radius / cosine)[facing] + 1e-6).all()
    assert inward.min() > -1e-6
    assert inward.mean() < TOLERANCE
    np.testing.assert_array_equal(image.depth, image.true_depth)
    assert image.depth[~ball].max() == 0.0


def test_depth_of_a_wall_is_along_the_axis_and_not_along_the_ray() -> None:
    wall = SceneObject("wall", "box", (0.1, 4.0, 4.0), pose=pose_at((1.3, 0.0, 0.0)))
    model = build_model(Robot.from_urdf(PENDULUM), [wall])
    pinhole = Pinhole(pose=pose_at((0.5, 0.0, 0.0), OPTICAL_X_FORWARD))
    image = _camera(model, pinhole).capture(mujoco.MjData(model.model), 0.0)
    np.testing.assert_allclose(image.depth, 0.75, atol=1e-6)  # single precision
    assert (image.owner == 2).all()
    assert image.depth.dtype == np.float32


def test_depth_and_owner_are_those_of_ray_casts() -> None:
    robot = Robot.named("fr3")
    scene = [
        SceneObject.ball("ball", (0.5, 0.3, 0.5), radius=0.08),
        SceneObject("box", "box", (0.1, 0.2, 0.4), pose=pose_at((0.6, -0.2, 0.2))),
    ]
    model = build_model(robot, scene, floor_height=0.0)
    data = mujoco.MjData(model.model)
    model.set_state(data, 0.5 * (robot.limits.lower + robot.limits.upper), np.zeros(robot.num_coordinates))
    pinhole = Pinhole(
        pose=look_at((1.3, 0.5, 0.8), (0.2, 0.0, 0.4)), width=320, height=240, fx=300.0, fy=280.0
    )
    image = _camera(model, replace(pinhole, cx=101.7, cy=150.2)).capture(data, 0.0)
    rays = _rays(replace(pinhole, cx=101.7, cy=150.2)) @ pinhole.pose[:3, :3].T
    clear = _clear_of_edges(image.geom)
    groups = np.array([1, 1, 1, 0, 1, 1], dtype=np.uint8)  # without group 3: collision parts
    hit = np.zeros(1, dtype=np.int32)
    seen = {0: 0, 1: 0, 2: 0}
    for v, u in np.argwhere(clear)[::7]:
        depth = mujoco.mj_ray(model.model, data, pinhole.pose[:3, 3], rays[v, u], groups, 1, -1, hit)
        # a pixel whose depth steps inside one geom (a link before itself) is at an edge too
        step = np.ptp(image.true_depth[v - 1 : v + 2, u - 1 : u + 2])
        seen[int(image.owner[v, u])] += 1
        if step < 0.03:
            assert image.geom[v, u] == hit[0]
            assert image.depth[v, u] == pytest.approx(max(depth, 0.0), abs=TOLERANCE)
            name = model.model.geom(int(hit[0])).name if hit[0] >= 0 else ""
            expected = 0 if not name else 1 if name.startswith("visual:") else 2
            assert image.owner[v, u] == expected
    assert min(seen.values()) > 100


def test_a_camera_on_a_link_moves_with_it() -> None:
    robot = Robot.named("fr3")
    model = build_model(robot, [SceneObject.ball("ball", (0.5, 0.0, -0.3), radius=0.1)])
    X_LC = pose_at((0.07, 0.0, 0.02), [[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    pinhole = Pinhole(link="fr3_hand", pose=X_LC)
    camera, data = _camera(model, pinhole), mujoco.MjData(model.model)
    centre = np.array([0.5, 0.0, -0.3])
    rng = np.random.default_rng(0)
    in_view = 0
    for k in range(12):
        q = np.array([0.0, 0.1, 0.0, -2.2, 0.0, 2.3, 0.8, *[0.02] * (robot.num_coordinates - 7)])
        q[:7] += 0.1 * rng.normal(size=7)
        model.set_state(data, q, np.zeros(robot.num_coordinates))
        image = camera.capture(data, float(k))
        X_WC = robot.pose(q, "fr3_hand") @ X_LC
        np.testing.assert_allclose(image.pose, X_WC, atol=1e-12)
        x, y, z = X_WC[:3, :3].T @ (centre - X_WC[:3, 3])
        u, v = pinhole.fx * x / z + pinhole.cx, pinhole.fy * y / z + pinhole.cy
        if 1.0 < u < pinhole.width - 2.0 and 1.0 < v < pinhole.height - 2.0:
            in_view += 1
            row, column = round(v), round(u)
            assert image.owner[row, column] == 2
            # the middle of a ball is its radius before its centre along the ray
            length = np.linalg.norm([x / z, y / z, 1.0])
            assert image.depth[row, column] == pytest.approx(z - 0.1 / length, abs=1e-3)
    assert in_view >= 6


def test_what_moves_is_where_the_data_have_it() -> None:
    model = _ball_model(motion="moving")
    data = mujoco.MjData(model.model)
    camera = _camera(model, Pinhole(cx=80.0, cy=60.0))
    for k, distance in enumerate((1.0, 1.5, 0.8)):
        data.mocap_pos[0] = (distance, 0.0, 0.0)
        assert camera.capture(data, float(k)).depth[60, 80] == pytest.approx(distance - 0.2, abs=TOLERANCE)


def test_what_the_arm_holds_counts_as_arm() -> None:
    model = _ball_model()
    camera, data = _camera(model), mujoco.MjData(model.model)
    free, held = (camera.capture(data, t, attached=names) for t, names in ((0.0, ()), (1.0, ("ball",))))
    ball = free.owner == 2
    assert ball.sum() > 500
    np.testing.assert_array_equal(held.owner, np.where(ball, 1, free.owner))
    with pytest.raises(ValueError, match="no object 'cup' in the scene, allowed: ball"):
        camera.capture(data, 2.0, attached=("cup",))


@pytest.mark.parametrize("visuals", [True, False])
def test_links_without_visual_meshes_are_seen_by_their_collision_parts(visuals: bool) -> None:
    model = build_model(Robot.from_urdf(PENDULUM), visuals=visuals)
    pinhole = Pinhole(pose=pose_at((-1.0, 0.0, -0.4), OPTICAL_X_FORWARD), cx=80.0, cy=60.0)
    image = _camera(model, pinhole).capture(mujoco.MjData(model.model), 0.0)
    assert set(np.unique(image.owner)) == {0, 1}
    assert image.depth[60, 80] == pytest.approx(0.95, abs=1e-3)  # the bob's sphere of 50 mm in triangles


def test_links_look_as_chosen() -> None:
    robot = Robot.named("fr3")
    model = build_model(robot)
    data = mujoco.MjData(model.model)
    model.set_state(data, 0.5 * (robot.limits.lower + robot.limits.upper), np.zeros(robot.num_coordinates))
    pinhole = Pinhole(pose=look_at((1.3, 0.5, 0.8), (0.2, 0.0, 0.4)))
    role = {
        links: _camera(model, pinhole, links=links).capture(data, 0.0) for links in ("visual", "collision")
    }
    for links, image in role.items():
        shown = {
            model.model.geom(int(geom)).name.split(":")[0] for geom in np.unique(image.geom[image.geom >= 0])
        }
        assert shown == {links}
    seen = {links: image.owner == 1 for links, image in role.items()}
    # convex parts hold nearly all of the visual meshes, and some more
    assert (seen["visual"] & ~seen["collision"]).sum() < 0.02 * seen["visual"].sum()
    assert 1.0 < seen["collision"].sum() / seen["visual"].sum() < 1.15


def test_range_limits_what_is_measured_and_not_the_truth() -> None:
    model = _ball_model()
    data = mujoco.MjData(model.model)
    for limits in ({"near": 0.85}, {"far": 0.75}):
        image = _camera(model, replace(Pinhole(), **limits)).capture(data, 0.0)
        assert (image.true_depth[image.owner == 2] > 0.7).all()
        outside = (image.true_depth < limits.get("near", 0.0)) | (image.true_depth > limits.get("far", 9.0))
        assert (outside & (image.owner == 2)).sum() > 100
        np.testing.assert_array_equal(image.depth, np.where(outside, 0.0, image.true_depth))


def test_images_arrive_late_in_order_and_once() -> None:
    model = _ball_model(motion="moving")
    camera, data = _camera(model, latency=0.05), mujoco.MjData(model.model)
    arrivals = []
    for k in range(20):  # a clock of 100 Hz, images at 33 Hz
        now = 0.01 * k
        if k % 3 == 0:
            data.mocap_pos[0] = (1.0 + now, 0.0, 0.0)
            camera.capture(data, now)
        arrivals += [(k, image) for image in camera.delivered(now)]
    assert [k for k, _ in arrivals] == [5, 8, 11, 14, 17]
    np.testing.assert_allclose([image.time for _, image in arrivals], [0.0, 0.03, 0.06, 0.09, 0.12])
    for _, image in arrivals:  # as it was at the capture
        assert image.depth[44, 91] == pytest.approx(0.8 + image.time, abs=1e-3)
    assert [image.time for image in camera.delivered(9.0)] == pytest.approx([0.15, 0.18])
    assert camera.delivered(9.0) == []


def test_images_are_taken_at_their_rate_in_a_loop_of_any_rate() -> None:
    model = _ball_model()
    camera, data = _camera(model, latency=0.05, rate=30.0), mujoco.MjData(model.model)
    arrived = [(k, image.time) for k in range(150) for image in camera.observe(data, 0.001 * k)]
    # Due every 33.3 ms, taken in the next step; the loop has a step each millisecond.
    assert [time for _, time in arrived] == pytest.approx([0.0, 0.034, 0.067], abs=1e-9)
    assert [k for k, _ in arrived] == [50, 84, 117]
    # After a pause one image is taken, and none is made up for.
    assert [image.time for image in camera.observe(data, 1.0)] == pytest.approx([0.1, 0.134], abs=1e-9)
    assert camera.observe(data, 1.03) == []
    assert [image.time for image in camera.observe(data, 1.2)] == pytest.approx([1.0], abs=1e-9)


def test_the_share_that_is_lost_is_the_share_that_is_set() -> None:
    model = _ball_model()
    tiny = Pinhole(width=8, height=6, cx=4.0, cy=3.0, fx=8.0, fy=8.0)
    data = mujoco.MjData(model.model)

    def kept(lost: float, seed: int) -> list[bool]:
        with _camera(model, tiny, lost=lost, seed=seed) as camera:
            images = [camera.capture(data, 0.1 * k) for k in range(200)]
            arrived = camera.delivered(1e9)
        assert [image.time for image in arrived] == [image.time for image in images if image is not None]
        return [image is not None for image in images]

    first = kept(0.3, 1)
    assert 1.0 - np.mean(first) == pytest.approx(0.3, abs=0.1)  # three deviations of 200 draws
    assert kept(0.3, 1) == first
    assert kept(0.3, 2) != first
    assert all(kept(0.0, 1))
    assert not any(kept(1.0, 1))


def test_noise_is_of_the_seed_and_the_count_of_the_image() -> None:
    model = _ball_model()
    data = mujoco.MjData(model.model)

    def images(**settings: Any) -> dict[float, np.ndarray]:
        camera = _camera(model, noise=D435(missing=0.0), **settings)
        shots = [camera.capture(data, float(k)) for k in range(6)]
        return {shot.time: shot.depth for shot in shots if shot is not None}

    all_of_them = images(seed=3)
    with_losses = images(seed=3, lost=0.5)
    assert 0 < len(with_losses) < 6
    for time, depth in with_losses.items():
        np.testing.assert_array_equal(depth, all_of_them[time])
    assert np.abs(all_of_them[0.0] - all_of_them[1.0]).max() > 0.0
    assert np.abs(all_of_them[0.0] - images(seed=4)[0.0]).max() > 0.0


def test_noise_leaves_the_truth_alone() -> None:
    model = _ball_model()
    data = mujoco.MjData(model.model)
    clean, noisy = (_camera(model, noise=noise).capture(data, 0.0) for noise in ("none", "d435"))
    np.testing.assert_array_equal(clean.true_depth, noisy.true_depth)
    np.testing.assert_array_equal(clean.owner, noisy.owner)
    assert (clean.depth != noisy.depth).any()


@pytest.mark.parametrize(
    ("pinhole", "settings", "words"),
    [
        (
            Pinhole(distortion_model="brown_conrady"),
            {},
            "distortion_model is 'brown_conrady', allowed in simulation",
        ),
        (Pinhole(link="hand"), {}, "link is 'hand', allowed: base, .*bob"),
        (Pinhole(fx=0.0), {}, "fx, fy are 160, 120, 0.0"),
        (Pinhole(cx=float("nan")), {}, "cx, cy are nan"),
        (Pinhole(), {"latency": -0.1}, "latency is -0.1 s"),
        (Pinhole(), {"lost": 1.5}, "lost is 1.5"),
        (Pinhole(), {"rate": 0.0}, "rate is 0.0 Hz, allowed: above 0"),
        (Pinhole(), {"links": "hull"}, "links is 'hull', allowed: visual, collision"),
        (Pinhole(), {"noise": "lidar"}, "noise is 'lidar', allowed: none, d435"),
        (Pinhole(pose=2.0 * np.eye(4)), {}, "'front': pose is not a rigid transform"),
    ],
)
def test_what_cannot_be_is_named(pinhole: Pinhole, settings: dict[str, Any], words: str) -> None:
    with pytest.raises(ValueError, match=words):
        SimulatedCamera(_ball_model(), pinhole, **settings)


def test_time_goes_forward() -> None:
    model = _ball_model()
    camera, data = _camera(model), mujoco.MjData(model.model)
    camera.capture(data, 1.0)
    for time in (1.0, 0.5, float("nan")):
        with pytest.raises(ValueError, match=r"allowed: later than 1\.0"):
            camera.capture(data, time)


def test_a_closed_camera_says_so() -> None:
    model = _ball_model()
    with _camera(model) as camera:
        pass
    with pytest.raises(RuntimeError, match="closed"):
        camera.capture(mujoco.MjData(model.model), 0.0)


def test_the_model_is_left_as_it_was() -> None:
    model = _ball_model()
    before = np.array(model.model.geom_group), model.model.vis.global_.offwidth
    _camera(model, Pinhole(width=1000, height=900)).capture(mujoco.MjData(model.model), 0.0)
    np.testing.assert_array_equal(model.model.geom_group, before[0])
    assert model.model.vis.global_.offwidth == before[1]


def _small(model: SimulationModel) -> DepthRenderer:
    return DepthRenderer(model, size=(16, 12), focal=(10.0, 10.0), centre=(8.0, 6.0))


def test_without_opengl_the_packages_are_named(monkeypatch: pytest.MonkeyPatch) -> None:
    egl = pytest.importorskip("mujoco.egl", reason="no EGL", exc_type=Exception)

    def refuses(*_: int) -> None:
        raise ImportError("Cannot initialize a EGL device display.")

    monkeypatch.setenv("MUJOCO_GL", "egl")
    monkeypatch.setattr(egl, "GLContext", refuses)
    with pytest.raises(RuntimeError, match="libegl1 and libgl1-mesa-dri") as caught:
        _small(_ball_model())
    assert "Cannot initialize" in str(caught.value)


@pytest.mark.skipif(sys.platform != "linux", reason="elsewhere windows need no DISPLAY")
def test_a_window_without_a_display_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("MUJOCO_GL", "glfw")
    with pytest.raises(RuntimeError, match=r"MUJOCO_GL is 'glfw' and there is no display.*set MUJOCO_GL=egl"):
        _small(_ball_model())


def test_a_frame_that_is_not_there_is_named() -> None:
    model = _ball_model()
    with pytest.raises(ValueError, match="no frame 'hand' on this robot, allowed: base, bob"):
        model.link_pose(mujoco.MjData(model.model), "hand")
