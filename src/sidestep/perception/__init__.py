"""From depth images to obstacles: cameras, where their images come from, and what becomes of them."""

import lazy_loader

# The names stand in __init__.pyi and are imported on first use: a camera needs no reader of bags.
__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
