"""What is gone is cleared by the second image that sees through it."""

from __future__ import annotations

import pytest
from tests.bench.camera_stand_ins import needs_opengl

from sidestep.bench import clearing_images


@pytest.mark.parametrize("noise", ["none", "d435"])
def test_a_ball_that_is_gone_is_cleared_within_two_images(noise: str) -> None:
    with needs_opengl():
        shown, first, second = clearing_images("fr3", noise=noise, size="424x240")
    # A half of a sphere of 6 cm in cells of 2 cm: 2 pi 6^2 / 2^2 = 57 cells, more where the surface is oblique to them.
    assert 57 <= shown <= 120
    assert first > 0
    assert second == 0
