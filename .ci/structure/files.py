"""The files of a checkout."""

import re
from pathlib import Path

import cpp_code


class Checkout:
    """The files of a checkout, by part; tests and documentation are none of them."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder.resolve()
        self.core = self._files("cpp/src", "cpp/include", kinds=(".cpp", ".hpp", ".inl"))
        self.bindings = self._files("bindings", kinds=(".cpp", ".hpp"))
        self.python = self._files("src/sidestep", kinds=(".py",))
        self.read = {path: cpp_code.read(path) for path in self.core + self.bindings}

    def name(self, path: Path) -> str:
        return path.relative_to(self.folder).as_posix()

    def cpp_room(self, path: Path) -> str:
        """The folder below cpp/src or cpp/include/sidestep."""
        parts = path.relative_to(self.folder / "cpp").parts
        below = parts[1:] if parts[0] == "src" else parts[2:]
        return below[0] if len(below) > 1 else ""

    def _files(self, *folders: str, kinds: tuple[str, ...]) -> list[Path]:
        return sorted(
            path for folder in folders for path in (self.folder / folder).rglob("*") if path.suffix in kinds
        )

    def that_know(self, pattern: str) -> list[str]:
        """The files in which it is found."""
        files = [*self.core, *self.bindings, *self.python]
        return [self.name(path) for path in files if re.search(pattern, path.read_text(encoding="utf-8"))]
