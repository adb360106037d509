"""Frames that stand still against each other."""

from __future__ import annotations

import numpy as np
import pytest

from sidestep.perception.static_frames import StaticFrames
from support.depth_frames import pose


def test_poses_are_multiplied_along_the_way_and_inverted_against_it() -> None:
    frames = StaticFrames()
    X_WB, X_BM, X_BC = pose(0.3), pose(-0.8), pose(1.4)
    frames.add("world", "body", pose=X_WB)
    frames.add("/body", "mount", pose=X_BM)
    frames.add("body", "camera", pose=X_BC)
    assert frames.pose("camera", base="world") == pytest.approx(X_WB @ X_BC, abs=1e-15)  # one product
    expected = np.linalg.solve(X_BM, X_BC)
    assert frames.pose("/camera", base="mount") == pytest.approx(expected, abs=1e-14)  # an inverse, a product
    assert frames.pose("body", base="body").tolist() == np.eye(4).tolist()


def test_a_later_pose_counts_and_what_is_not_joined_is_named() -> None:
    frames = StaticFrames()
    frames.add("world", "camera", pose=pose(0.3))
    frames.add("world", "camera", pose=pose(0.6))
    frames.add("other", "lamp", pose=pose(0.1))
    assert frames.pose("camera", base="world").tolist() == pose(0.6).tolist()
    with pytest.raises(ValueError, match="does not join frame 'lamp' to 'world', which is joined to camera"):
        frames.pose("lamp", base="world")
    with pytest.raises(ValueError, match="does not join frame 'camera' to 'map', which is joined to nothing"):
        frames.pose("camera", base="map")
