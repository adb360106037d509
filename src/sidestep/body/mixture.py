"""One Gaussian mixture of a point cloud, by expectation maximisation."""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING, Literal, get_args

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from sklearn.mixture import GaussianMixture
    from threadpoolctl import ThreadpoolController

CovarianceType = Literal["spherical", "diagonal", "full"]
COVARIANCE_TYPES: tuple[str, ...] = get_args(CovarianceType)

COVARIANCE_FLOOR = 1e-6
"""Added to the diagonal of every covariance [m^2]: (1 mm)^2, as a flat face has none along its normal."""

MAX_ITERATIONS = 500  # EM of a link's cloud settles within 20 to 200; more only guards against slow ones
LIKELIHOOD_TOLERANCE = (
    1e-4  # [nats per point] EM stops below this gain; 1e-3 stops visibly early at 10 components
)
FINAL_RESTARTS = 3  # EM finds local optima only: the best of three k-means++ starts is kept


@dataclass(frozen=True, eq=False)
class Mixture:
    """A Gaussian mixture p(y) = sum_k pi_k N(y | mu_k, Sigma_k) and how well it describes its cloud.

    Attributes:
        weights: pi (K,), sum 1.
        means: mu (K, 3) [m].
        covariances: Sigma (K, 3, 3) [m^2], eigenvalues at least COVARIANCE_FLOOR.
        log_likelihood: mean of log p over the points it was fitted to [nats].
        converged: whether EM reached its tolerance within its iterations.
    """

    weights: NDArray[np.float64]
    means: NDArray[np.float64]
    covariances: NDArray[np.float64]
    log_likelihood: float
    converged: bool


def fit_mixture(
    points: NDArray[np.float64], num_components: int, *, covariance: CovarianceType = "full", seed: int = 0
) -> Mixture:
    """Fits a Gaussian mixture to points by EM from k-means++ starts.

    Args:
        points: cloud (N, 3) [m], N > num_components.
        num_components: number of Gaussians K, at least 1.
        covariance: "spherical" (s^2 I), "diagonal" (axes of the frame) or "full".
        seed: seed of the starts.

    Raises:
        ValueError: on an unknown covariance type, a bad number of components or points that are not finite.

    Source: Bosc, section 3.1; T3.1, T3.2.
    """
    model = estimator(points, num_components, covariance=covariance, seed=seed, restarts=FINAL_RESTARTS)
    order = np.lexsort(np.round(model.means_, 9).T)  # a fixed order, so that equal fits are equal files
    weights = np.asarray(model.weights_, dtype=np.float64)
    full = _as_matrices(np.asarray(model.covariances_, dtype=np.float64), covariance, num_components)
    return Mixture(
        weights=(weights / weights.sum())[order],
        means=np.asarray(model.means_, dtype=np.float64)[order],
        covariances=full[order],
        log_likelihood=float(model.score(points)),
        converged=bool(model.converged_),
    )


def estimator(
    points: NDArray[np.float64], num_components: int, *, covariance: CovarianceType, seed: int, restarts: int
) -> GaussianMixture:
    """The fitted scikit-learn estimator behind `fit_mixture` (for the selection criteria)."""
    from sklearn.exceptions import ConvergenceWarning  # here: importing it takes a second, only fits need it
    from sklearn.mixture import GaussianMixture

    check_covariance(covariance)
    if num_components < 1:
        raise ValueError(f"number of components is {num_components}, must be at least 1")
    if points.ndim != 2 or points.shape[1] != 3 or len(points) <= num_components:
        raise ValueError(
            f"points have shape {points.shape}, expected (N, 3) with N > {num_components} (the components)"
        )
    if not np.isfinite(points).all():
        raise ValueError(f"point {int(np.argmin(np.isfinite(points).all(axis=1)))} is not finite")
    model = GaussianMixture(
        n_components=num_components,
        covariance_type="diag" if covariance == "diagonal" else covariance,
        reg_covar=COVARIANCE_FLOOR,
        tol=LIKELIHOOD_TOLERANCE,
        max_iter=MAX_ITERATIONS,
        n_init=restarts,
        init_params="k-means++",
        random_state=seed,
    )
    with _thread_pools().limit(limits=1), warnings.catch_warnings():
        warnings.simplefilter("ignore", ConvergenceWarning)  # carried in Mixture.converged instead
        return model.fit(points)


@cache
def _thread_pools() -> ThreadpoolController:
    """The pools of the numeric libraries, which EM keeps to one thread.

    Its matrices are 3 x 3: more threads only wait for each other, twenty times slower on a busy machine.
    """
    from threadpoolctl import ThreadpoolController

    return ThreadpoolController()


def check_covariance(covariance: str) -> None:
    """Raises ValueError unless the covariance type is a known one."""
    if covariance not in COVARIANCE_TYPES:
        raise ValueError(f"covariance is {covariance!r}, must be one of {', '.join(COVARIANCE_TYPES)}")


def _as_matrices(
    covariances: NDArray[np.float64], covariance: CovarianceType, num_components: int
) -> NDArray[np.float64]:
    """scikit-learn's (K,), (K, 3) or (K, 3, 3) covariances as (K, 3, 3), exactly symmetric."""
    if covariance == "full":
        return 0.5 * (covariances + covariances.transpose(0, 2, 1))
    variances = np.broadcast_to(covariances.reshape(num_components, -1), (num_components, 3))
    return np.asarray(variances[:, :, None] * np.eye(3))
