"""Joints on the command line, JOINT=VALUE: their limits, and where they are held."""

from __future__ import annotations

from typing import Annotated, TypeAlias

import typer

LockedOption: TypeAlias = Annotated[
    list[str] | None,
    typer.Option(help="JOINT=VALUE [rad or m], or JOINT=POSTURE: held there; of a file; repeatable."),
]
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
    """Values of an option that is written JOINT=VALUE.

    Raises:
        ValueError: names the option, what was written and what is allowed.
    """
    values = {}
    for text in texts or ():
        joint, _, value = text.rpartition("=")
        try:
            values[joint] = float(value)
        except ValueError:
            joint = ""
        if not joint:
            raise ValueError(f"{option} is {text!r}; allowed: JOINT=VALUE, for example {option} joint1=87")
    return values


def locked_by_joint(texts: list[str] | None) -> dict[str, float | str]:
    """Values of --locked: numbers, or names of postures.

    Raises:
        ValueError: as `by_joint`.
    """
    values: dict[str, float | str] = {}
    for text in texts or ():
        joint, _, value = text.rpartition("=")
        if not (joint and value):
            raise ValueError(f"--locked is {text!r}; allowed: JOINT=VALUE or JOINT=POSTURE")
        try:
            values[joint] = float(value)
        except ValueError:
            values[joint] = value
    return values
