"""Every public name has a docstring; so has every public member of a class, unless the class describes it."""

import ast
import enum
import importlib
import inspect
import re
import runpy
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
NAMES: dict[str, list[str]] = runpy.run_path(str(ROOT / "docs" / "make_reference.py"))["public_names"]()
STUBS = ast.parse((ROOT / "src" / "sidestep" / "_core.pyi").read_text(encoding="utf-8"))


def says(thing: object) -> str:
    """The docstring without the signature that a binding puts first."""
    lines = (inspect.getdoc(thing) or "").splitlines()
    return "\n".join(line for line in lines if not re.match(r"\w*\(.*\)( -> .*)?$", line)).strip()


def undocumented(thing: object, name: str) -> Iterator[str]:
    """Names of a public class or function, and of the members of a class in Python, that say nothing."""
    if not (inspect.isclass(thing) or inspect.isroutine(thing)):
        return  # an alias of a type
    if not says(thing):
        yield name
    if not inspect.isclass(thing) or issubclass(thing, enum.Enum) or thing.__module__ == "sidestep._core":
        return
    for member, value in vars(thing).items():
        if inspect.isfunction(value) or isinstance(value, property | classmethod | staticmethod):
            silent = not says(getattr(value, "__func__", value))
            if silent and not member.startswith("_") and not re.search(rf"\b{member}\b", says(thing)):
                yield f"{name}.{member}"


def undocumented_members(stub: ast.ClassDef) -> Iterator[str]:
    """Members of a class of the core without a docstring, by its stub. A part of settings has that of its type."""
    of_class = ast.get_docstring(stub) or ""
    for member in stub.body:
        if (
            not isinstance(member, ast.FunctionDef)
            or member.name.startswith("_")
            or ast.get_docstring(member)
        ):
            continue
        decorators = [ast.unparse(item) for item in member.decorator_list]
        returns = ast.unparse(member.returns) if member.returns else ""
        if f"{member.name}.setter" in decorators or re.search(r"Settings\b|\bOutput\b", returns):
            continue
        if not re.search(rf"\b{member.name}\b", of_class):
            yield f"{stub.name}.{member.name}"


@pytest.mark.parametrize("module", NAMES)
def test_public_names_have_docstrings(module: str) -> None:
    part = importlib.import_module(module)
    assert NAMES[module]
    missing = [
        item for name in NAMES[module] for item in undocumented(getattr(part, name), f"{module}.{name}")
    ]
    assert missing == []


def test_members_of_the_core_have_docstrings() -> None:
    core = importlib.import_module("sidestep._core")
    public = {
        name
        for module, names in NAMES.items()
        for name in names
        if inspect.isclass(item := getattr(importlib.import_module(module), name))
        and issubclass(item, getattr(core, name, ()))
        and not issubclass(item, enum.Enum)
    }
    stubs = [item for item in STUBS.body if isinstance(item, ast.ClassDef) and item.name in public]
    assert len(stubs) > 60  # so many and more public classes are of the core, or extend one of it
    assert [item for stub in stubs for item in undocumented_members(stub)] == []


def test_a_missing_docstring_is_found() -> None:
    class Silent:
        def method(self) -> None:
            pass

        @property
        def value(self) -> int:
            return 0

    assert list(undocumented(Silent, "Silent")) == ["Silent", "Silent.method", "Silent.value"]
    stub = ast.parse("class S:\n  @property\n  def value(self) -> int: ...").body[0]
    assert isinstance(stub, ast.ClassDef)
    assert list(undocumented_members(stub)) == ["S.value"]
