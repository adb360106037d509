"""Counts what makes code hard to live in: `python .ci/structure [FOLDER] [--json FILE]`.

Of any checkout of Sidestep. Needs no more than Python: what it reads of C++ is tested in tests/test_structure.py.
"""

import argparse
import json
import re
import sys
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import cpp_code
import cpp_tokens
import python_code
from files import Checkout
from graph import between, circles

MOST_MEMBERS = 25
MOST_FUNCTION_LINES = 60
MOST_FILE_LINES = 400
# Of each thing that is added again and again, an example by its names: before it was renamed, and since.
EXAMPLES = {
    "constraint": r"[Ss]peed_?[Rr]ows|[Ss]peed_?(near_?obstacles_?|Near_?Obstacles_?)?[Cc]onstraint",
    "shape": r"(?<!nb::)[Cc]apsule",
    "setting": r"\bdrift_gain\b",
}
# Names of enums that say how something ended or stands, and what Doxygen leaves out.
RESULT = re.compile(r"(Status|Fault|State|Activity)$")
INTERNAL = re.compile(r"^ *//[/!] @cond internal\n.*?^ *//[/!] @endcond\n", re.DOTALL | re.MULTILINE)


def count(checkout: Checkout) -> dict[str, Any]:
    return {
        "members of the largest struct": _above(_members(checkout), MOST_MEMBERS),
        "attributes of the largest class in Python": _above(_attributes(checkout), MOST_MEMBERS),
        "methods without parameters that may write": _methods(checkout, lambda method: not method.is_const),
        "methods without parameters that only read": _methods(checkout, lambda method: method.is_const),
        "functions above 60 lines": _long_functions(checkout),
        "files above 400 lines": _long_files(checkout),
        "circles of C++ files": _cpp_circles(checkout, by_room=False),
        "circles of C++ folders": _cpp_circles(checkout, by_room=True),
        "circles of Python files": _python_circles(checkout, by_room=False),
        "circles of Python packages": _python_circles(checkout, by_room=True),
        "enums of the Python package": _bound_enums(checkout),
        "enums in public headers": _public_enums(checkout),
        "enums of results in public modules": _result_enums(checkout),
        "enums of results in the C++ reference": _reference_enums(checkout),
        **{f"files that know the {kind}": checkout.that_know(pattern) for kind, pattern in EXAMPLES.items()},
        "code lines of the core": sum(map(cpp_tokens.code_lines, checkout.core)),
        "code lines of the bindings": sum(map(cpp_tokens.code_lines, checkout.bindings)),
        "code lines of the Python wheel": sum(map(python_code.code_lines, checkout.python)),
    }


def _above(sizes: dict[str, int], most: int) -> dict[str, int]:
    """The largest, and all others above `most`."""
    ordered = sorted(sizes.items(), key=lambda item: -item[1])
    return {name: size for place, (name, size) in enumerate(ordered) if size > most or place == 0}


def _members(checkout: Checkout) -> dict[str, int]:
    """Of each class, with those of its bases."""
    classes = [c for path in checkout.core for c in checkout.read[path].classes]
    own = {c.name.rsplit("::", 1)[-1]: len(c.members) for c in classes}
    return {c.name: len(c.members) + sum(own.get(base, 0) for base in c.bases) for c in classes}


def _attributes(checkout: Checkout) -> dict[str, int]:
    return {
        f"{checkout.name(path)}:{name}": size
        for path in checkout.python
        for name, size in python_code.attributes(path).items()
    }


def _methods(checkout: Checkout, wanted: Callable[[cpp_code.Method], bool]) -> list[str]:
    """Those of the core, without such as only return an expression, constructors, operators and static ones."""
    bodies = {
        "::".join(f.name.split("::")[-2:]): f.body
        for path in checkout.core
        for f in checkout.read[path].functions
    }
    found = []
    for path in checkout.core:
        for owner in checkout.read[path].classes:
            for method in owner.methods:
                name = f"{owner.name.rsplit('::', 1)[-1]}::{method.name}"
                body = method.body if method.body is not None else bodies.get(name, [])
                returns = body[:1] == ["return"] and body.count(";") == 1
                if wanted(method) and not (method.has_parameters or method.is_static or returns):
                    found.append(f"{owner.name}::{method.name}")
    return sorted(found)


def _long_functions(checkout: Checkout) -> dict[str, int]:
    cpp = {
        f"{checkout.name(path)}:{function.name}": function.lines
        for path, file in checkout.read.items()
        for function in file.functions
        if function.lines > MOST_FUNCTION_LINES
    }
    python = {
        f"{checkout.name(path)}:{name}": lines
        for path in checkout.python
        for name, lines in python_code.long_functions(path, MOST_FUNCTION_LINES)
    }
    return cpp | python


def _long_files(checkout: Checkout) -> dict[str, int]:
    files = [*checkout.core, *checkout.bindings, *checkout.python]
    sizes = {checkout.name(path): len(path.read_text(encoding="utf-8").splitlines()) for path in files}
    return {name: size for name, size in sizes.items() if size > MOST_FILE_LINES}


def _cpp_circles(checkout: Checkout, *, by_room: bool) -> list[list[str]]:
    edges = cpp_tokens.include_edges([checkout.folder / "cpp/src", checkout.folder / "cpp/include"])
    names = {
        checkout.name(path): {checkout.name(target) for target in targets} for path, targets in edges.items()
    }
    rooms = {checkout.name(path): checkout.cpp_room(path) or checkout.name(path) for path in edges}
    return circles(between(names, rooms) if by_room else names)


def _python_circles(checkout: Checkout, *, by_room: bool) -> list[list[str]]:
    edges = python_code.Imports(checkout.folder / "src").edges()
    rooms = {module: python_code.room(module) or module for module in edges}
    return circles(between(edges, rooms) if by_room else edges)


def _bound_enums(checkout: Checkout) -> list[str]:
    text = "".join(path.read_text(encoding="utf-8") for path in checkout.bindings)
    return sorted(re.findall(r'nb::enum_<[\w:]+>\(\s*\w+,\s*"(\w+)"', text))


def _public_headers(checkout: Checkout) -> list[Path]:
    return [path for path in checkout.core if checkout.name(path).startswith("cpp/include/")]


def _public_enums(checkout: Checkout) -> list[str]:
    return sorted(name for path in _public_headers(checkout) for name in checkout.read[path].enums)


def _reference_enums(checkout: Checkout) -> list[str]:
    """Enums of results in public headers, without what Doxygen is told to leave out."""
    texts = [path.read_text(encoding="utf-8") for path in _public_headers(checkout)]
    names = [name for text in texts for name in cpp_code.read_text(INTERNAL.sub("", text)).enums]
    return sorted(name for name in names if RESULT.search(name))


def _result_enums(checkout: Checkout) -> list[str]:
    """Bound enums of results that a public module hands on."""
    faces = "".join(
        path.read_text(encoding="utf-8")
        for path in checkout.python
        if path.name in ("__init__.py", "__init__.pyi")
    )
    results = [name for name in _bound_enums(checkout) if RESULT.search(name)]
    return [name for name in results if re.search(rf"\b{name}\b", faces)]


def amount(value: Any) -> int:
    """What a table shows of a count: its number, the largest of sizes, or how many there are."""
    return value if isinstance(value, int) else len(value)


def table(counts: dict[str, Any]) -> Iterable[str]:
    for name, value in counts.items():
        shown = max(value.values()) if name.startswith(("members", "attributes")) else amount(value)
        yield f"{name:45} {shown:6}"


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("folder", nargs="?", type=Path, default=Path(__file__).parents[2])
    parser.add_argument("--json", type=Path, help="write names and sizes as well")
    options = parser.parse_args()
    counts = count(Checkout(options.folder))
    sys.stdout.write("\n".join(table(counts)) + "\n")
    if options.json:
        options.json.write_text(json.dumps(counts, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
