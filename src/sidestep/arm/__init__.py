"""Arms: everything that is prepared once for a robot, in one object and one file."""

import lazy_loader

# The names stand in __init__.pyi and are imported on first use: preparing takes modules that loading does not.
__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
