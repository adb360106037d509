"""Sums of embeddings."""

import numpy as np
import pytest

import sidestep as ss
from sidestep import thesis
from support.random_scene import scene


def test_a_sum_adds_values_jacobians_curvatures_and_hessians() -> None:
    case = scene("ur5")
    density = thesis.CollisionDensity(case.robot, case.body)
    limits = thesis.JointLimitPotential(case.robot, slope=5.0)
    total = thesis.Sum([density, limits])
    assert total.num_coordinates == 1
    for state in case.states:
        arguments = state.q, state.v, state.obstacles
        a, b, c = (e.evaluate(*arguments) for e in (density, limits, total))
        for name in ("values", "jacobian", "curvatures"):
            # the same numbers added in another order
            expected = getattr(a, name) + getattr(b, name)
            np.testing.assert_allclose(getattr(c, name), expected, rtol=1e-12, atol=1e-12)
        hessian = density.hessian(state.q, state.obstacles) + limits.hessian(state.q, state.obstacles)
        scale = np.abs(hessian).max()
        np.testing.assert_allclose(
            total.hessian(state.q, state.obstacles), hessian, rtol=0, atol=1e-12 * scale
        )


@pytest.mark.slow
def test_terms_must_fit_together() -> None:
    with pytest.raises(ValueError, match="sum of embeddings: there is no term"):
        thesis.Sum([])
    planar2, planar3 = (thesis.JointLimitPotential(ss.Robot.named(n)) for n in ("planar2", "planar3"))
    with pytest.raises(ValueError, match="terms were made for robots 'planar2' and 'planar3'"):
        thesis.Sum([planar2, planar3])
