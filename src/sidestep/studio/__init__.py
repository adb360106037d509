"""The studio: the real loop, seen and touched in a browser. In a notebook, a `Studio` shows itself."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
