"""Fits the mixtures of all links of a robot."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, cast

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from sidestep.body.mixture import CovarianceType, Mixture, check_covariance, fit_mixture
from sidestep.body.sampling import check_components, link_seed, links_with_geometry, sample_link
from sidestep.body.selection import (
    CRITERIA,
    MAX_COMPONENTS,
    NUM_FOLDS,
    Criterion,
    CriterionCurve,
    criterion_curve,
)
from sidestep.math.matrices import inverse

if TYPE_CHECKING:
    from sidestep.robot import Robot

Components = int | Mapping[str, int] | Criterion
Progress = Callable[[str, int, int], None]
"""Called as progress(link, steps_done, steps_in_all) before each step and once at the end."""

ELLIPSOID_STD = 2.0
"""Standard deviations at which a Gaussian is drawn and its coverage counted."""


@dataclass(frozen=True)
class FitSettings:
    """What a fit was asked for: equal settings on an equal robot give an equal body.

    Attributes:
        components: number per link, {link: number}, "aic" or "bic".
        covariance: "spherical", "diagonal" or "full".
        seed: seed of the sampling and of EM.
        samples: surface points per link.
        max_components: end of the range that "aic" and "bic" search.
    """

    components: Components = 4
    covariance: CovarianceType = "full"
    seed: int = 0
    samples: int = 2000
    max_components: int = MAX_COMPONENTS

    def validate(self, robot: Robot) -> None:
        """Raises ValueError that names the setting, its value and what is allowed on this robot."""
        links = links_with_geometry(robot)
        if not links:
            raise ValueError(f"robot '{robot.name}' has no link with geometry to fit a body to")
        check_covariance(self.covariance)
        if self.seed < 0:
            raise ValueError(f"seed is {self.seed}, must be >= 0")
        if isinstance(self.components, str):
            if self.components not in CRITERIA:
                raise ValueError(
                    f"components is {self.components!r}, must be a number, a number per link, "
                    f"or one of {', '.join(CRITERIA)}"
                )
            if self.max_components < 1 or self.samples < NUM_FOLDS * self.max_components:
                raise ValueError(
                    f"samples is {self.samples} and max_components is {self.max_components}: "
                    f"choosing needs at least {NUM_FOLDS} samples per component"
                )
            return
        check_components(self.components, links)
        for link in links:
            if self.samples <= self.number_for(link):
                raise ValueError(
                    f"samples is {self.samples}, must be above the {self.number_for(link)} components of '{link}'"
                )

    def number_for(self, link: str) -> int:
        """The number of components asked for a link, when it is given and not chosen by a criterion."""
        return self.components[link] if isinstance(self.components, Mapping) else cast(int, self.components)


@dataclass(frozen=True, eq=False)
class LinkFit:
    """How well the mixture of one link describes the link's surface.

    Attributes:
        link: name of the link.
        num_components: number of Gaussians.
        log_likelihood: mean log-density over the surface samples [nats]; higher is tighter.
        coverage: share of the samples inside the union of the 2-sigma ellipsoids.
        mean_distance: mean distance [m] of a sample from the nearest component mean. This is the error of a
            controller that measures distances to means (T6.1).
        converged: whether EM converged.
        curve: AIC and BIC when one of them chose the number, else None.
    """

    link: str
    num_components: int
    log_likelihood: float
    coverage: float
    mean_distance: float
    converged: bool
    curve: CriterionCurve | None = None


def fit_links(
    robot: Robot, settings: FitSettings, progress: Progress | None = None
) -> tuple[tuple[LinkFit, Mixture], ...]:
    """Samples every link that has geometry and fits its mixture.

    Links fixed to the world are included, because plots and simulations show them; the embedding skips them,
    since no joint moves them.

    Raises:
        ValueError: if the settings do not suit the robot.
    """
    settings.validate(robot)
    links = links_with_geometry(robot)
    steps_per_link = 1 + (settings.max_components if isinstance(settings.components, str) else 0)
    total = steps_per_link * len(links)
    done = 0
    fits = []

    def report(link: str, steps: int) -> None:
        nonlocal done
        done += steps
        if progress is not None:
            progress(link, done, total)

    for link in links:
        report(link, 0)
        points = sample_link(robot, link, count=settings.samples, seed=settings.seed)
        seed = link_seed(link, seed=settings.seed)
        curve = None
        if isinstance(settings.components, str):
            curve = criterion_curve(
                points,
                covariance=settings.covariance,
                max_components=settings.max_components,
                seed=seed,
                on_step=lambda link=link: report(link, 1),  # type: ignore[misc]
            )
            number = curve.best(settings.components)
        else:
            number = settings.number_for(link)
        mixture = fit_mixture(points, number, covariance=settings.covariance, seed=seed)
        fits.append((assess(link, points, mixture, curve), mixture))
        report(link, 1)
    return tuple(fits)


def mahalanobis_squared(points: NDArray[np.float64], mixture: Mixture) -> NDArray[np.float64]:
    """(y - mu_k)^T Sigma_k^-1 (y - mu_k) for points (N, 3) and every component: (N, K)."""
    offsets = points[:, None, :] - mixture.means[None, :, :]
    precisions = inverse(mixture.covariances)
    return np.asarray(np.einsum("nki,kij,nkj->nk", offsets, precisions, offsets))


def assess(link: str, points: NDArray[np.float64], mixture: Mixture, curve: CriterionCurve | None) -> LinkFit:
    """How well a mixture describes points (N, 3) on the surface of a link."""
    inside = (mahalanobis_squared(points, mixture) <= ELLIPSOID_STD**2).any(axis=1)
    distances, _ = cKDTree(mixture.means).query(points)
    return LinkFit(
        link=link,
        num_components=len(mixture.weights),
        log_likelihood=mixture.log_likelihood,
        coverage=float(inside.mean()),
        mean_distance=float(distances.mean()),
        converged=mixture.converged,
        curve=curve,
    )
