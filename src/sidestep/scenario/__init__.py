"""Scenarios: one run of one arm as a YAML file with a published schema, and the runner."""

import lazy_loader

# The public names stand once, in __init__.pyi; `run_scenario` imports the physics, reading a file does not.
__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
