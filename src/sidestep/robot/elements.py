"""Attributes of XML elements as checked values: text, numbers, poses."""

from __future__ import annotations

import math
import xml.etree.ElementTree as ElementTree

import numpy as np

from sidestep.math.pose import from_roll_pitch_yaw, pose_at
from sidestep.robot.link import Array
from sidestep.robot.remarks import Remarks

COMMAS = "there are commas between numbers, where spaces are asked for; they are left out"
SHORT_RPY = "rpy has fewer than 3 numbers; those that are left out count as 0"


def placement(element: ElementTree.Element, owner: str, remarks: Remarks) -> Array:
    """The pose (4, 4) of <origin>: roll, pitch, yaw about fixed axes, translation; identity if absent."""
    origin = element.find("origin")
    if origin is None:
        return np.eye(4)
    where = f"{owner}: <origin>"
    rpy = numbers(origin, "rpy", where, remarks, count=3, default="0 0 0", fewer=(1, 2))
    if len(rpy) < 3:
        remarks.add(SHORT_RPY, f"{short(owner)}: rpy {origin.get('rpy')!r}")
        rpy = (*rpy, 0.0, 0.0)[:3]
    return pose_at(numbers(origin, "xyz", where, remarks, count=3, default="0 0 0"), from_roll_pitch_yaw(rpy))


def short(owner: str) -> str:
    """An owner in errors, "LABEL: link 'a'", without the label."""
    return owner.partition(": ")[2] or owner


def attribute(element: ElementTree.Element, key: str, owner: str) -> str:
    """The text of an attribute that must be there."""
    value = element.get(key)
    if not value:
        raise ValueError(f"{owner}: <{element.tag}> has no attribute {key!r}")
    return value


def number(
    element: ElementTree.Element, key: str, owner: str, *, default: float | None = None, finite: bool = True
) -> float:
    """A number; the default where there is no such attribute."""
    if default is not None and element.get(key) is None:
        return default
    text = attribute(element, key, owner)
    try:
        value = float(text)
    except ValueError:
        raise ValueError(f"{owner}: {key} is {text!r}, must be a number") from None
    if math.isnan(value) or (finite and math.isinf(value)):
        raise ValueError(f"{owner}: {key} is {text!r}, must be a finite number")
    return value


def words(text: str) -> list[str]:
    """What stands between spaces, without commas at the ends: "0.1, 0 0" is read, "0,1 0 0" is not."""
    return [part.removesuffix(",") for part in text.split()]


def numbers(
    element: ElementTree.Element,
    key: str,
    owner: str,
    remarks: Remarks,
    *,
    count: int,
    default: str | None = None,
    fewer: tuple[int, ...] = (),
) -> tuple[float, ...]:
    """`count` finite numbers, or one of the numbers of them in `fewer`."""
    text = element.get(key) or default
    if text is None:
        raise ValueError(f"{owner}: <{element.tag}> has no attribute {key!r}")
    try:
        values = tuple(float(part) for part in words(text))
    except ValueError:
        values = ()
    if len(values) not in (count, *fewer) or not all(math.isfinite(value) for value in values):
        raise ValueError(f"{owner}: {key} is {text!r}, must be {count} finite numbers")
    if "," in text:
        remarks.add(COMMAS, f"{short(owner)}: {key} {text!r}")
    return values
