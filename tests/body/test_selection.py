"""AIC and BIC over a 10-fold cross-validation."""

import numpy as np
import pytest
from scipy.stats import multivariate_normal

from sidestep.body import CriterionCurve, criterion_curve


def three_clusters(count: int = 600) -> np.ndarray:
    rng = np.random.default_rng(5)
    centres = np.array([[0.0, 0.0, 0.0], [0.5, 0.0, 0.0], [0.0, 0.5, 0.3]])
    return centres[rng.integers(0, 3, count)] + 0.03 * rng.normal(size=(count, 3))


def test_three_clusters_are_found_by_both_criteria() -> None:
    curve = criterion_curve(three_clusters(), max_components=6, seed=0)
    np.testing.assert_array_equal(curve.components, [1, 2, 3, 4, 5, 6])
    assert curve.best("aic") == 3
    assert curve.best("bic") == 3


def test_one_component_against_the_formulas() -> None:
    # with one Gaussian EM has nothing to search: its mean and covariance are those of the training part
    points = three_clusters(200)
    curve = criterion_curve(points, max_components=1, seed=9)
    folds = np.array_split(np.random.default_rng(9).permutation(200), 10)
    aic, bic = [], []
    for fold in folds:
        training = np.delete(points, fold, axis=0)
        covariance = np.cov(training.T, bias=True) + 1e-6 * np.eye(3)
        log_likelihood = multivariate_normal(training.mean(axis=0), covariance).logpdf(points[fold]).sum()
        aic.append(-2.0 * log_likelihood + 2.0 * 9)  # 3 of the mean and 6 of the covariance
        bic.append(-2.0 * log_likelihood + np.log(20.0) * 9)
    # two routes to the same sums; rounding of covariances near the floor
    assert curve.aic[0] == pytest.approx(np.mean(aic), rel=1e-8)
    assert curve.bic[0] == pytest.approx(np.mean(bic), rel=1e-8)


def test_the_smaller_number_wins_a_tie() -> None:
    curve = CriterionCurve(np.array([1, 2, 3]), np.array([5.0, 4.0, 4.0]), np.array([1.0, 1.0, 2.0]))
    assert curve.best("aic") == 2
    assert curve.best("bic") == 1


def test_too_few_points_are_refused() -> None:
    with pytest.raises(ValueError, match=r"99 points are too few to choose among 1 to 10 .* at least 100"):
        criterion_curve(three_clusters(99))
    with pytest.raises(ValueError, match="max_components is 0"):
        criterion_curve(three_clusters(), max_components=0)
