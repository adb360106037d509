"""Makes the pictures of README and site: python docs/images/make.py [NAME ...], by default all of them.

demo, studio, animation; in figures.py those of concepts and theory; in table.py that of the first screen. Those of
the studio need Chromium and `pip install 'sidestep[headless]'`; without a graphics card the animation takes minutes.
"""

import os
import subprocess
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path

from PIL import Image

HERE = Path(__file__).parent
SIDESTEP = (sys.executable, "-m", "sidestep")
STUDIO = (*SIDESTEP, "studio", "thesis-6.2.3", "--method", "controller", "--headless")


def demo(folder: Path) -> None:
    """The arm of `sidestep demo` at six times."""
    subprocess.run([*SIDESTEP, "demo", "--no-studio", "--out", folder], check=True)
    keep(folder / "arm.png", HERE / "demo.png")


def studio(folder: Path) -> None:
    """The studio's page, when the arm has passed over the balls."""
    screen = folder / "studio.png"
    subprocess.run([*STUDIO, "--screenshot", screen, "--duration", "4"], check=True)
    keep(screen, HERE / "studio.png")


def animation(folder: Path) -> None:
    """The same motion until the arm has passed."""
    subprocess.run([*STUDIO, "--video", HERE / "studio.webp", "--duration", "5"], check=True)


def keep(source: Path, target: Path) -> None:
    """Copies a picture with 256 colours, spread so that small things keep theirs: under 300 KB."""
    Image.open(source).convert("RGB").quantize(method=Image.Quantize.MAXCOVERAGE).save(target, optimize=True)


MAKERS: dict[str, Callable[[Path], None]] = {"demo": demo, "studio": studio, "animation": animation}
FIGURES = (
    *("loop", "barriers", "planner", "look-ahead", "body", "guarantees"),  # of the concepts
    *("geometry", "control", "clearances", "timed-path"),  # of the theory
)

if __name__ == "__main__":
    os.environ.setdefault("MUJOCO_GL", "egl")  # MuJoCo draws without a display; or osmesa
    import figures
    import table

    MAKERS |= {name: lambda _, name=name: getattr(figures, name.replace("-", "_"))() for name in FIGURES}
    MAKERS["table"] = lambda _: table.table()
    wrong = [name for name in sys.argv[1:] if name not in MAKERS]
    if wrong:
        sys.exit(f"there is no picture {wrong[0]!r}; allowed: {', '.join(MAKERS)}")
    with tempfile.TemporaryDirectory() as temporary:
        for name in sys.argv[1:] or MAKERS:
            MAKERS[name](Path(temporary))
