"""Sidestep: reactive whole-arm obstacle avoidance on the curved configuration space of a manipulator."""

import lazy_loader

from sidestep.extras import install_hook

install_hook()

# The public names stand once, in __init__.pyi. Each is imported on first use, so that the command line starts
# at once.
__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
