"""Makes the picture of the README: python docs/images/make.py"""

import subprocess
import tempfile
from pathlib import Path

from PIL import Image

COLOURS = 128  # keeps the file under 300 KB

with tempfile.TemporaryDirectory() as folder:
    subprocess.run(["sidestep", "demo", "--out", folder], check=True)
    picture = Image.open(Path(folder) / "arm.png").convert("RGB").quantize(COLOURS)
    picture.save(Path(__file__).with_name("demo.png"), optimize=True)
