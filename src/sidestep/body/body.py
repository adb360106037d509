"""The body of a robot: a Gaussian mixture per link, in the link's frame."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from sidestep import _core, shipped_arms
from sidestep.body import cache as fit_cache
from sidestep.body import file as body_file
from sidestep.body.cover import CoverProgress, cover_mixtures
from sidestep.body.cover_problem import EffortName
from sidestep.body.cover_settings import CoverSettings, LinkCover, components_for
from sidestep.body.fitting import Components, FitSettings, LinkFit, Progress, fit_links
from sidestep.body.mixture import CovarianceType
from sidestep.body.of_arm import contents_of, fits_of
from sidestep.body.sampling import check_components, links_with_geometry
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
        levels: (K,) or None; of a calibrated body: each link lies inside the union of the ellipsoids
            (y - mu)^T Sigma^-1 (y - mu) <= level.
        robot_name, fingerprint: the robot it was fitted to; empty for a body made by hand.
        settings: what the fit was asked for, or None for a body made by hand.
        link_covers: how the ellipsoids cover each link; empty unless made by `cover`.

    Source: Bosc, section 3.1; T3.1 to T3.3.
    """

    robot_name: str
    fingerprint: str
    settings: FitSettings | CoverSettings | None
    link_covers: tuple[LinkCover, ...]

    def __init__(
        self,
        *,
        links: Sequence[str],
        weights: ArrayLike,
        means: ArrayLike,
        covariances: ArrayLike,
        levels: ArrayLike | None = None,
        robot_name: str = "",
        fingerprint: str = "",
        settings: FitSettings | CoverSettings | None = None,
        link_fits: Sequence[LinkFit] | Callable[[], Sequence[LinkFit]] = (),
        link_covers: Sequence[LinkCover] = (),
    ) -> None:
        super().__init__(
            links=list(links),
            weights=weights,
            means=means,
            covariances=covariances,
            levels=levels,
        )
        self.robot_name = robot_name
        self.fingerprint = fingerprint
        self.settings = settings
        self._link_fits = link_fits  # or what finds them when they are first asked for
        self.link_covers = tuple(link_covers)

    @property
    def link_fits(self) -> tuple[LinkFit, ...]:
        """How well each link is described, in the order of the links; empty for a body made by hand."""
        if callable(self._link_fits):
            self._link_fits = self._link_fits()
        return tuple(self._link_fits)

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
        return cls._made(
            robot,
            settings,
            lambda: (
                body_file.LinkContents.of(fit, mixture)
                for fit, mixture in fit_links(robot, settings, progress)
            ),
            cache=cache,
        )

    @classmethod
    def cover(
        cls,
        robot: Robot,
        *,
        components: int | Mapping[str, int] | None = None,
        max_components: int | None = None,
        seed: int = 0,
        effort: EffortName = "fine",
        progress: CoverProgress | None = None,
        cache: bool = True,
    ) -> Body:
        """Covers every link with ellipsoids that overshoot it as little as possible.

        The surface of each link lies inside the union of its ellipsoids {y : m_k(y) <= level_k},
        m_k(y) = (y - mu_k)^T Sigma_k^-1 (y - mu_k). This is proven on the triangles of the mesh: each is in one
        ellipsoid or cut until its parts are. Nothing outside can reach the inside of a link without crossing
        its surface, so gaps inside do no harm; `LinkCover.interior_coverage` tells them.

        Sigma_k is the covariance of the solid ellipsoid and pi_k its share of the volume, so that the same body
        has a density.

        A robot with kinematics and meshes of one whose arm comes with Sidestep takes the cover from there, if nothing
        else is asked for.

        Args:
            robot: the robot, with geometry.
            components: ellipsoids per link: one number for all, or {link: number}, such as more for a gripper
                that works close to things. Links that are not named share what is left of max_components so that
                overshoot, relative to the size of the link, is even; all links do if it is None.
            max_components: ellipsoids in all; fewer are used if every link overshoots little enough. By default 80 for
                up to 12 links, and 10 for each one more.
            seed: seed of the starts.
            effort: "draft", "fine" or "best", see `CoverSettings`.
            progress: called as progress(link, done, in_all); not called when the cache answers.
            cache: whether to take covers that come with Sidestep, and to read and write the user's cache
                (SIDESTEP_CACHE_DIR overrides its place).

        Raises:
            ValueError: that names the argument at fault and what is allowed.
        """
        if isinstance(components, Mapping):
            components = dict(components)
        if max_components is None:
            max_components = components_for(len(links_with_geometry(robot)))
        settings = CoverSettings(
            components=components, max_components=max_components, seed=seed, effort=effort
        )
        settings.validate(robot)
        shipped = (
            shipped_arms.with_body_of(robot)
            if cache and replace(settings, effort=CoverSettings.effort) == CoverSettings()
            else None
        )
        if shipped is not None:
            return cls._shipped(shipped, robot, settings)
        return cls._made(
            robot,
            settings,
            lambda: (
                body_file.LinkContents(
                    fit, mixture.weights, mixture.means, mixture.covariances, levels, cover
                )
                for fit, mixture, levels, cover in cover_mixtures(robot, settings, progress, cached=cache)
            ),
            cache=cache,
        )

    def finer(
        self,
        robot: Robot,
        components: Mapping[str, int],
        *,
        progress: CoverProgress | None = None,
        cache: bool = True,
    ) -> Body:
        """This covering body with other covers of some links; those of the others stay as they are.

        Args:
            robot: what it covers. components: ellipsoids of the links that get another cover, {link: number}: more of
                them overshoot less.
            progress, cache: as in `cover`.

        Raises:
            ValueError: the body covers nothing, or not this robot; a link that it does not have; a number below 1.
        """
        if self.levels is not None and not isinstance(self.settings, CoverSettings):
            raise ValueError(
                "the body is of a prepared arm, which does not say how it was made; Body.cover(robot) makes one"
            )
        if self.levels is None or not isinstance(self.settings, CoverSettings):
            raise ValueError(
                "the body does not cover its links (it has no levels); Body.cover(robot) makes one that does"
            )
        if self.fingerprint != robot.fingerprint:
            raise ValueError(
                f"the body was made for robot {self.robot_name!r}, not for {robot.name!r} as it is"
            )
        own = tuple(dict.fromkeys(self.links))
        numbers = {**{link: self.links.count(link) for link in own}, **components}
        check_components(numbers, own)
        effort = "fine" if self.settings.effort == "draft" else self.settings.effort
        settings = replace(
            self.settings,
            components=numbers,
            max_components=sum(numbers.values()),
        )
        made = {
            cover.link: body_file.LinkContents(
                fit, mixture.weights, mixture.means, mixture.covariances, levels, cover
            )
            for fit, mixture, levels, cover in cover_mixtures(
                robot, replace(settings, effort=effort), progress, cached=cache, only=tuple(components)
            )
        }
        links = tuple(made.get(link.fit.link, link) for link in self._contents().links)
        return self._from_contents(body_file.BodyContents(robot.name, robot.fingerprint, settings, links))

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

    def for_robot(self, robot: Robot, *, source: Robot) -> Body:
        """This body for a robot with the same links in other places: fingers that are locked more open, say.

        Args:
            robot: what it is for. source: what it was fitted to.

        Raises:
            ValueError: it was fitted to something else than `source`, or a link's geometry differs.
        """
        if self.fingerprint != source.fingerprint:
            raise ValueError(
                f"the body was fitted to robot '{self.robot_name}', not to '{source.name}' as it is"
            )
        for name in dict.fromkeys(self.links):
            if not robot.link(name).same_geometry(source.link(name)):
                raise ValueError(f"link {name!r} has another geometry in robot '{robot.name}'")
        return Body(
            links=self.links,
            weights=self.weights,
            means=self.means,
            covariances=self.covariances,
            levels=self.levels,
            robot_name=robot.name,
            fingerprint=robot.fingerprint,
            settings=self.settings,
            link_fits=self._link_fits,
            link_covers=self.link_covers,
        )

    @classmethod
    def of_arm(cls, arm: _core.Arm) -> Body:
        """The body of a prepared arm, with what is proven and measured of each link (`link_covers`)."""
        return cls(**contents_of(arm), robot_name=arm.name)

    @classmethod
    def _shipped(cls, arm: _core.Arm, robot: Robot, settings: CoverSettings) -> Body:
        """The cover of an arm that was made by these settings for the meshes of `robot`."""
        fits = partial(fits_of, arm, robot, settings.seed)
        return cls(**contents_of(arm), robot_name=robot.name, settings=settings, link_fits=fits)

    @classmethod
    def _made(
        cls,
        robot: Robot,
        settings: FitSettings | CoverSettings,
        links: Callable[[], Iterable[body_file.LinkContents]],
        *,
        cache: bool,
    ) -> Body:
        """The body of these links, or of the user's cache."""

        def make() -> body_file.BodyContents:
            return body_file.BodyContents(robot.name, robot.fingerprint, settings, tuple(links()))

        contents = fit_cache.stored_or_fitted(robot, settings, make) if cache else make()
        return cls._from_contents(contents)

    @classmethod
    def _from_contents(cls, contents: body_file.BodyContents) -> Body:
        return cls(
            **contents.arrays(),
            robot_name=contents.robot_name,
            fingerprint=contents.fingerprint,
            settings=contents.settings,
            link_fits=[link.fit for link in contents.links],
            link_covers=[link.cover for link in contents.links if link.cover is not None],
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
                    levels=None if self.levels is None else self.levels[owner == fit.link],
                    cover=next((cover for cover in self.link_covers if cover.link == fit.link), None),
                )
                for fit in self.link_fits
            ),
        )
