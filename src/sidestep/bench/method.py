"""The methods that the benchmark compares."""

from enum import StrEnum


class Method(StrEnum):
    """How an arm is moved; each with one set of numbers for every robot and problem, see `sidestep.presets`."""

    thesis = "thesis"  #: one summed density, distance switch (T6.2)
    unswitched = "unswitched"  #: the same without the switch (T2.12)
    barrier = "barrier"  #: a barrier per ellipsoid of a covering body, per joint limit and per pair of links
    guided = "guided"  #: the barriers, led along a path that is searched in the background

    @property
    def safe(self) -> bool:
        """Whether clearances and limits bound the acceleration as well: part of the method, not of the thesis's."""
        return self in (Method.barrier, Method.guided)

    @property
    def escapes(self) -> bool:
        """Whether it takes sub-goals where it is stuck."""
        return self is Method.barrier

    @property
    def evades(self) -> bool:
        """Whether it flies out of the way of what moves."""
        return self is Method.barrier
