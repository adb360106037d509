"""What a cover is asked for, and how good the cover of a link is."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from sidestep.body.cover_problem import EFFORTS, EffortName, TradeOff
from sidestep.body.sampling import check_components, links_with_geometry

if TYPE_CHECKING:
    from sidestep.robot import Robot

ALGORITHM_VERSION = 6  # part of the cache's key: a cover of another algorithm is made again
MAX_COMPONENTS = 80
MORE_COMPONENTS = 10  # for each link beyond `FEW_LINKS`: trees with a base, a torso and a head
FEW_LINKS = 12


def components_for(num_links: int) -> int:
    """How many ellipsoids a number of links shares by default."""
    return MAX_COMPONENTS + MORE_COMPONENTS * max(0, num_links - FEW_LINKS)


@dataclass(frozen=True)
class CoverSettings:
    """What a cover was asked for: equal settings on an equal robot give an equal body.

    Attributes:
        components: ellipsoids per link: one number for all, or {link: number}; links not named share what is
            left of `max_components`, and all links do if it is None.
        max_components: ellipsoids in all, when some are shared.
        seed: seed of the starts.
        effort: how long is looked for ellipsoids that overshoot less; all are proven. "draft": seconds for an arm, 6
            ellipsoids for each link that `components` leaves open, which overshoot about twice as much; "fine"; or
            "best": four to six times as long as "fine", for about a tenth less.
    """

    components: int | Mapping[str, int] | None = None
    max_components: int = MAX_COMPONENTS
    seed: int = 0
    effort: EffortName = "fine"

    def validate(self, robot: Robot) -> None:
        """Raises ValueError that names the setting, its value and what is allowed on this robot."""
        links = links_with_geometry(robot)
        if not links:
            raise ValueError(f"robot '{robot.name}' has no link with geometry to cover")
        if self.effort not in EFFORTS:
            raise ValueError(f"effort is {self.effort!r}, allowed: {', '.join(EFFORTS)}")
        if self.seed < 0:
            raise ValueError(f"seed is {self.seed}, must be >= 0")
        if isinstance(self.components, int):
            check_components(self.components, links)
            return
        check_components({**dict.fromkeys(links, 1), **(self.components or {})}, links)
        least = sum((self.components or {}).get(link, 1) for link in links)
        if self.max_components < least and self.num_shared(links) > 0:
            raise ValueError(
                f"max_components is {self.max_components}, must be at least {least}: "
                f"robot '{robot.name}' has {len(links)} links with geometry" + self._named()
            )

    def num_shared(self, links: Sequence[str]) -> int:
        """How many of these links share ellipsoids."""
        if isinstance(self.components, int):
            return 0
        return sum(link not in (self.components or {}) for link in links)

    def _named(self) -> str:
        asked = self.components
        return f", and components asks for {dict(asked)}" if isinstance(asked, Mapping) else ""


@dataclass(frozen=True, eq=False)
class LinkCover:
    """How the ellipsoids of one link cover it.

    Attributes:
        link: name of the link.
        num_components: number of ellipsoids.
        coverage: share of the mesh's area proven to lie inside the union, triangle by triangle.
        mean_overshoot, max_overshoot: distance from the mesh [m] of the union's boundary where it is outside.
        volume_ratio: volume of the union over that of the mesh, or of its convex hull if the mesh is open.
        volume_of: "mesh" or "hull".
        interior_coverage: share of the link's inside that lies in the union; gaps there cannot be reached
            without crossing the surface.
        slimness: shortest over longest semi-axis, least over the ellipsoids.
        trade_off: what was tried on the way; unknown, and empty, of a cover from an arm file.
    """

    link: str
    num_components: int
    coverage: float
    mean_overshoot: float
    max_overshoot: float
    volume_ratio: float
    volume_of: str
    interior_coverage: float
    slimness: float
    trade_off: tuple[TradeOff, ...] = ()
