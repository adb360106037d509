"""Random reach problems: how often an arm arrives, touches, or is stuck, and what a step costs."""

import lazy_loader

# The names stand in __init__.pyi and are imported on first use, so that the command line starts at once.
__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
