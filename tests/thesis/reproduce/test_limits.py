import numpy as np
import pytest

from sidestep import Obstacles
from sidestep.thesis import JointLimitPotential
from sidestep.thesis.reproduce import planar
from sidestep.thesis.reproduce.limits import KernelBorder, PotentialBorder

LOWER, UPPER = np.full(2, -np.pi), np.full(2, np.pi)
STEP = 1e-5  # [rad]


@pytest.mark.parametrize(
    "border",
    [KernelBorder(LOWER, UPPER, spacing=np.pi / 8.0), PotentialBorder(LOWER, UPPER, slope=5.0)],
    ids=["kernels", "potential"],
)
def test_derivatives_of_both_borders(border):
    for q in np.random.default_rng(4).uniform(-3.3, 3.3, (50, 2)):
        _, gradient, hessian = border.evaluate(q)
        ahead = [border.evaluate(q + STEP * e) for e in np.eye(2)]
        behind = [border.evaluate(q - STEP * e) for e in np.eye(2)]
        # Central differences: truncation of step² times derivatives of up to 1e3, rounding of 1e-15 / step.
        slope = [(a[0] - b[0]) / (2 * STEP) for a, b in zip(ahead, behind, strict=True)]
        np.testing.assert_allclose(gradient, slope, atol=1e-6)
        change = [(a[1] - b[1]) / (2 * STEP) for a, b in zip(ahead, behind, strict=True)]
        np.testing.assert_allclose(hessian, change, atol=1e-6)


def test_the_potential_that_is_timed_is_the_cores():
    core = JointLimitPotential(planar.arm(), slope=30.0, height=2.0)
    ours = PotentialBorder(LOWER, UPPER, slope=30.0, height=2.0)
    for q in np.random.default_rng(5).uniform(-3.3, 3.3, (50, 2)):
        value, gradient, hessian = ours.evaluate(q)
        found = core.evaluate(q, np.zeros(2), Obstacles.none())
        # The same formula twice; slopes of 30 / rad leave eleven digits.
        assert value == pytest.approx(found.values[0], abs=1e-10)
        np.testing.assert_allclose(gradient, found.jacobian[0], atol=1e-9)
        np.testing.assert_allclose(hessian, core.hessian(q, Obstacles.none()), atol=1e-8)
