"""What is counted in Python: imports, functions, attributes, lines of code."""

import ast
from pathlib import Path


def modules(source: Path, package: str = "sidestep") -> dict[str, Path]:
    """The file of each module of a package below `source`."""
    result = {}
    for path in sorted((source / package).rglob("*.py")):
        parts = path.relative_to(source).with_suffix("").parts
        result[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = path
    return result


class Imports:
    """Which module imports which: wherever the statement stands, in a function or for a type checker alone.

    A name that a package only hands on counts as imported from the file that defines it. `sidestep.a.b` behind
    `import sidestep` counts as well, and so does the text in `import_module("sidestep.a")`.
    """

    def __init__(self, source: Path, package: str = "sidestep") -> None:
        self.package = package
        self.files = modules(source, package)
        self._exports = {
            name: self._handed_on(name) for name, path in self.files.items() if path.stem == "__init__"
        }

    def edges(self) -> dict[str, set[str]]:
        return {name: self.of(name) for name in self.files}

    def of(self, module: str) -> set[str]:
        tree = ast.parse(self.files[module].read_text(encoding="utf-8"))
        result: set[str] = set()
        aliases: dict[str, str] = {}  # of imported packages, whose attributes are looked at below
        for node in ast.walk(tree):
            if isinstance(node, ast.ImportFrom):
                base = self._base(module, node)
                result |= {self.defining(base, name.name) for name in node.names}
                aliases |= {
                    n.asname or n.name: f"{base}.{n.name}"
                    for n in node.names
                    if f"{base}.{n.name}" in self.files
                }
            elif isinstance(node, ast.Import):
                for name in node.names:
                    result.add(name.name)
                    aliases[name.asname or name.name.split(".")[0]] = (
                        name.name if name.asname else name.name.split(".")[0]
                    )
            elif (
                isinstance(node, ast.Call)
                and getattr(node.func, "attr", getattr(node.func, "id", "")) == "import_module"
            ):
                result |= {
                    a.value for a in node.args if isinstance(a, ast.Constant) and isinstance(a.value, str)
                }
        for node in ast.walk(tree):
            if (
                isinstance(node, ast.Attribute)
                and isinstance(node.value, ast.Name)
                and node.value.id in aliases
            ):
                base = aliases[node.value.id]
                if base in self._exports:
                    result.add(self.defining(base, node.attr))
        return {name for name in result if name in self.files and name != module} - set(
            self._packages_of(module)
        )

    def defining(self, base: str, name: str) -> str:
        """The module where `from base import name` ends."""
        seen = set()
        while base in self._exports and (base, name) not in seen:
            seen.add((base, name))
            if f"{base}.{name}" in self.files and name not in self._exports[base]:
                return f"{base}.{name}"
            if name not in self._exports[base]:
                break
            base, name = self._exports[base][name]
        return base

    def _handed_on(self, package: str) -> dict[str, tuple[str, str]]:
        """Of each name that a package hands on, where it comes from."""
        path = self.files[package]
        stub = path.with_suffix(".pyi")
        tree = ast.parse((stub if stub.exists() else path).read_text(encoding="utf-8"))
        return {
            name.asname or name.name: (self._base(package, node), name.name)
            for node in ast.walk(tree)
            if isinstance(node, ast.ImportFrom)
            for name in node.names
        }

    def _base(self, module: str, node: ast.ImportFrom) -> str:
        if node.level == 0:
            return node.module or ""
        parts = module.split(".")
        kept = len(parts) - node.level + (self.files[module].stem == "__init__")
        return ".".join([*parts[:kept], *([node.module] if node.module else [])])

    def _packages_of(self, module: str) -> list[str]:
        parts = module.split(".")
        return [".".join(parts[:count]) for count in range(1, len(parts))]


def room(module: str) -> str:
    """The package of a module below the top: sidestep.robot.link is in robot."""
    return [*module.split("."), ""][1]


def long_functions(path: Path, most: int) -> list[tuple[str, int]]:
    """Functions of more than `most` lines, from `def` to the last, without the docstring."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    found = [
        (node.name, (node.end_lineno or 0) - node.lineno + 1 - len(_docstring_lines(node)))
        for node in ast.walk(tree)
        if isinstance(node, _FUNCTION)
    ]
    return [(name, lines) for name, lines in found if lines > most]


def attributes(path: Path) -> dict[str, int]:
    """How many attributes each class has: fields of a dataclass, and what methods set on self."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    result = {}
    for node in ast.walk(tree):
        if isinstance(node, ast.ClassDef):
            fields = {
                s.target.id
                for s in node.body
                if isinstance(s, ast.AnnAssign)
                and isinstance(s.target, ast.Name)
                and "ClassVar" not in ast.unparse(s.annotation)
            }
            set_on_self = {
                target.attr
                for target in ast.walk(node)
                if isinstance(target, ast.Attribute) and isinstance(target.ctx, ast.Store)
                if isinstance(target.value, ast.Name) and target.value.id == "self"
            }
            result[node.name] = len(fields | set_on_self)
    return result


def code_lines(path: Path) -> int:
    """Lines that are neither blank nor comment nor docstring."""
    text = path.read_text(encoding="utf-8")
    lines = {
        number
        for number, line in enumerate(text.splitlines(), 1)
        if line.strip() and not line.strip().startswith("#")
    }
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, (ast.Module, ast.ClassDef, *_FUNCTION)):
            lines -= _docstring_lines(node)
    return len(lines)


def _docstring_lines(node: ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef) -> set[int]:
    if ast.get_docstring(node, clean=False) is None:
        return set()
    docstring = node.body[0]
    return set(range(docstring.lineno, (docstring.end_lineno or 0) + 1))


_FUNCTION = (ast.FunctionDef, ast.AsyncFunctionDef)
