"""The page on the code names files and functions that there are."""

import re
from pathlib import Path

DOCS = Path(__file__).parents[2] / "docs"


def is_inside(name: str, files: list[str]) -> bool:
    """Whether a file that has the class `A` of `A::b` calls or defines `b`."""
    *owners, last = name.split("::")
    return any(
        re.search(rf"\b(class|struct) {owners[-1]}\b", text) and re.search(rf"\b{last}\(", text)
        for text in files
    )


def test_how_the_code_is_built_names_files_and_functions_that_there_are() -> None:
    root = DOCS.parent
    page = (DOCS / "how-the-code-is-built.md").read_text(encoding="utf-8")
    names = re.findall(r"`([^`\n]+)`", page)
    files = [name for name in names if re.match(r"(cpp|src|bindings|tests)/", name)]
    functions = [name for name in names if "::" in name]
    assert len(files) > 25
    assert len(functions) > 25
    assert [name for name in files if not (root / name).exists()] == []
    core = [file for suffix in ("cpp", "hpp", "inl") for file in (root / "cpp").rglob(f"*.{suffix}")]
    files_of_core = [file.read_text(encoding="utf-8") for file in core]
    text = "\n".join(files_of_core)
    # `Class::function` as it is defined, or by its last name where it is defined inside its class.
    unknown = [name for name in functions if f"{name}(" not in text and not is_inside(name, files_of_core)]
    assert unknown == []
    plain = [name for name in names if re.fullmatch(r"[A-Za-z_]+", name) and name not in files]
    python = "\n".join(file.read_text(encoding="utf-8") for file in (root / "src").rglob("*.py"))
    assert [name for name in plain if not re.search(rf"\b{name}\b", text + python)] == []
