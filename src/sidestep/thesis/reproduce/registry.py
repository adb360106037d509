"""The parts of the report, and how one is chosen by the number of its figure, table or section."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from importlib import import_module

from sidestep.thesis.reproduce.item import Item, Notify


@dataclass(frozen=True)
class Settings:
    """How thorough a run is.

    Attributes:
        quick: fewer samples and repetitions, and simulations under one switch only: for tests and a first look.
        seed: of everything that is drawn.
        notify: told in a few words what is being done.
    """

    quick: bool = False
    seed: int = 0
    notify: Notify = lambda _: None


@dataclass(frozen=True)
class Part:
    """One experiment: a function in a module of this package.

    Attributes:
        key: for `--only`.
        title: heading in the report.
        chapter: heading above it.
        module, function: `function(settings)` yields the items; imported when it runs.
        items: keys of the items that it yields, also allowed for `--only`.
    """

    key: str
    title: str
    chapter: str
    module: str
    function: str
    items: tuple[str, ...]

    def run(self, settings: Settings) -> Iterator[Item]:
        """Runs the experiment; yields its figures and tables."""
        make: Callable[[Settings], Iterator[Item]] = getattr(
            import_module(f"sidestep.thesis.reproduce.{self.module}"), self.function
        )
        yield from make(settings)


_TWO_THREE = "Chapters 2 and 3: curved spaces, the body, the embedding"
_FIVE = "Chapter 5: the geometric dynamical system"
_SIX = "Chapter 6: the seven-joint arm"
_APPENDIX = "Appendix"

PARTS: tuple[Part, ...] = (
    Part("2.1", "Plane and sphere", _TWO_THREE, "surfaces", "plane_and_sphere", ("2.1",)),
    Part("3.1", "Point clouds of links", _TWO_THREE, "body_model", "point_clouds", ("3.1",)),
    Part("3.2", "AIC and BIC", _TWO_THREE, "body_model", "criteria", ("3.2",)),
    Part("3.3", "The mixture on the arm", _TWO_THREE, "body_model", "mixture", ("3.3",)),
    Part("3.4", "Arm and obstacle", _TWO_THREE, "body_model", "task_space", ("3.4",)),
    Part("3.5", "How a Gaussian moves", _TWO_THREE, "body_model", "gaussian_motion", ("3.5",)),
    Part("3.7", "The embedding", _TWO_THREE, "surfaces", "joint_space", ("3.7",)),
    Part("5.1", "Flat space", _FIVE, "flat_space", "flat_space", ("5.1",)),
    Part("5.3", "Pure geodesic", _FIVE, "avoidance", "geodesic", ("5.3", "5.3-height")),
    Part("5.4", "Without and with a switch", _FIVE, "avoidance", "switching", ("5.4",)),
    Part("5.5", "Effect of the threshold", _FIVE, "avoidance", "kappa", ("5.5",)),
    Part("5.6", "Joint limits", _FIVE, "limits", "joint_limits", ("5.6",)),
    Part("5.4-kernels", "Kernels along the limits", _FIVE, "limits", "kernels", ("5.4-kernels",)),
    Part("5.7", "An obstacle drops in", _FIVE, "moving", "dropping", ("5.7",)),
    Part("5.8", "Several obstacles", _FIVE, "moving", "several", ("5.8",)),
    Part("5.9", "Merging curvatures", _FIVE, "moving", "merging", ("5.9",)),
    Part(
        "6.1",
        "Three switches on seven joints",
        _SIX,
        "seven_joints",
        "switches",
        ("6.1", "6.2", "6.3", "6.4", "6.5", "6.6", "6.7", "6.8", "B.1", "B.2", "6.1-switches"),
    ),
    Part("6.9", "Two programs", _SIX, "two_programs", "two_programs", ("6.9",)),
    Part(
        "6.2",
        "Torque control in MuJoCo",
        _SIX,
        "simulated",
        "simulated",
        ("6.10", "6.11", "6.12", "6.13", "6.14", "6.2-criteria"),
    ),
    Part("table-6.1", "Computation frequency", _SIX, "performance", "computation_frequency", ("table-6.1",)),
    Part("errata", "Errata", _APPENDIX, "errata", "errata", ("errata",)),
    Part("A.1", "Pairs of joints", _APPENDIX, "projections", "projections", ("A.1",)),
)


def select(only: Sequence[str]) -> tuple[Part, ...]:
    """The parts that hold any of the keys: of a part, of an item ("6.4", "B.1"), or of a chapter ("5").

    Args:
        only: keys; empty for all parts.

    Raises:
        ValueError: a key that no part has, with those allowed.
    """
    if not only:
        return PARTS
    chosen: list[Part] = []
    for key in only:
        found = [part for part in PARTS if key == part.key or key in part.items]
        if not found:
            found = [part for part in PARTS if any(item.split(".")[0] == key for item in part.items)]
        if not found:
            allowed = ", ".join(dict.fromkeys(k for part in PARTS for k in (part.key, *part.items)))
            raise ValueError(f"there is no part {key!r}; allowed: {allowed}, or a chapter")
        chosen += found
    return tuple(part for part in PARTS if part in chosen)
