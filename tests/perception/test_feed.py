"""Images that are taken in a thread beside a control loop."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator
from types import TracebackType

import numpy as np
import pytest

from sidestep import Arm, Controller, ControllerSettings
from sidestep.perception import Frame, Perception, take, watch
from support.camera_scene import CAMERA, rendered

LONG = 20.0  # [s] more than a busy machine takes for a few images


@pytest.fixture(scope="module")
def arm() -> Arm:
    return Arm.load("fr3")


@pytest.fixture(scope="module")
def depth(arm: Arm) -> np.ndarray:
    return np.round(1000.0 * rendered(arm, arm.neutral)[0]).astype(np.uint16)


class Watched:
    """A controller after `steps` steps at rest, one each millisecond, and its camera."""

    def __init__(self, arm: Arm, steps: int = 100) -> None:
        self.arm, self.controller = arm, Controller(arm, ControllerSettings(synchronous=True))
        self.perception = Perception(self.controller, [CAMERA.camera()])
        for k in range(steps):
            self.step(0.001 * k)

    def step(self, now: float) -> None:
        self.controller.step(self.arm.neutral, 0.0 * self.arm.neutral, time=now)


def frame(depth: np.ndarray, at: float, camera: str = "front") -> Frame:
    return Frame(camera, at, depth, 0.001)


def test_a_frame_is_taken_with_all_that_its_source_says(arm: Arm, depth: np.ndarray) -> None:
    watched = Watched(arm, steps=1)
    moved = CAMERA.pose.copy()
    moved[:3, 3] += [0.0, 0.01, 0.0]
    report = take(watched.perception, Frame("front", 7.0, depth, 0.001, q=arm.neutral, pose=moved))
    assert report.used  # although step has never been there
    assert np.array_equal(watched.perception.pose("front"), moved)
    assert watched.perception.time("front") == 7.0
    assert np.allclose(watched.perception.depth("front"), 0.001 * depth, atol=1e-6)
    take(watched.perception, Frame("front", 7.1, (0.001 * depth).astype(np.float32), 1.0, q=arm.neutral))
    assert np.allclose(watched.perception.depth("front"), 0.001 * depth, atol=1e-6)


def test_images_become_obstacles_until_the_source_ends(arm: Arm, depth: np.ndarray) -> None:
    watched = Watched(arm)
    with watch(watched.perception, [frame(depth, at) for at in (0.03, 0.06, 0.09)]) as feed:
        feed.wait(LONG)
        assert not feed.is_running
    assert (feed.images, feed.unused, feed.error) == (3, 0, None)
    assert feed.report is not None
    watched.step(0.1)
    (source,) = (source for source in watched.controller.sources if source.name == "front")
    assert source.size == feed.report.seen > 100
    assert source.age == pytest.approx(0.01, abs=1e-9)  # since the capture


class Endless:
    """A source that is opened and closed, and sends an image each millisecond."""

    def __init__(self, depth: np.ndarray) -> None:
        self.depth, self.events, self.sent = depth, list[str](), threading.Event()

    def __enter__(self) -> Endless:
        self.events.append("opened")
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.events.append("closed")

    def frames(self) -> Iterator[Frame]:
        for k in range(1_000_000):
            yield frame(self.depth, 0.01 + 1e-6 * k)
            self.sent.set()
            time.sleep(0.001)


def test_the_source_is_open_within_the_block_and_its_end_stops_the_thread(
    arm: Arm, depth: np.ndarray
) -> None:
    source = Endless(depth)
    feed = watch(Watched(arm).perception, source)
    assert source.events == []
    with feed:
        assert source.sent.wait(LONG)
        assert source.events == ["opened"]
    assert source.events == ["opened", "closed"]
    assert not feed.is_running
    count = feed.images
    assert count >= 1
    time.sleep(0.01)
    assert feed.images == count


def test_an_error_is_told_at_once_and_raised_at_the_end(arm: Arm, depth: np.ndarray) -> None:
    def broken() -> Iterator[Frame]:
        yield frame(depth, 0.03)
        raise TimeoutError("camera 'front' sent no image within 1 s")

    feed = watch(Watched(arm).perception, broken())
    with (
        pytest.raises(TimeoutError, match="sent no image"),
        pytest.warns(RuntimeWarning, match="no more images: camera 'front' sent no image"),
        feed,
    ):
        feed.wait(LONG)
    assert feed.images == 1
    assert isinstance(feed.error, TimeoutError)


def test_the_error_of_the_loop_counts_before_that_of_the_camera(arm: Arm, depth: np.ndarray) -> None:
    def loop() -> None:
        with feed:
            feed.wait(LONG)
            raise KeyboardInterrupt

    feed = watch(Watched(arm).perception, [frame(depth, 0.03, "back")])
    with pytest.raises(KeyboardInterrupt), pytest.warns(RuntimeWarning, match="no camera 'back'"):
        loop()
    assert isinstance(feed.error, ValueError)


@pytest.mark.filterwarnings("error")
def test_images_before_the_first_step_are_no_reason_for_a_warning(arm: Arm, depth: np.ndarray) -> None:
    watched = Watched(arm, steps=0)
    with watch(watched.perception, [frame(depth, at) for at in (0.0, 0.3, 0.6, 0.9)]) as feed:
        feed.wait(LONG)
    assert (feed.images, feed.unused) == (0, 4)
    assert feed.report is not None
    assert "the clock of step has not begun" in feed.report.question


def test_a_question_that_stands_is_told_once(arm: Arm, depth: np.ndarray) -> None:
    blind = np.zeros_like(depth)
    times = (0.0, 0.02, 0.04, 1.5, 1.6, 3.0)  # the last three are more than a second after the first
    frames = [Frame("front", at, blind, 0.001, q=arm.neutral) for at in times]
    with pytest.warns(RuntimeWarning) as warned, watch(Watched(arm).perception, frames) as feed:
        feed.wait(LONG)
    assert [str(one.message) for one in warned] == [feed.report.question if feed.report else ""]
    assert "sees nothing" in str(warned[0].message)
    assert (feed.images, feed.unused) == (0, 6)


def test_what_has_no_frames_is_refused(arm: Arm) -> None:
    with pytest.raises(TypeError, match=r"source is 7, must have frames\(\), as RealSense and recordings"):
        watch(Watched(arm).perception, 7)  # type: ignore[arg-type]
