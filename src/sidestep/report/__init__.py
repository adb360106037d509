"""The report of a run: figures, log, animation and a web page; of a scenario, or of a recording of one's own."""

import lazy_loader

# The names stand in __init__.pyi and are imported on first use: reading a recording needs no plots.
__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
