"""Limits of joints on the command line: JOINT=VALUE."""

from __future__ import annotations

from typing import Annotated, TypeAlias

import typer

EffortLimitOption: TypeAlias = Annotated[
    list[str] | None,
    typer.Option(help="JOINT=VALUE [Nm or N], in place of the file's; of a file; may be repeated."),
]
VelocityLimitOption: TypeAlias = Annotated[
    list[str] | None,
    typer.Option(help="JOINT=VALUE [rad/s or m/s], in place of the file's; of a file; may be repeated."),
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
