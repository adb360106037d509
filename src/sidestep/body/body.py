"""The body of a robot: a Gaussian mixture per link, in the link's frame."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from sidestep import _core
from sidestep.body import cache as fit_cache
from sidestep.body import file as body_file
from sidestep.body.fitting import Components, FitSettings, LinkFit, Progress, fit_links
from sidestep.body.mixture import CovarianceType
from sidestep.body.selection import MAX_COMPONENTS

if TYPE_CHECKING:
    from sidestep.robot import Robot


class Body(_core.Body):
    """A Gaussian mixture per link: p_l(y) = sum_k pi_k N(y | mu_k, Sigma_k), y in the frame of link l.

    Attributes:
        links: link of each component, (K,).
        weights: pi (K,), sum 1 within a link.
        means: mu (K, 3) [m], link frame.
        covariances: Sigma (K, 3, 3) [m^2], link frame.
        num_components: K, over all links.
        robot_name, fingerprint: the robot it was fitted to; empty for a body made by hand.
        settings: what the fit was asked for, or None for a body made by hand.
        link_fits: how well each link is described, in the order of the links; empty for a body made by hand.

    Source: Bosc, section 3.1; T3.1 to T3.3.
    """

    robot_name: str
    fingerprint: str
    settings: FitSettings | None
    link_fits: tuple[LinkFit, ...]

    def __init__(
        self,
        *,
        links: Sequence[str],
        weights: ArrayLike,
        means: ArrayLike,
        covariances: ArrayLike,
        robot_name: str = "",
        fingerprint: str = "",
        settings: FitSettings | None = None,
        link_fits: Sequence[LinkFit] = (),
    ) -> None:
        super().__init__(
            links=list(links),
            weights=np.asarray(weights, dtype=np.float64),
            means=np.asarray(means, dtype=np.float64),
            covariances=np.asarray(covariances, dtype=np.float64),
        )
        self.robot_name = robot_name
        self.fingerprint = fingerprint
        self.settings = settings
        self.link_fits = tuple(link_fits)

    @classmethod
    def fit(
        cls,
        robot: Robot,
        *,
        components: Components = 4,
        covariance: CovarianceType = "full",
        seed: int = 0,
        samples: int = 2000,
        max_components: int = MAX_COMPONENTS,
        progress: Progress | None = None,
        cache: bool = True,
    ) -> Body:
        """Fits a mixture by EM to points sampled on the surface of each link.

        Every link with geometry is included, also those fixed to the world, which the embedding
        skips.

        Args:
            robot: the robot, with geometry.
            components: Gaussians per link: a number, {link: number} for every link with geometry, or "aic" or
                "bic" to choose 1 to max_components per link by a 10-fold cross-validation.
            covariance: "spherical", "diagonal" or "full".
            seed: seed of the sampling and of EM.
            samples: surface points per link.
            max_components: end of the range that "aic" and "bic" search.
            progress: called as progress(link, steps_done, steps_in_all); not called when the cache answers.
            cache: whether to read and write the user's cache (SIDESTEP_CACHE_DIR overrides its place).

        Raises:
            ValueError: that names the argument at fault and what is allowed.

        Source: Bosc, section 3.1.
        """
        if isinstance(components, Mapping):
            components = dict(components)
        settings = FitSettings(
            components=components,
            covariance=covariance,
            seed=seed,
            samples=samples,
            max_components=max_components,
        )
        settings.validate(robot)
        stored = fit_cache.read(robot, settings) if cache else None
        if stored is not None:
            return cls._from_contents(stored)
        fits = fit_links(robot, settings, progress)
        contents = body_file.BodyContents(
            robot_name=robot.name,
            fingerprint=robot.fingerprint,
            settings=settings,
            links=tuple(body_file.LinkContents.of(fit, mixture) for fit, mixture in fits),
        )
        if cache:
            fit_cache.write(robot, settings, contents)
        return cls._from_contents(contents)

    def save(self, path: str | Path) -> None:
        """Writes the body to a versioned JSON file.

        Raises:
            ValueError: if the body was made by hand: without the robot of a fit, `load` could not check it.
        """
        body_file.write(path, self._contents())

    @classmethod
    def load(cls, path: str | Path, robot: Robot) -> Body:
        """Reads a body file and checks that it belongs to this robot.

        Raises:
            FileNotFoundError: if there is no such file.
            ValueError: if the file is malformed, of another version, or of a robot with another kinematic
                structure or geometry.
        """
        return cls._from_contents(body_file.read(path, robot))

    @classmethod
    def _from_contents(cls, contents: body_file.BodyContents) -> Body:
        return cls(
            **contents.arrays(),
            robot_name=contents.robot_name,
            fingerprint=contents.fingerprint,
            settings=contents.settings,
            link_fits=[link.fit for link in contents.links],
        )

    def _contents(self) -> body_file.BodyContents:
        if self.settings is None or not self.fingerprint:
            raise ValueError(
                "this body was made by hand and belongs to no robot, so it cannot be saved; "
                "Body.fit(robot) makes one that can"
            )
        owner = np.asarray(self.links)
        return body_file.BodyContents(
            robot_name=self.robot_name,
            fingerprint=self.fingerprint,
            settings=self.settings,
            links=tuple(
                body_file.LinkContents(
                    fit=fit,
                    weights=self.weights[owner == fit.link],
                    means=self.means[owner == fit.link],
                    covariances=self.covariances[owner == fit.link],
                )
                for fit in self.link_fits
            ),
        )
