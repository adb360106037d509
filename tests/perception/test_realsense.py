"""RealSense cameras, by the driver's own software device."""

from __future__ import annotations

import time
from typing import Any

import numpy as np
import pytest

from sidestep.perception import RealSense
from support.depth_frames import pose

rs = pytest.importorskip("pyrealsense2", exc_type=ImportError)  # its library may lack libusb

SIZE = (64, 48)
COEFFICIENTS = [0.125, -0.25, 0.0625, 0.5, -0.125]  # exact in single precision
SOON = 5.0  # [s] more than a busy machine takes from one line to the next, less than the stamps differ


class Device:
    """A software device with one depth stream."""

    def __init__(self, model: str = "brown_conrady", *, unit: float | None = 0.00025) -> None:
        self.device = rs.software_device()
        self.sensor = self.device.add_sensor("Depth")
        intrinsics = rs.intrinsics()
        intrinsics.width, intrinsics.height = SIZE
        intrinsics.fx, intrinsics.fy, intrinsics.ppx, intrinsics.ppy = 60.5, 61.25, 31.5, 23.75
        intrinsics.model = getattr(rs.distortion, model)
        intrinsics.coeffs = COEFFICIENTS if model != "none" else [0.0] * 5
        stream = rs.video_stream()
        stream.type, stream.fmt, stream.index, stream.uid = rs.stream.depth, rs.format.z16, 0, 0
        stream.width, stream.height = SIZE
        stream.fps, stream.bpp, stream.intrinsics = 30, 2, intrinsics
        self.profile = self.sensor.add_video_stream(stream, True).as_video_stream_profile()
        if unit is not None:
            self.sensor.add_read_only_option(rs.option.depth_units, unit)
        self.unit = unit

    def send(self, depth: np.ndarray, number: int, *, stamp: float, domain: str = "global_time") -> None:
        """An image with a time stamp [s]."""
        frame = rs.software_video_frame()
        frame.pixels, frame.stride, frame.bpp = depth, 2 * depth.shape[1], 2
        frame.timestamp, frame.domain = 1e3 * stamp, getattr(rs.timestamp_domain, domain)
        frame.frame_number, frame.profile, frame.depth_units = number, self.profile, self.unit
        self.sensor.on_video_frame(frame)

    def set_metadata(self, **microseconds: int) -> None:
        for name, value in microseconds.items():
            self.sensor.set_metadata(getattr(rs.frame_metadata_value, name), value)


def image(seed: int) -> np.ndarray:
    return np.random.default_rng(seed).integers(0, 65536, SIZE[::-1], dtype=np.uint16)


@pytest.mark.parametrize(
    ("model", "expected"),
    [
        ("none", "none"),
        ("brown_conrady", "brown_conrady"),
        ("inverse_brown_conrady", "inverse_brown_conrady"),
        ("kannala_brandt4", "kannala_brandt"),
    ],
)
def test_the_device_describes_its_camera(model: str, expected: str) -> None:
    source = Device(model)
    camera = RealSense("hand", device=source.device, pose=pose(0.4), link="wrist").camera
    assert (camera.name, camera.width, camera.height, camera.link) == ("hand", *SIZE, "wrist")
    assert (camera.fx, camera.fy, camera.cx, camera.cy) == (60.5, 61.25, 31.5, 23.75)
    assert camera.distortion_model == expected
    assert camera.distortion.tolist() == (COEFFICIENTS if model != "none" else [0.0] * 5)
    assert camera.unit == 0.00025
    assert camera.pose is not None
    assert camera.pose.tolist() == pose(0.4).tolist()


def test_images_come_out_bit_by_bit() -> None:
    source = Device()
    with RealSense("front", device=source.device, width=64, height=48, rate=30) as camera:
        for number in range(5):
            source.send(image(number), number, stamp=time.time())
            frame = camera.read()
            assert (frame.camera, frame.unit, frame.q) == ("front", 0.00025, None)
            assert frame.depth.dtype == np.uint16
            assert np.array_equal(frame.depth, image(number))
        kept = frame.depth.copy()
        source.send(image(9), 9, stamp=time.time())
        assert np.array_equal(next(camera.frames()).depth, image(9))
        assert np.array_equal(frame.depth, kept)  # not the driver's buffer
        assert camera.lost == 4  # 5 to 8


def test_global_time_becomes_monotonic_time() -> None:
    source = Device()
    with RealSense("front", device=source.device, latency=0.5) as camera:
        stamp, before = time.time() - 100.0, time.monotonic()
        source.send(image(0), 0, stamp=stamp)
        frame = camera.read()
        assert (
            before - 100.5 - 0.01 <= frame.time <= time.monotonic() - 100.5 + 0.01
        )  # the two clocks were read apart
        assert (camera.time_domain, frame.time) == (
            "global_time",
            pytest.approx(stamp + camera.clock_offset - 0.5, abs=1e-5),  # a stamp of today in ms, as a double
        )


def test_the_time_is_that_of_the_middle_of_the_exposure() -> None:
    source = Device()
    with RealSense("front", device=source.device) as camera:
        stamp = time.time()
        source.set_metadata(frame_timestamp=9_012_000, sensor_timestamp=9_000_000)
        source.send(image(0), 0, stamp=stamp)
        assert camera.read().time == pytest.approx(stamp - 0.012 + camera.clock_offset, abs=1e-5)
        source.send(
            image(0), 1, stamp=stamp, domain="system_time"
        )  # when the image came: no readout of the device
        assert camera.read().time == pytest.approx(stamp + camera.clock_offset, abs=1e-5)


def test_the_offset_of_a_device_clock_is_the_least_delay_seen() -> None:
    source = Device()
    with RealSense("front", device=source.device) as camera:
        times = []
        for number, stamp in enumerate((50.0, 1050.0, 1040.0)):
            before = time.monotonic()
            source.send(image(0), number, stamp=stamp, domain="hardware_clock")
            times.append(camera.read().time - before)
    # The second image came 1000 s sooner after its stamp than the first: from then on its delay counts.
    assert times[:2] == pytest.approx([0.0, 0.0], abs=SOON)
    assert times[2] == pytest.approx(-10.0, abs=SOON)
    assert camera.time_domain == "hardware_clock"


def test_only_the_newest_images_wait() -> None:
    source = Device()
    with RealSense("front", device=source.device) as camera:
        for number in range(10):
            source.send(image(number), number, stamp=time.time())
        newest = [camera.read().depth for _ in range(2)]
        assert np.array_equal(newest[1], image(9))
        with pytest.raises(TimeoutError, match=r"camera 'front' sent no image within 0\.05 s"):
            camera.read(timeout=0.05)


@pytest.mark.parametrize(
    ("options", "error", "words"),
    [
        (
            {"width": 848},
            ValueError,
            "no depth stream of 848 x None at None Hz; the device has 64 x 48 at 30 Hz",
        ),
        ({"rate": 90}, ValueError, "no depth stream of None x None at 90 Hz"),
        ({"latency": np.nan}, ValueError, "latency is nan s, must be finite"),
        ({"pose": np.zeros((4, 4))}, ValueError, "camera 'front': pose is not a rigid transform"),
    ],
)
def test_what_the_device_does_not_have_is_refused(options: dict[str, Any], error: Any, words: str) -> None:
    source = Device()
    with pytest.raises(error, match=words):
        RealSense("front", device=source.device, **options)


def test_a_device_that_says_too_little_is_refused() -> None:
    for source, words in (
        (Device(unit=None), "has no depth sensor: none that states a unit"),
        (Device("modified_brown_conrady"), "has distortion modified_brown_conrady with"),
    ):
        with pytest.raises((RuntimeError, ValueError), match=words):
            RealSense("front", device=source.device)
    with pytest.raises(RuntimeError, match="has no depth sensor"):
        RealSense("front", device=rs.software_device())
    with pytest.raises(RuntimeError, match="does not stream; read inside"):
        RealSense("front", device=Device().device).read()


def test_a_serial_number_that_is_not_connected_is_named() -> None:
    with pytest.raises(RuntimeError, match="no RealSense camera with serial 'no such number' is connected"):
        RealSense("front", serial="no such number")
