"""Depth images from a RealSense camera."""

from __future__ import annotations

import time
from collections.abc import Iterator
from types import ModuleType, TracebackType
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from sidestep.perception.camera_record import CameraRecord
from sidestep.perception.device_clock import DeviceClock
from sidestep.perception.frame import Frame

if TYPE_CHECKING:
    import pyrealsense2 as rs

_MODELS = {  # of distortion
    "none": "none",
    "brown_conrady": "brown_conrady",
    "inverse_brown_conrady": "inverse_brown_conrady",
    "kannala_brandt4": "kannala_brandt",
}
_HELD = 2  # images that wait to be read; older ones are dropped


class RealSense:
    """A live RealSense camera, or a `pyrealsense2.software_device` that stands for one.

    Use it in a `with` block: the camera streams inside it. The depth is in the frame of the left infrared camera, as
    the device sends it: neither filtered nor aligned to colour.

    The time of a frame is when the middle of its exposure was, on the clock of `time.monotonic()`, which is that of
    `Controller.step`; see `DeviceClock` for how well it is known.

    Attributes:
        camera: what the device says of itself.
        cameras: the same, in a list, as recordings have it.
        joint_names: empty; the state is told to the controller by `step`.
        times_known: True.
        lost: images that the device numbered and nobody read.
    """

    times_known = True

    def __init__(
        self,
        name: str,
        *,
        width: int | None = None,
        height: int | None = None,
        rate: int | None = None,
        serial: str | None = None,
        pose: npt.ArrayLike | None = None,
        link: str = "",
        latency: float = 0.0,
        device: rs.software_device | rs.device | None = None,
    ) -> None:
        """Finds the device and its depth stream; does not start it.

        Args:
            name: of the camera.
            width, height: of the images [pixel]; None: as the device has it by default.
            rate: images a second [Hz]; None: as the device has it by default.
            serial: number of the device; None: the only one.
            pose: pose (4, 4) of the camera in the world, or in `link`.
            link: the link of the arm that carries the camera; "" for one that stands in the world.
            latency: subtracted from the times [s], see `DeviceClock`.
            device: an opened device instead of one at a port.

        Raises:
            RuntimeError: there is no such device, or it has no depth.
            ValueError: several devices and no serial number, no stream of that size and rate, or an unknown distortion;
                names those there are.
        """
        self._rs = _driver()
        self._device = _found_device(self._rs, serial) if device is None else device
        self._sensor = _depth_sensor(self._device)
        self._profile = self._chosen_profile(width, height, rate)
        self.camera = self._record(name, pose, link)
        self.cameras = [self.camera]
        self.joint_names: tuple[str, ...] = ()
        self.lost = 0
        self._clock, self._number = DeviceClock(latency), -1
        self._queue: Any = None

    def __enter__(self) -> RealSense:
        self._queue = self._rs.frame_queue(_HELD, True)
        self._sensor.open(self._profile)
        try:
            self._sensor.start(self._queue)
        except BaseException:
            self._sensor.close()
            raise
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._sensor.stop()
        self._sensor.close()
        self._queue = None

    def read(self, *, timeout: float = 1.0) -> Frame:
        """The next image; waits for it at most `timeout` [s].

        Raises:
            TimeoutError: none came.
            RuntimeError: the camera does not stream: `read` stands outside the `with` block.
        """
        if self._queue is None:
            raise RuntimeError(f"camera '{self.camera.name}' does not stream; read inside `with camera:`")
        came, image = self._queue.try_wait_for_frame(round(1000.0 * timeout))
        if not came:
            raise TimeoutError(f"camera '{self.camera.name}' sent no image within {timeout} s")
        depth = image.as_depth_frame()
        arrival = time.monotonic()
        number = int(depth.get_frame_number())
        if self._number >= 0 and number > self._number + 1:
            self.lost += number - self._number - 1
        self._number = number
        captured = self._captured(depth, arrival)
        pixels = np.array(depth.get_data(), dtype=np.uint16)  # a copy: the driver uses its buffer again
        return Frame(self.camera.name, captured, pixels, _rounded(depth.get_units()))

    def frames(self, *, timeout: float = 1.0) -> Iterator[Frame]:
        """The images as they come, without end, see `read`."""
        while True:
            yield self.read(timeout=timeout)

    def _captured(self, depth: Any, arrival: float) -> float:
        """When the middle of the exposure was, on the clock of `time.monotonic()` [s]."""
        metadata = self._rs.frame_metadata_value
        both = (metadata.frame_timestamp, metadata.sensor_timestamp)
        since_exposure = 0.0
        if all(depth.supports_frame_metadata(value) for value in both):
            readout, middle = (depth.get_frame_metadata(value) for value in both)
            since_exposure = 1e-6 * (readout - middle)
        domain = depth.get_frame_timestamp_domain().name
        return self._clock.captured(
            1e-3 * depth.get_timestamp(), domain, arrival=arrival, since_exposure=since_exposure
        )

    @property
    def time_domain(self) -> str:
        """What the last time stamp was, see `DeviceClock`; "" before the first."""
        return self._clock.domain

    @property
    def clock_offset(self) -> float:
        """Added to the last time stamp [s]; nan before the first."""
        return self._clock.offset

    def _chosen_profile(self, width: int | None, height: int | None, rate: int | None) -> Any:
        """The stream of depth of a size and rate; the default one where it fits."""
        profiles = [
            profile.as_video_stream_profile()
            for profile in self._sensor.get_stream_profiles()
            if profile.stream_type() == self._rs.stream.depth and profile.format() == self._rs.format.z16
        ]
        fitting = [
            profile
            for profile in profiles
            if width in (None, profile.width())
            and height in (None, profile.height())
            and rate in (None, profile.fps())
        ]
        if not fitting:
            offered = sorted({(p.width(), p.height(), p.fps()) for p in profiles})
            words = ", ".join(f"{w} x {h} at {f} Hz" for w, h, f in offered) or "none"
            raise ValueError(f"no depth stream of {width} x {height} at {rate} Hz; the device has {words}")
        return next((profile for profile in fitting if profile.is_default()), fitting[0])

    def _record(self, name: str, pose: npt.ArrayLike | None, link: str) -> CameraRecord:
        """The camera as the device describes it."""
        intrinsics = self._profile.get_intrinsics()
        coefficients = np.array(intrinsics.coeffs, dtype=np.float64)
        model = intrinsics.model.name if coefficients.any() else "none"
        if model not in _MODELS:
            raise ValueError(
                f"camera '{name}' has distortion {model} with {coefficients.tolist()}, must be {', '.join(_MODELS)}"
            )
        return CameraRecord(
            name,
            intrinsics.width,
            intrinsics.height,
            intrinsics.fx,
            intrinsics.fy,
            intrinsics.ppx,
            intrinsics.ppy,
            _MODELS[model],
            coefficients,
            pose=None if pose is None else np.asarray(pose, dtype=np.float64),
            link=link,
            unit=_rounded(self._sensor.get_depth_scale()),
        )


def _driver() -> ModuleType:
    try:
        import pyrealsense2
    except ModuleNotFoundError:
        raise
    except ImportError as error:
        raise ImportError(
            f"pyrealsense2 cannot be loaded: {error}; on Debian and Ubuntu it needs the package libusb-1.0-0"
        ) from error
    module: ModuleType = pyrealsense2
    return module


def _found_device(driver: Any, serial: str | None) -> Any:
    """The device at a port that has a serial number, or the only one."""
    devices = list(driver.context().query_devices())
    numbers = [device.get_info(driver.camera_info.serial_number) for device in devices]
    if serial is None and len(devices) > 1:
        raise ValueError(f"several RealSense cameras are connected, choose a serial: {', '.join(numbers)}")
    for device, number in zip(devices, numbers, strict=True):
        if serial in (None, number):
            return device
    which = "" if serial is None else f" with serial {serial!r}"
    raise RuntimeError(f"no RealSense camera{which} is connected; connected: {', '.join(numbers) or 'none'}")


def _depth_sensor(device: Any) -> Any:
    for sensor in device.query_sensors():
        if sensor.is_depth_sensor():
            return sensor.as_depth_sensor()
    raise RuntimeError("the device has no depth sensor: none that states a unit of its depth")


def _rounded(unit: float) -> float:
    """A unit [m] that the driver keeps in single precision, as it was meant: 0.001, not 0.0010000000475."""
    return float(f"{unit:.6g}")
