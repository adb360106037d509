"""How a robot is read from a file, on the command line: its packages, tip, and joints, JOINT=VALUE."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any, TypeAlias

import typer

Locked: TypeAlias = float | str | tuple[float, float]
"""Where a joint is held: its value, the name of a posture, or the range in which something else drives it."""
LockedOption: TypeAlias = Annotated[
    list[str] | None,
    typer.Option(
        help="JOINT=VALUE [rad or m] or JOINT=POSTURE: held there; JOINT=LOW..HIGH: driven by something else in that "
        "range; of a file; may be repeated."
    ),
]
PackageDirOption: TypeAlias = Annotated[
    list[Path] | None, typer.Option(help="Folder searched for package:// addresses; may be repeated.")
]
TipOption: TypeAlias = Annotated[str | None, typer.Option(help="Last link that is kept; of a file.")]
EffortLimitOption: TypeAlias = Annotated[
    list[str] | None,
    typer.Option(help="JOINT=VALUE [Nm or N], in place of the file's; of a file; may be repeated."),
]
VelocityLimitOption: TypeAlias = Annotated[
    list[str] | None,
    typer.Option(help="JOINT=VALUE [rad/s or m/s], in place of the file's; of a file; may be repeated."),
]
AccelerationLimitOption: TypeAlias = Annotated[
    list[str] | None,
    typer.Option(help="JOINT=VALUE [rad/s² or m/s²], in place of 10; of a file; may be repeated."),
]
JerkLimitOption: TypeAlias = Annotated[
    list[str] | None,
    typer.Option(
        help="JOINT=VALUE [rad/s³ or m/s³], in place of 100/s times the acceleration; of a file; may be repeated."
    ),
]


def by_joint(texts: list[str] | None, option: str) -> dict[str, float]:
    """Values of an option that is written JOINT=VALUE; raises as `by_name`."""
    return by_name(texts, option, "JOINT=VALUE", "joint1=87")


def by_name(texts: list[str] | None, option: str, form: str, example: str) -> dict[str, float]:
    """Values of an option by names.

    Args:
        texts: what was given. option: its name. form, example: of what is allowed.

    Raises:
        ValueError: names the option, what was written and what is allowed.
    """
    values = {}
    for text in texts or ():
        name, _, value = text.rpartition("=")
        try:
            values[name] = float(value)
        except ValueError:
            name = ""
        if not name:
            raise ValueError(f"{option} is {text!r}; allowed: {form}, for example {option} {example}")
    return values


def locked_by_joint(texts: list[str] | None) -> dict[str, Locked]:
    """Values of --locked: numbers, ranges, or names of postures.

    Raises:
        ValueError: names what was written and what is allowed.
    """
    values: dict[str, Locked] = {}
    for text in texts or ():
        joint, _, value = text.rpartition("=")
        lower, dots, upper = value.partition("..")
        try:
            if not (joint and value):
                raise ValueError
            if dots:
                values[joint] = float(lower), float(upper)
                continue
        except ValueError:
            raise ValueError(
                f"--locked is {text!r}; allowed: JOINT=VALUE, JOINT=POSTURE or JOINT=LOW..HIGH, for example "
                "--locked finger=0..0.04"
            ) from None
        try:
            values[joint] = float(value)
        except ValueError:
            values[joint] = value
    return values


def reading_options(
    package_dir: list[Path] | None,
    tip: str | None,
    locked: list[str] | None,
    effort_limit: list[str] | None,
    velocity_limit: list[str] | None,
    acceleration_limit: list[str] | None,
    jerk_limit: list[str] | None,
) -> dict[str, Any]:
    """What was given of these, as arguments of `Robot.from_urdf` and `Arm.load`.

    Raises:
        ValueError: names the option, what was written and what is allowed.
    """
    options = {
        "package_dirs": package_dir,
        "tip": tip,
        "locked": locked_by_joint(locked),
        "effort_limits": by_joint(effort_limit, "--effort-limit"),
        "velocity_limits": by_joint(velocity_limit, "--velocity-limit"),
        "acceleration_limits": by_joint(acceleration_limit, "--acceleration-limit"),
        "jerk_limits": by_joint(jerk_limit, "--jerk-limit"),
    }
    return {name: value for name, value in options.items() if value}
