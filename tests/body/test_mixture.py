"""EM recovers mixtures whose parameters are known, in each covariance type."""

import numpy as np
import pytest
from scipy.stats import multivariate_normal

from sidestep.body import fit_mixture
from sidestep.body.mixture import COVARIANCE_FLOOR, CovarianceType

WEIGHTS = np.array([0.3, 0.7])
MEANS = np.array([[-0.3, 0.1, 0.0], [0.4, -0.2, 0.2]])
NUM_POINTS = 20000


def draw(covariances: np.ndarray) -> np.ndarray:
    rng = np.random.default_rng(11)
    counts = (WEIGHTS * NUM_POINTS).astype(int)
    return np.concatenate(
        [rng.multivariate_normal(m, c, n) for m, c, n in zip(MEANS, covariances, counts, strict=True)]
    )


def true_covariances(kind: CovarianceType) -> np.ndarray:
    if kind == "spherical":
        return np.array([0.05**2 * np.eye(3), 0.08**2 * np.eye(3)])
    diagonal = np.array([np.diag([0.1, 0.04, 0.02]) ** 2, np.diag([0.03, 0.05, 0.12]) ** 2])
    if kind == "diagonal":
        return diagonal
    turn, _ = np.linalg.qr(np.random.default_rng(2).normal(size=(3, 3)))
    return np.asarray(turn @ diagonal @ turn.T)


@pytest.mark.parametrize("kind", ["spherical", "diagonal", "full"])
def test_known_mixtures_are_recovered(kind: CovarianceType) -> None:
    truth = true_covariances(kind)
    mixture = fit_mixture(draw(truth), 2, covariance=kind, seed=0)
    order = np.argsort(mixture.means[:, 0])
    # standard errors with 6000 points or more: means 0.12 / sqrt(6000) = 0.0016, variances 2 % of 0.12^2;
    # four of each
    np.testing.assert_allclose(mixture.weights[order], WEIGHTS, atol=0.01)
    np.testing.assert_allclose(mixture.means[order], MEANS, atol=0.0065)
    np.testing.assert_allclose(mixture.covariances[order], truth, atol=0.08 * 0.12**2)
    assert mixture.converged


@pytest.mark.parametrize("kind", ["spherical", "diagonal"])
def test_restricted_covariances_have_their_form(kind: CovarianceType) -> None:
    covariances = fit_mixture(draw(true_covariances("full")), 3, covariance=kind, seed=0).covariances
    for covariance in covariances:
        np.testing.assert_array_equal(covariance, np.diag(np.diag(covariance)))
        assert (len(set(np.diag(covariance))) == 1) == (kind == "spherical")


def test_log_likelihood_is_the_mean_log_density() -> None:
    points = draw(true_covariances("full"))
    mixture = fit_mixture(points, 2, seed=0)
    density = sum(
        w * multivariate_normal(m, c).pdf(points)
        for w, m, c in zip(mixture.weights, mixture.means, mixture.covariances, strict=True)
    )
    # the same sum by SciPy; rounding of 20000 logarithms of order 10
    assert mixture.log_likelihood == pytest.approx(np.log(density).mean(), rel=1e-10)


def test_a_flat_face_gets_the_floor_as_its_variance() -> None:
    points = np.random.default_rng(0).uniform(-0.1, 0.1, (500, 3))
    points[:, 2] = 0.05
    covariance = fit_mixture(points, 1, seed=0).covariances[0]
    # no spread along z at all, so only the floor is left; rounding of a mean of squares of 0.05
    assert covariance[2, 2] == pytest.approx(COVARIANCE_FLOOR, rel=1e-6)
    assert np.linalg.eigvalsh(covariance).min() >= COVARIANCE_FLOOR * (1.0 - 1e-6)


def test_equal_seeds_give_equal_mixtures() -> None:
    points = draw(true_covariances("full"))[::10]
    first, second = (fit_mixture(points, 5, seed=4) for _ in range(2))
    np.testing.assert_array_equal(first.means, second.means)
    np.testing.assert_array_equal(first.covariances, second.covariances)


def test_bad_requests_are_refused() -> None:
    points = np.random.default_rng(0).normal(size=(20, 3))
    with pytest.raises(ValueError, match="covariance is 'tied', must be one of spherical, diagonal, full"):
        fit_mixture(points, 2, covariance="tied")  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="number of components is 0"):
        fit_mixture(points, 0)
    with pytest.raises(ValueError, match=r"points have shape \(20, 3\), expected \(N, 3\) with N > 20"):
        fit_mixture(points, 20)
    points[7, 1] = np.nan
    with pytest.raises(ValueError, match="point 7 is not finite"):
        fit_mixture(points, 2)
