"""Makes the pictures of the README: python docs/images/make.py

The studio's picture needs Chromium and `pip install 'sidestep[headless]'`.
"""

import subprocess
import tempfile
from pathlib import Path

from PIL import Image

COLOURS = 128  # keeps the file under 300 KB
HERE = Path(__file__).parent
STUDIO = ("sidestep", "studio", "thesis-6.2.3", "--method", "thesis", "--headless")

with tempfile.TemporaryDirectory() as folder:
    subprocess.run(["sidestep", "demo", "--no-studio", "--out", folder], check=True)
    picture = Image.open(Path(folder) / "arm.png").convert("RGB").quantize(COLOURS)
    picture.save(HERE / "demo.png", optimize=True)
    screen = Path(folder) / "studio.png"
    subprocess.run([*STUDIO, "--screenshot", screen, "--duration", "4"], check=True)
    Image.open(screen).convert("RGB").quantize(COLOURS).save(HERE / "studio.png", optimize=True)
