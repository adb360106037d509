"""The body file: one versioned JSON document that is checked when it is read."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from sidestep import _core
from sidestep.body.cover_problem import TradeOff
from sidestep.body.cover_settings import CoverSettings, LinkCover
from sidestep.body.fitting import FitSettings, LinkFit
from sidestep.body.mixture import Mixture
from sidestep.body.schema import mismatch, parse_json, shortened
from sidestep.body.selection import CriterionCurve
from sidestep.storage.whole_file import write_text

if TYPE_CHECKING:
    from sidestep.robot import Robot

FORMAT = "sidestep-body"
# 2 added covers and levels. To be raised when a reader of the old files would misread a new one, or when fits change.
FORMAT_VERSION = 2
READABLE_VERSIONS = (1, FORMAT_VERSION)  # version 1 has no levels: good for the density, not for a barrier


@dataclass(frozen=True, eq=False)
class LinkContents:
    """The mixture of one link and the quality of its fit; arrays as in `Mixture`, levels (K,) if calibrated."""

    fit: LinkFit
    weights: NDArray[np.float64]
    means: NDArray[np.float64]
    covariances: NDArray[np.float64]
    levels: NDArray[np.float64] | None = None
    cover: LinkCover | None = None

    @classmethod
    def of(cls, fit: LinkFit, mixture: Mixture) -> LinkContents:
        return cls(fit, mixture.weights, mixture.means, mixture.covariances)


@dataclass(frozen=True, eq=False)
class BodyContents:
    """Everything a body file holds."""

    robot_name: str
    fingerprint: str
    settings: FitSettings | CoverSettings
    links: tuple[LinkContents, ...]

    def arrays(self) -> dict[str, Any]:
        """The mixtures of all links, one after the other, as the arguments of the core's Body."""
        return {
            "links": [link.fit.link for link in self.links for _ in link.weights],
            "weights": np.concatenate([link.weights for link in self.links]),
            "means": np.concatenate([link.means for link in self.links]),
            "covariances": np.concatenate([link.covariances for link in self.links]),
            "levels": None
            if any(link.levels is None for link in self.links)
            else np.concatenate([link.levels for link in self.links if link.levels is not None]),
        }


def write(path: str | Path, contents: BodyContents) -> None:
    """Writes a body file, in one piece."""
    document = {
        "format": FORMAT,
        "format_version": FORMAT_VERSION,
        "sidestep_version": _core.__version__,
        "robot": {"name": contents.robot_name, "fingerprint": contents.fingerprint},
        "settings": asdict(contents.settings),
        "links": [_link_document(link) for link in contents.links],
    }
    write_text(Path(path), json.dumps(document, indent=1, allow_nan=False) + "\n")


def read(path: str | Path, robot: Robot) -> BodyContents:
    """Reads and checks a body file.

    Raises:
        FileNotFoundError: if there is no such file.
        ValueError: that names the file and what is wrong in it.
    """
    path = Path(path)
    if not path.is_file():
        raise FileNotFoundError(f"body file '{path}' does not exist")
    try:
        document = parse_json(path.read_text(encoding="utf-8"))
    except ValueError as error:
        raise ValueError(f"body file '{path}' is not valid JSON: {error}") from error
    _check_version(path, document)
    problem = mismatch(document, (files("sidestep.body") / "body_schema.json").read_text(encoding="utf-8"))
    if problem is not None:
        raise ValueError(
            f"body file '{path}' is malformed at {problem.json_path}: {shortened(problem.message)}"
        )
    name, fingerprint = document["robot"]["name"], document["robot"]["fingerprint"]
    if fingerprint != robot.fingerprint:
        raise ValueError(
            f"body file '{path}' was fitted to robot '{name}' (fingerprint {fingerprint[:12]}) and cannot be "
            f"used with robot '{robot.name}' (fingerprint {robot.fingerprint[:12]}); "
            "their kinematic structure or geometry differs"
        )
    contents = BodyContents(
        robot_name=name,
        fingerprint=fingerprint,
        settings=_settings(document["settings"]),
        links=tuple(_link_contents(link) for link in document["links"]),
    )
    _check_links(path, contents, robot)
    return contents


def _check_version(path: Path, document: Any) -> None:
    if not isinstance(document, dict) or document.get("format") != FORMAT:
        raise ValueError(f"'{path}' is not a body file: its \"format\" is not {FORMAT!r}")
    version = document.get("format_version")
    if version not in READABLE_VERSIONS:
        raise ValueError(
            f"body file '{path}' has format version {shortened(str(version))}, this sidestep reads versions "
            f"{', '.join(map(str, READABLE_VERSIONS))}; fit the body again"
        )


def _check_links(path: Path, contents: BodyContents, robot: Robot) -> None:
    known = [link.name for link in robot.links]
    for index, link in enumerate(contents.links):
        place = f"body file '{path}' is malformed at $.links[{index}]"
        if link.fit.link not in known:
            raise ValueError(f"{place}: unknown link '{link.fit.link}'; links are {', '.join(known)}")
        lengths = {len(link.weights), len(link.means), len(link.covariances)}
        if len(lengths) != 1:
            raise ValueError(
                f"{place}: {len(link.weights)} weights, {len(link.means)} means and "
                f"{len(link.covariances)} covariances; the numbers must be equal"
            )
        if link.levels is not None and len(link.levels) != len(link.weights):
            raise ValueError(f"{place}: {len(link.levels)} levels for {len(link.weights)} components")
    if len({link.levels is None for link in contents.links}) != 1:
        raise ValueError(f"body file '{path}' is malformed at $.links: only some links have levels")
    names = [link.fit.link for link in contents.links]
    if len(set(names)) != len(names):
        raise ValueError(f"body file '{path}' is malformed at $.links: a link appears twice")
    try:
        _core.Body(**contents.arrays())
    except ValueError as error:
        raise ValueError(f"body file '{path}' is malformed at $.links: {error}") from error


def _link_document(link: LinkContents) -> dict[str, Any]:
    fit = link.fit
    curve = fit.curve
    return {
        "link": fit.link,
        "log_likelihood": fit.log_likelihood,
        "coverage": fit.coverage,
        "mean_distance": fit.mean_distance,
        "converged": fit.converged,
        "criterion": None
        if curve is None
        else {"components": curve.components.tolist(), "aic": curve.aic.tolist(), "bic": curve.bic.tolist()},
        "weights": link.weights.tolist(),
        "means": link.means.tolist(),
        "covariances": link.covariances.tolist(),
        "levels": None if link.levels is None else link.levels.tolist(),
        "cover": None if link.cover is None else _cover_document(link.cover),
    }


def _cover_document(cover: LinkCover) -> dict[str, Any]:
    document = asdict(cover)
    del document["link"], document["num_components"]
    return document


def _cover_contents(document: dict[str, Any] | None, link: str, number: int) -> LinkCover | None:
    if document is None:
        return None
    trade_off = tuple(TradeOff(**point) for point in document["trade_off"])
    return LinkCover(**{**document, "trade_off": trade_off}, link=link, num_components=number)


def _settings(document: dict[str, Any]) -> FitSettings | CoverSettings:
    return FitSettings(**document) if "covariance" in document else CoverSettings(**document)


def _link_contents(document: dict[str, Any]) -> LinkContents:
    criterion = document["criterion"]
    curve = None
    if criterion is not None:
        curve = CriterionCurve(
            components=np.asarray(criterion["components"], dtype=np.int64),
            aic=np.asarray(criterion["aic"], dtype=np.float64),
            bic=np.asarray(criterion["bic"], dtype=np.float64),
        )
    fit = LinkFit(
        link=document["link"],
        num_components=len(document["weights"]),
        log_likelihood=document["log_likelihood"],
        coverage=document["coverage"],
        mean_distance=document["mean_distance"],
        converged=document["converged"],
        curve=curve,
    )
    return LinkContents(
        fit=fit,
        weights=np.asarray(document["weights"], dtype=np.float64),
        means=np.asarray(document["means"], dtype=np.float64),
        covariances=np.asarray(document["covariances"], dtype=np.float64),
        levels=None if document.get("levels") is None else np.asarray(document["levels"], dtype=np.float64),
        cover=_cover_contents(document.get("cover"), document["link"], len(document["weights"])),
    )
