"""Bodies: a Gaussian mixture per link, fitted to the robot's meshes."""

import lazy_loader

# The names stand in __init__.pyi and are imported on first use: reports of fits draw, and Matplotlib takes its time.
__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
