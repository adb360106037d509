"""Robots that other packages know by name: `robot_descriptions` and `mujoco_menagerie`, where they are installed."""

from __future__ import annotations

import importlib
import importlib.util
from dataclasses import dataclass
from pathlib import Path

from sidestep.robot.catalogue import RECIPES


@dataclass(frozen=True)
class DescribedRobot:
    """A description file of another package, and the folders of its `package://` references."""

    path: Path
    package_dirs: tuple[Path, ...] = ()


def described(name: str) -> DescribedRobot | None:
    """The description of a name that one of the packages knows, which may download it; None of any other name.

    `robot_descriptions` has a module of each name, with URDF_PATH, XACRO_PATH or MJCF_PATH. `mujoco_menagerie` has
    folders by name, of which the model is taken, not the scene. Names of `sidestep.robots()` are neither's.

    Raises:
        FileNotFoundError: the package knows the name and cannot give its files.
    """
    if any(recipe.name == name for recipe in RECIPES):
        return None
    return _robot_description(name) or _menagerie(name)


def _robot_description(name: str) -> DescribedRobot | None:
    module_name = f"robot_descriptions.{name}"
    if not name.endswith("_description") or not name.isidentifier() or not _installed(module_name):
        return None
    try:
        module = importlib.import_module(module_name)
    except Exception as error:  # it downloads: git and the network raise anything
        raise FileNotFoundError(
            f"robot_descriptions cannot give {name!r}: {type(error).__name__}: {error}"
        ) from error
    for key in ("URDF_PATH", "XACRO_PATH", "MJCF_PATH"):
        path = getattr(module, key, None)
        if path is None:
            continue
        # Packages are named by the folder of the robot, by that of all robots, or by what holds either.
        folders = [getattr(module, folder, None) for folder in ("PACKAGE_PATH", "REPOSITORY_PATH")]
        above = [place for folder in folders if folder for place in (Path(folder), Path(folder).parent)]
        dirs = () if key == "MJCF_PATH" else tuple(dict.fromkeys(place for place in above if place.is_dir()))
        return DescribedRobot(Path(path), dirs)
    raise FileNotFoundError(f"robot_descriptions has no URDF and no MJCF of {name!r}")


def _menagerie(name: str) -> DescribedRobot | None:
    if not _installed("mujoco_menagerie"):
        return None
    menagerie = importlib.import_module("mujoco_menagerie")
    if name not in menagerie.names():
        return None
    try:
        robot = menagerie.get(name)
        return DescribedRobot(Path(robot.xml(robot.default_model)))
    except Exception as error:  # it downloads: the network raises anything
        raise FileNotFoundError(
            f"mujoco_menagerie cannot give {name!r}: {type(error).__name__}: {error}"
        ) from error


def _installed(module: str) -> bool:
    try:
        return importlib.util.find_spec(module) is not None
    except (
        ImportError,
        ValueError,
    ):  # ValueError: a module that stands in sys.modules without a specification
        return False
