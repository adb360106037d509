"""Python in the pages runs as it stands, prints what stands below it, and commands in them exist."""

import ast
import importlib
import re
import shutil
from pathlib import Path
from typing import Any

import pytest
import typer

from sidestep.cli import app
from support.busy_machine import unless_held_up
from support.missing_packages import missing_without, run

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
PAGES = [*sorted(DOCS.rglob("*.md")), ROOT / "README.md"]
# A block that needs hardware or a browser stands below a comment that says so: <!-- not run: needs a robot -->
BLOCK = re.compile(
    r"(?:^<!-- not run: (?P<reason>.+?) -->\n+)?^```python\n(?P<code>.*?)^```$(?:\n+```text\n(?P<output>.*?)^```$)?",
    re.MULTILINE | re.DOTALL,
)
LONGEST = 15  # lines of a block, without empty ones


def blocks(page: Path) -> list[re.Match[str]]:
    return list(BLOCK.finditer(page.read_text(encoding="utf-8")))


def name_of(page: Path) -> str:
    return page.relative_to(ROOT).as_posix()


RUN = [page for page in PAGES if any(not item["reason"] for item in blocks(page))]


@pytest.fixture(scope="module")
def cache(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("cache")


@pytest.mark.slow
@pytest.mark.parametrize("page", RUN, ids=name_of)
def test_examples_run_with_the_extras_that_the_page_names(
    page: Path, tmp_path: Path, cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for file in (DOCS / "files").iterdir():
        shutil.copy(file, tmp_path)
    monkeypatch.setenv("SIDESTEP_CACHE_DIR", str(cache))
    named = re.findall(r"pip install '\.\[([a-z,]+)\]'", page.read_text(encoding="utf-8"))
    program = ["", f"hide(*{missing_without(*(extra for names in named for extra in names.split(',')))!r})"]
    expected = ""
    for block in blocks(page):
        if not block["reason"]:
            program.append(block["code"])
            expected += block["output"] or ""
    done = unless_held_up(lambda: run("\n".join(program), folder=tmp_path), lambda done: done.stdout)
    assert (done.returncode, done.stdout) == (0, expected), done.stderr


def missing_names(code: str) -> list[str]:
    """Attributes of what a program imports that there are not, such as ss.Sphere.at."""
    tree, known, missing = ast.parse(code), dict[str, Any](), []
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            known |= {name.asname or name.name: importlib.import_module(name.name) for name in node.names}
        elif isinstance(node, ast.ImportFrom):
            module = importlib.import_module(node.module or "")
            known |= {name.asname or name.name: getattr(module, name.name) for name in node.names}
    for node in ast.walk(tree):
        chain, at = [], node
        while isinstance(at, ast.Attribute):
            chain.append(at.attr)
            at = at.value
        if chain and isinstance(at, ast.Name) and at.id in known:
            found = known[at.id]
            for name in reversed(chain):
                if not hasattr(found, name):
                    missing.append(f"{at.id}.{'.'.join(reversed(chain))}")
                    break
                found = getattr(found, name)
    return missing


@pytest.mark.parametrize("page", PAGES, ids=name_of)
def test_names_exist_in_blocks_that_are_not_run(page: Path) -> None:
    assert missing_names("import sidestep as ss\nss.Sphere.at([0, 0, 0])\nss.Sphere(0.1)") == ["ss.Sphere.at"]
    assert [name for block in blocks(page) if block["reason"] for name in missing_names(block["code"])] == []


def test_every_how_to_has_short_code() -> None:
    pages = sorted((DOCS / "how-to").glob("*.md"))
    assert len(pages) >= 13
    for page in pages:
        found = blocks(page)
        assert found, page.name
        for block in found:
            lines = [line for line in block["code"].splitlines() if line.strip()]
            assert len(lines) <= LONGEST, f"{page.name}: {len(lines)} lines"


def test_cpp_in_the_pages_is_that_of_the_files_they_name() -> None:
    found = 0
    for page in PAGES:
        for code in re.findall(
            r"^```cpp\n(.*?)^```$", page.read_text(encoding="utf-8"), re.MULTILINE | re.DOTALL
        ):
            first, _, rest = code.partition("\n")
            assert first.startswith(("// examples/cpp/", "// cpp/")), page.name
            assert rest in (ROOT / first.removeprefix("// ")).read_text(encoding="utf-8"), page.name
            found += 1
    assert found > 0


COMMANDS: Any = typer.main.get_command(app)


def command_named(words: list[str]) -> tuple[Any, list[str]]:
    """The command that some words lead to, and the words that are left."""
    command = COMMANDS
    while words and words[0] in getattr(command, "commands", {}):
        command, words = command.commands[words[0]], words[1:]
    return command, words


@pytest.mark.parametrize("page", PAGES, ids=name_of)
def test_commands_exist(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    text = re.sub(r"^```(?!sh\b)\w+\n.*?^```$", "", text, flags=re.MULTILINE | re.DOTALL)
    for line in re.findall(r"(?:^|`|&& |\$\()sidestep ([a-z][^`\n)]*)", text, re.MULTILINE):
        words = line.split(" && ")[0].split()
        command, left = command_named(words)
        if words[0] not in COMMANDS.commands:
            pytest.fail(f"there is no command: sidestep {line}")
        known = {option for item in command.params for option in (*item.opts, *item.secondary_opts)}
        known |= {"--help", "-h", "--version", "--cmake-dir"}
        used = [word.split("=")[0].rstrip(",.;") for word in left if word.startswith("-") and word != "-"]
        assert [option for option in used if option not in known] == [], line
