"""Makes the pictures of the README: python docs/images/make.py [demo | studio | animation ...]

Those of the studio need Chromium and `pip install 'sidestep[headless]'`; without a graphics card the animation takes
minutes.
"""

import subprocess
import sys
import tempfile
from pathlib import Path

from PIL import Image

HERE = Path(__file__).parent
STUDIO = ("sidestep", "studio", "thesis-6.2.3", "--method", "controller", "--headless")


def demo(folder: Path) -> None:
    """The arm of `sidestep demo` at six times."""
    subprocess.run(["sidestep", "demo", "--no-studio", "--out", folder], check=True)
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


MAKERS = {"demo": demo, "studio": studio, "animation": animation}

if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as temporary:
        for name in sys.argv[1:] or MAKERS:
            MAKERS[name](Path(temporary))
