"""Choice of the number of components by AIC or BIC over a 10-fold cross-validation."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from sidestep.body.mixture import CovarianceType, estimator

Criterion = Literal["aic", "bic"]
CRITERIA: tuple[str, ...] = get_args(Criterion)

NUM_FOLDS = 10  # Bosc, figure 3.2
MAX_COMPONENTS = 10  # default end of the range searched, which starts at 1


@dataclass(frozen=True, eq=False)
class CriterionCurve:
    """AIC and BIC of a link against its number of components.

    Attributes:
        components: numbers of components tried, (n,).
        aic: mean over the folds of -2 log L + 2 p, (n,).
        bic: mean over the folds of -2 log L + p log N, (n,).

    L is the likelihood of the N points held out of the fold, p the number of free parameters.
    """

    components: NDArray[np.int64]
    aic: NDArray[np.float64]
    bic: NDArray[np.float64]

    def best(self, criterion: Criterion) -> int:
        """The number of components with the lowest mean criterion (the smaller one on a tie)."""
        values = self.aic if criterion == "aic" else self.bic
        return int(self.components[np.argmin(values)])


def criterion_curve(
    points: NDArray[np.float64],
    *,
    covariance: CovarianceType = "full",
    max_components: int = MAX_COMPONENTS,
    seed: int = 0,
    on_step: Callable[[], None] | None = None,
) -> CriterionCurve:
    """AIC and BIC for 1 … max_components Gaussians by 10-fold cross-validation.

    The cloud is shuffled and cut into ten parts. For each part a mixture is fitted by EM to the other nine,
    and AIC and BIC are evaluated on the part left out, with N the size of that part; the curve is the mean of
    the ten. The thesis does not say on which points it evaluates them. Held-out points already punish
    overfitting, so the penalty on top favours small bodies, which is what the thesis asks for. The choice
    depends on the number of samples: more points ask for more components.

    Args:
        points: cloud (N, 3) [m], at least 10 points per component that is tried.
        covariance: covariance type of the mixtures.
        max_components: end of the range 1 … max_components.
        seed: seed of the shuffle and of the starts.
        on_step: called after each number of components.

    Raises:
        ValueError: if there are too few points for the range.

    Source: Bosc, section 3.1 and figure 3.2.
    """
    if max_components < 1:
        raise ValueError(f"max_components is {max_components}, must be at least 1")
    if len(points) < NUM_FOLDS * max_components:
        raise ValueError(
            f"{len(points)} points are too few to choose among 1 to {max_components} components: "
            f"at least {NUM_FOLDS * max_components} are needed"
        )
    order = np.random.default_rng(seed).permutation(len(points))
    folds = np.array_split(order, NUM_FOLDS)
    aic, bic = [], []
    for num_components in range(1, max_components + 1):
        scores = []
        for fold in folds:
            training = points[np.setdiff1d(order, fold, assume_unique=True)]
            model = estimator(training, num_components, covariance=covariance, seed=seed, restarts=1)
            scores.append((model.aic(points[fold]), model.bic(points[fold])))
        mean_aic, mean_bic = np.mean(scores, axis=0)
        aic.append(mean_aic)
        bic.append(mean_bic)
        if on_step is not None:
            on_step()
    return CriterionCurve(np.arange(1, max_components + 1), np.asarray(aic), np.asarray(bic))
