from .commands import app as app
from .commands import cmake_dir as cmake_dir
from .commands import main as main
