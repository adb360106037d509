"""The process of a supervisor: `python -m sidestep.loop.supervise PATH`."""

import sys

from sidestep._core import supervise

if __name__ == "__main__":
    supervise(sys.argv[1])
