"""The binding of `Perception`: what Python gives and gets; the core's own tests are in cpp/tests/perception."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from sidestep import Arm, Controller, ControllerSettings
from sidestep.math.pose import pose_at
from sidestep.perception import DepthCamera, DepthNoise, Perception
from support.camera_scene import CAMERA, rendered


@pytest.fixture(scope="module")
def arm() -> Arm:
    return Arm.load("fr3")


@pytest.fixture
def perception(arm: Arm) -> Perception:
    return Perception(Controller(arm, ControllerSettings(synchronous=True)), [CAMERA.camera()])


def test_a_cloud_shows_what_the_image_shows(arm: Arm, perception: Perception) -> None:
    depth, _ = rendered(arm, arm.neutral)
    v, u = np.indices(depth.shape)
    cloud = np.dstack(
        [
            (u - CAMERA.cx) / CAMERA.fx * depth,
            (v - CAMERA.cy) / CAMERA.fy * depth,
            np.where(depth, depth, np.nan),
        ]
    )
    by_image = perception.update("front", depth, time=0.0, q=arm.neutral)
    labels = perception.labels("front")
    for points in (cloud, cloud.reshape(-1, 3)):
        perception.forget()
        by_cloud = perception.update_points("front", points, time=1.0, q=arm.neutral)
        assert by_cloud.arm_pixels == by_image.arm_pixels > 700
        assert np.array_equal(perception.labels("front"), labels)


@pytest.mark.parametrize("shape", [(10, 2), (3, 10), (3,), (2, 2, 2, 3)])
def test_a_cloud_of_another_shape_is_named(arm: Arm, perception: Perception, shape: Any) -> None:
    with pytest.raises(
        ValueError, match=r"points have shape \(.*\), allowed: \(N, 3\) or \(height, width, 3\)"
    ):
        perception.update_points("front", np.ones(shape), time=0.0, q=arm.neutral)


def test_a_report_says_what_became_of_its_image(arm: Arm, perception: Perception) -> None:
    report = perception.update("front", np.zeros((CAMERA.height, CAMERA.width)), time=0.0, q=arm.neutral)
    assert repr(report) == (
        "PerceptionReport(used=False, seen=0, remembered=0, explained=0, unseen=0, question=\"camera 'front' sees "
        'nothing: fewer than 1 % of its pixels have a depth; the image is not used")'
    )


def test_a_camera_is_replaced_by_one_with_other_values() -> None:
    noise = DepthNoise(0.002, 0.001)
    camera = DepthCamera(
        "a", width=10, height=5, fx=10, fy=11, cx=4, cy=2, pose=pose_at([1.0, 2.0, 3.0]), noise=noise
    )
    other = camera.replace(far=2.0, link="fr3_hand")
    assert (other.name, other.far, other.link, other.fy) == ("a", 2.0, "fr3_hand", 11.0)
    assert (other.noise.constant, other.noise.quadratic) == (0.002, 0.001)
    assert np.array_equal(other.pose, camera.pose)
    assert (camera.far, camera.link) == (4.0, "")
    assert camera.replace(name="b").name == "b"
    with pytest.raises(ValueError, match="camera 'a': fx is 0"):
        camera.replace(fx=0.0)
