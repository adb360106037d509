"""Cameras around an arm: where they are, when their images come, and what the controller then knows."""

from __future__ import annotations

import math

import numpy as np
import pytest
from tests.bench.camera_stand_ins import needs_opengl

from sidestep import Arm, Controller, ControllerSettings, Robot
from sidestep.bench import ControllerRunner
from sidestep.bench.camera_rig import CameraRig, RigSettings, cameras_around, room
from sidestep.bench.workspace import Workspace
from sidestep.distance import SceneObject


@pytest.fixture(scope="module")
def planar() -> Robot:
    return Robot.named("planar3")


def test_cameras_look_at_the_shoulder_from_their_azimuths(planar: Robot) -> None:
    space = Workspace.of(planar)
    cameras = cameras_around(planar, RigSettings((0.0, math.pi), "848x480"))
    for camera, side in zip(cameras, (1.0, -1.0), strict=True):
        eye = np.asarray(camera.pose)[:3, 3] - space.shoulder
        np.testing.assert_allclose(eye, space.reach * np.array([1.2 * side, 0.0, 0.7]), atol=1e-9)
        away = np.linalg.norm(eye)
        np.testing.assert_allclose(np.asarray(camera.pose)[:3, 2], -eye / away, atol=1e-9)
        # 87 degrees across 848 pixels: f = 424 / tan(43.5 degrees); sigma(1 m) = 1 mm + 0.08 / (f 0.05).
        assert camera.fx == pytest.approx(446.8, abs=0.1)
        assert camera.noise.sigma(1.0) == pytest.approx(0.001 + 0.08 / (446.8 * 0.05), rel=1e-3)
        assert camera.far == pytest.approx(away + space.reach)


def test_cameras_are_told_their_poses_are_exact_only_where_asked(planar: Robot) -> None:
    default, exact = (
        cameras_around(planar, RigSettings((0.0,), exact_poses=told))[0] for told in (False, True)
    )
    assert (default.translation_error, default.rotation_error) == (0.005, 0.005)
    assert (exact.translation_error, exact.rotation_error) == (0.0, 0.0)
    np.testing.assert_array_equal(exact.pose, default.pose)


def test_the_room_is_out_of_reach() -> None:
    floor, front, *others = room(np.array([1.0, 0.0, 0.5]), 0.8)
    assert floor.pose[2, 3] + 0.05 == pytest.approx(0.5 - 1.4 * 0.8 + 0.05)
    assert front.pose[0, 3] == pytest.approx(1.0 + 3.0 * 0.8)
    assert len(others) == 3


def test_nothing_is_left_of_an_arm_whose_poses_are_exact() -> None:
    """Images show the meshes to which covers are proven, not their convex hulls, which stand out of covers."""
    arm = Arm.load("xarm7")
    robot, q = arm.robot, arm.robot.neutral
    settings = RigSettings((0.4,), noise="none", exact_poses=True)
    controller = Controller(arm, ControllerSettings(synchronous=True, period=0.01, output="acceleration"))
    with needs_opengl():
        rig = CameraRig(robot, (), cameras_around(robot, settings), settings)
    with rig:
        rig.start(controller)
        for k in range(20):
            controller.step(q, np.zeros_like(q), time=0.01 * k)
            rig.see(0.01 * k, q)
        assert rig.perception is not None
        assert rig.reports[-1][2].arm_pixels > 1000
        assert len(rig.perception.cells()["radii"]) == 0


def test_images_come_late_and_fill_the_map(planar: Robot, runner: ControllerRunner) -> None:
    arm = runner.arm
    assert isinstance(arm, Arm)
    space = Workspace.of(planar)
    place = space.shoulder + space.reach * np.array([0.0, 0.7, 0.35])
    ball = SceneObject.ball("ball", place, radius=0.08)
    settings = RigSettings((0.4,), rate=10.0, latency=0.15, noise="none")
    controller = Controller(arm, ControllerSettings(synchronous=True, output="acceleration"))
    q = planar.neutral
    with needs_opengl():
        rig = CameraRig(
            planar, (ball, *room(np.zeros(3), space.reach)), cameras_around(planar, settings), settings
        )
    with rig:
        with pytest.raises(RuntimeError, match="call start first"):
            rig.see(0.0, q)
        rig.start(controller)
        for step in range(360):
            rig.see(1e-3 * step, q)
            controller.step(q, np.zeros_like(q), time=1e-3 * step)
        assert [round(now, 3) for now, _, _ in rig.reports] == [0.15, 0.25, 0.35]
        assert rig.perception is not None
        cells = rig.perception.cells()
    away = np.linalg.norm(np.asarray(cells["centres"]) - place, axis=1)
    near = away < 0.2
    assert (
        near.sum() > 40
    )  # a half of a sphere of 8 cm in cells of 2 cm: 2 pi 8^2 / 2^2 = 100, some of them merged
    np.testing.assert_allclose(away[near], 0.08, atol=0.02)


def test_values_that_are_not_allowed_are_named() -> None:
    with pytest.raises(ValueError, match="size is '640x480', allowed: 848x480, 424x240"):
        RigSettings((0.0,), "640x480")
    with pytest.raises(ValueError, match="there is no camera"):
        RigSettings(())
    with pytest.raises(ValueError, match=r"rate is 0\.0 Hz"):
        RigSettings((0.0,), rate=0.0)
    assert RigSettings((0.0,)).valid_for == 0.25
    assert RigSettings((0.0,), rate=10.0, latency=0.15).valid_for == pytest.approx(0.65)
