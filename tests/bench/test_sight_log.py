"""What was in view, and when, of images with known content."""

from __future__ import annotations

import numpy as np
import pytest

from sidestep.bench.sight_log import SHOWN, SightLog, SurfaceLog
from sidestep.perception import DepthCamera
from sidestep.simulation.depth_camera import SimulatedImage

WIDTH, HEIGHT, SOLID = 40, 30, 3


def image(
    time: float, *, pixels: int = 0, depth: float = 1.0, measured: float | None = None
) -> SimulatedImage:
    """A wall at a depth [m], of which so many pixels are the solid's."""
    true_depth = np.full((HEIGHT, WIDTH), depth, dtype=np.float32)
    geom = np.zeros((HEIGHT, WIDTH), dtype=np.int32)
    geom.flat[:pixels] = SOLID
    shown = np.full_like(true_depth, depth if measured is None else measured)
    return SimulatedImage("front", time, shown, true_depth, geom.astype(np.uint8), geom, np.eye(4))


def test_in_view_is_an_unbroken_stretch() -> None:
    log = SightLog(SOLID, {"front": 4.0})
    for k, pixels in enumerate([SHOWN, 0, 0, SHOWN, SHOWN - 1, SHOWN, 400]):
        log.add(image(0.1 * k, pixels=pixels))
    assert log.first_seen == 0.0
    assert log.in_view_before(0.65, gap=0.25) == pytest.approx(0.35)  # from image 3 on
    assert log.in_view_before(0.65, gap=0.15) == pytest.approx(0.15)  # image 4 shows too little
    assert log.in_view_before(0.65, gap=0.31) == pytest.approx(0.65)
    assert log.in_view_before(2.0, gap=0.2) == 0.0  # nothing lately


def test_what_has_no_depth_or_is_too_far_is_not_in_view() -> None:
    log = SightLog(SOLID, {"front": 0.9})
    log.add(image(0.0, pixels=400))
    log.add(image(0.1, pixels=400, depth=0.8, measured=0.0))
    assert log.first_seen is None
    log.add(image(0.2, pixels=400, depth=0.8))
    assert log.first_seen == 0.2


def test_surfaces_are_seen_where_their_depth_is_shown() -> None:
    camera = DepthCamera(
        "front", width=WIDTH, height=HEIGHT, fx=20.0, fy=20.0, cx=19.5, cy=14.5, pose=np.eye(4)
    )
    on_wall, behind, outside = [0.0, 0.0, 1.0], [0.0, 0.0, 1.2], [3.0, 0.0, 1.0]
    log = SurfaceLog(np.array([on_wall, behind, outside]))
    log.look_by([camera])
    log.add(image(0.1, measured=0.0))  # no depth
    log.add(image(0.2))
    log.add(image(0.3))
    np.testing.assert_array_equal(log.first_seen, [0.2, np.inf, np.inf])
    assert log.seen_at(np.array([0.0, 0.01, 1.0])) == 0.2
    assert log.seen_at(np.array([0.0, 0.05, 1.0])) == np.inf
