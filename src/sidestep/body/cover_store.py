"""Covers of single links in the user's cache, found by the link's surface: robots with the same link share them."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from dataclasses import asdict, dataclass, field, replace
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from sidestep.body.cover_problem import EFFORTS, LinkProblem, TradeOff, Trial
from sidestep.body.cover_refine import Ellipsoids
from sidestep.body.cover_settings import ALGORITHM_VERSION, CoverSettings, LinkCover
from sidestep.robot.fingerprint import surface_hash
from sidestep.storage.user_cache import ContentStore

if TYPE_CHECKING:
    import trimesh

FOLDER = "links"  # of the user's cache

Made: TypeAlias = tuple[LinkCover, Ellipsoids]


@dataclass(frozen=True)
class KnownCovers:
    """What is known of one surface.

    Attributes:
        trials: of numbers of ellipsoids that were compared. finished: covers, by their number of ellipsoids.
    """

    trials: dict[int, Trial] = field(default_factory=dict)
    finished: dict[int, tuple[Made, TradeOff]] = field(default_factory=dict)

    def document(self) -> dict[str, Any]:
        return {
            "trials": [
                [number, _numbers(trial.found), trial.excess] for number, trial in self.trials.items()
            ],
            "finished": [
                {
                    "cover": {name: value for name, value in asdict(cover).items() if name not in _OF_ROBOT},
                    "searched": _numbers(searched),
                    "centres": ellipsoids.centres.tolist(),
                    "shapes": ellipsoids.shapes.tolist(),
                }
                for (cover, ellipsoids), searched in self.finished.values()
            ],
        }

    @classmethod
    def from_document(cls, document: dict[str, Any]) -> KnownCovers:
        """Raises LookupError, TypeError or ValueError where it is none."""
        trials = {
            int(number): Trial(TradeOff(int(number), *map(float, found)), float(excess))
            for number, found, excess in document["trials"]
        }
        finished: dict[int, tuple[Made, TradeOff]] = {}
        for entry in document["finished"]:
            cover = LinkCover(link="", **entry["cover"])
            count = cover.num_components
            centres, shapes = (np.array(entry[name], dtype=np.float64) for name in ("centres", "shapes"))
            if centres.shape != (count, 3) or shapes.shape != (count, 3, 3):
                raise ValueError(f"centres {centres.shape} and shapes {shapes.shape} of {count} ellipsoids")
            searched = TradeOff(count, *map(float, entry["searched"]))
            finished[count] = (cover, Ellipsoids(centres, shapes)), searched
        return cls(trials, finished)


_OF_ROBOT = ("link", "trade_off")  # what depends on the robot that a link is part of


class CoverStore:
    """The covers of the links of one robot.

    Args:
        settings: of the cover. enabled: False: finds and keeps nothing.
    """

    def __init__(self, settings: CoverSettings, *, enabled: bool) -> None:
        self._store = ContentStore(FOLDER, "the cover of a link", enabled=enabled)
        self._settings = (ALGORITHM_VERSION, EFFORTS[settings.effort], settings.seed)
        self._keys: dict[str, str] = {}
        self._known: dict[str, KnownCovers] = {}

    def read(self, link: str, mesh: trimesh.Trimesh, allowance: float) -> KnownCovers:
        """What is known of a link's surface."""
        content = repr((surface_hash(mesh), allowance, *self._settings))
        self._keys[link] = hashlib.sha256(content.encode()).hexdigest()
        self._known[link] = self._stored(link)
        return self._known[link]

    def stored_or_made(self, link: str, problem: LinkProblem, number: int, make: Callable[[], Made]) -> Made:
        """The cover of a link that was read, with a number of ellipsoids; one that is made is kept."""
        known = self._known[link]
        if number in known.finished:
            (cover, ellipsoids), searched = known.finished[number]
            problem.was_finished(searched)
            return replace(cover, link=link, trade_off=problem.trade_off()), ellipsoids
        made = make()
        searched = next(point for point in made[0].trade_off if point.num_components == number)
        now = self._stored(link)  # which another program may have added to
        trials, finished = {**now.trials, **problem.trials}, {**now.finished, number: (made, searched)}
        self._store.put(self._keys[link], KnownCovers(trials, finished).document())
        return made

    def _stored(self, link: str) -> KnownCovers:
        return self._store.get(self._keys[link], KnownCovers.from_document) or KnownCovers()


def _numbers(found: TradeOff) -> list[float]:
    return [found.mean_overshoot, found.max_overshoot]
