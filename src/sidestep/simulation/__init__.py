"""Physics, and what a run achieved."""

import lazy_loader

# The names stand in __init__.pyi and are imported on first use: preparing an arm needs distances, not MuJoCo.
__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
