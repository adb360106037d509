"""Optional parts: which extra a package comes with, and an error that says so where it is not installed.

`import sidestep` and a `Controller` need only what is always installed. Everything else imports its packages where it
needs them, by plain import statements. Where one is missing, `install_hook` turns Python's error into one line that
names the extra to install.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from importlib.machinery import ModuleSpec
from types import ModuleType

# The extras of pyproject.toml that add what Sidestep imports.
MODULES: dict[str, tuple[str, ...]] = {
    "prepare": ("coal", "collada", "jsonschema", "jsonschema_rs", "pypcd4", "trimesh", "xacro"),
    "simulation": ("matplotlib", "mujoco", "PIL", "yaml"),
    "camera": ("PIL", "rosbags"),
    "realsense": ("pyrealsense2",),
    "ur": ("dashboard_client", "rtde_control", "rtde_receive"),
    "franka": ("pylibfranka",),
    "studio": ("viser", "websockets"),
    "headless": ("av", "playwright"),
    "thesis": ("sklearn", "threadpoolctl"),
    "zenoh": ("zenoh",),
    "bench": ("casadi", "pinocchio", "toppra"),
}
_CHAIN = ("prepare", "simulation", "studio", "headless")  # each holds those before it
# The extra that holds all that a room needs; one that is not here needs what it imports.
ROOMS = {
    "bench": "simulation",
    "drawing": "simulation",
    "perception": "camera",
    "report": "simulation",
    "reproduce": "simulation",
    "scenario": "simulation",
    "studio": "studio",
}
# Where two extras hold a module, the first counts, but for rooms that need the other.
_EXTRA_OF = {module: extra for extra, modules in reversed(MODULES.items()) for module in modules}
_IMPORT_SYSTEM = ("_frozen_importlib", "importlib._bootstrap", "importlib")  # `importlib.util` only looks


class MissingExtraError(ModuleNotFoundError):
    """A package is missing that comes with an extra; the message says how to install it."""


def install(extra: str) -> str:
    """The command that installs an extra."""
    return f"pip install 'sidestep[{extra}]'"


def install_hook() -> None:
    """Has Python ask `_Finder` for what no other finder knows; again does nothing."""
    if not any(isinstance(finder, _Finder) for finder in sys.meta_path):
        sys.meta_path.append(_Finder())


class _Finder:
    """The last of Python's finders: refuses what a file of Sidestep imports and nobody has found."""

    def find_spec(
        self, name: str, path: Sequence[str] | None = None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        """None, so that Python raises its own error, unless a file of Sidestep imports a package of an extra.

        Raises:
            MissingExtraError: names the importing module, the package and the extra.
        """
        extra = _EXTRA_OF.get(name)
        if extra is None:
            return None
        callers = _callers()
        importer = next(callers, "")
        if importer.partition(".")[0] != "sidestep":  # others may try an import and go on without
            return None
        if extra in _CHAIN:
            rooms = {
                caller.split(".")[1] for caller in (importer, *callers) if caller.startswith("sidestep.")
            }
            needed = {ROOMS[room] for room in rooms & ROOMS.keys()}
            beside = [other for other in needed.difference(_CHAIN) if name in MODULES[other]]
            chain = needed.intersection(_CHAIN)
            extra = beside[0] if beside and not chain else max({extra} | chain, key=_CHAIN.index)
        raise MissingExtraError(
            f"{importer} needs the package {name!r}, which is not installed: {install(extra)}", name=name
        )


def _callers() -> Iterator[str]:
    """The modules whose code is running, from the import statement outwards."""
    frame = sys._getframe(2)
    while frame is not None and frame.f_globals.get("__name__") in _IMPORT_SYSTEM:
        frame = frame.f_back  # type: ignore[assignment]
    while frame is not None:
        yield str(frame.f_globals.get("__name__", ""))
        frame = frame.f_back  # type: ignore[assignment]
