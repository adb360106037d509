"""The command line."""

import lazy_loader

# The names stand in __init__.pyi: a module of this room can be imported without all commands.
__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
