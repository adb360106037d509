"""What tests need that render images."""

from __future__ import annotations

import ctypes.util
import sys

import pytest

NEEDS_EGL = pytest.mark.skipif(
    sys.platform == "linux" and ctypes.util.find_library("EGL") is None,
    reason="there is no EGL here (apt-get install libegl1 libgl1-mesa-dri)",
)
