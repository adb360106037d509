"""Robots: URDF in, kinematic tree with links, limits, inertias and meshes out."""

import lazy_loader

# The public names stand once, in __init__.pyi; shapes need poses, links need shapes.
__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
