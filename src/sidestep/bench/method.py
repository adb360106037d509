"""The methods that the benchmark compares."""

from enum import StrEnum


class Method(StrEnum):
    """How an arm is moved; each with one set of numbers for every robot and problem."""

    controller = "controller"  #: the `Controller` with its default settings
    barrier = "barrier"  #: the `Controller` without planner, as in a scenario file
    thesis = "thesis"  #: one summed density, distance switch (T6.2)
    unswitched = "unswitched"  #: the same without the switch (T2.12)

    @property
    def safe(self) -> bool:
        """Whether clearances and limits bound every command: the controller's, not the thesis's."""
        return self in (Method.controller, Method.barrier)
