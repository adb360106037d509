"""Makes the pictures of README and site: python docs/images/make.py [NAME ...], by default all of them.

demo, studio, report; in figures.py and source_figures.py those of the concepts, in camera_figures.py those of a depth
camera, in theory_figures.py those of the theory; in table.py that of the first screen. That of the studio needs
Chromium and `pip install 'sidestep[headless]'`.
"""

import argparse
import importlib
import os
import subprocess
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path

from PIL import Image

HERE = Path(__file__).parent
SIDESTEP = (sys.executable, "-m", "sidestep")


def demo(folder: Path) -> None:
    """The arm of `sidestep demo` at six times."""
    subprocess.run([*SIDESTEP, "demo", "--no-studio", "--out", folder], check=True)
    keep(folder / "arm.png", HERE / "demo.png")


def studio(folder: Path) -> None:
    """The studio's page as it opens, when the arm is on its way."""
    screen = folder / "studio.png"
    subprocess.run(
        [*SIDESTEP, "studio", "--headless", "--screenshot", screen, "--duration", "0.8"], check=True
    )
    keep(screen, HERE / "studio.png")


def report(folder: Path) -> None:
    """The report of a recorded run: clearance, limits, what happened."""
    environment = {**os.environ, "SIDESTEP_RECORD": str(folder / "recordings")}
    words = ["run", "thesis-6.2.3", "--method", "controller", "--out", folder / "run"]
    subprocess.run([*SIDESTEP, *words], check=True, env=environment)
    [recording] = (folder / "recordings").glob("*.mcap")
    subprocess.run([*SIDESTEP, "report", recording, "-o", folder / "report.png"], check=True)
    keep(folder / "report.png", HERE / "report.png")


def keep(source: Path, target: Path) -> None:
    """Copies a picture with 256 colours, spread so that small things keep theirs: under 300 KB."""
    Image.open(source).convert("RGB").quantize(method=Image.Quantize.MAXCOVERAGE).save(target, optimize=True)


MAKERS: dict[str, Callable[[Path], None]] = {"demo": demo, "studio": studio, "report": report}
FIGURES = {
    "figures": ("loop", "barriers", "planner", "look-ahead", "body", "guarantees"),
    "source_figures": ("believes",),
    "camera_figures": ("camera-pixels", "camera-map", "camera-unseen"),
    "theory_figures": ("density", "geometry", "systems", "control", "clearances", "timed-path"),
}


def drawn_in(module: str, name: str) -> None:
    """Draws the figure of this name in a module beside this file."""
    getattr(importlib.import_module(module), name.replace("-", "_"))()


if __name__ == "__main__":
    os.environ.setdefault("MUJOCO_GL", "egl")  # MuJoCo draws without a display; or osmesa
    import table

    for module, names in FIGURES.items():
        MAKERS |= {name: lambda _, module=module, name=name: drawn_in(module, name) for name in names}
    MAKERS["table"] = lambda _: table.table()
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("names", nargs="*", metavar="NAME", help=f"of {', '.join(MAKERS)} [all]")
    chosen = parser.parse_args().names
    wrong = [name for name in chosen if name not in MAKERS]
    if wrong:
        parser.error(f"there is no picture {wrong[0]!r}; allowed: {', '.join(MAKERS)}")
    with tempfile.TemporaryDirectory() as temporary:
        for name in chosen or MAKERS:
            MAKERS[name](Path(temporary))
