"""Links between programs: serve an arm to others, and move an arm that another program serves."""

import lazy_loader

# The names stand in __init__.pyi and are imported on first use: a bridge to other machines needs Zenoh.
__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
