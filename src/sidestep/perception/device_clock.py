"""The time stamps of a camera, on the clock of the controller."""

from __future__ import annotations

import math
import time

from sidestep.perception.least_delay_clock import LeastDelayClock


class DeviceClock:
    """Turns a RealSense's time stamps into times of `time.monotonic()`: stamp - since_exposure + offset - latency.

    What a stamp is, its `domain`, decides how well the time is known:

    - global_time (D400 on Linux and Windows): the driver has matched the device's clock with the computer's. The offset
      is that of the computer's two clocks, read anew for each image, so that a set clock does no harm.
    - system_time: the computer's clock when the image came. Images are older than that, by exposure and transport,
      20–40 ms: measure it and give it as `latency`.
    - hardware_clock: a clock of the device. The offset is the least of (arrival - stamp) in the last 10 to 20 s
      (`LeastDelayClock`): right but for the shortest transport, for which `latency` stands again.

    Attributes:
        domain: of the last stamp; "" before the first.
        offset: added to the last stamp [s]; nan before the first.
    """

    def __init__(self, latency: float) -> None:
        """Begins without an offset.

        Args:
            latency: subtracted from all times [s].

        Raises:
            ValueError: it is not finite.
        """
        if not math.isfinite(latency):
            raise ValueError(f"latency is {latency} s, must be finite")
        self.domain, self.offset = "", math.nan
        self._latency, self._device = latency, LeastDelayClock()

    def captured(self, stamp: float, domain: str, *, arrival: float, since_exposure: float) -> float:
        """When an image was captured, on the clock of `time.monotonic()` [s].

        Args:
            stamp: of the image [s].
            domain: what the stamp is.
            arrival: when the image came, on the clock of `time.monotonic()` [s].
            since_exposure: from the middle of the exposure to a stamp of the device [s], or 0; no matter where the
                stamp is system_time.
        """
        self.domain = domain
        if domain == "hardware_clock":
            self._device.measured(stamp, arrival)
            self.offset = self._device.offset
        else:
            self.offset = time.monotonic() - time.time()
        age = 0.0 if domain == "system_time" else since_exposure
        return stamp - age + self.offset - self._latency
