"""The README's Python example runs, and it has exactly two set-up commands."""

import contextlib
import io
import re
import tomllib
from pathlib import Path

README = (Path(__file__).parents[1] / "README.md").read_text(encoding="utf-8")


def blocks(language: str) -> list[str]:
    return re.findall(rf"^```{language}\n(.*?)^```$", README, flags=re.MULTILINE | re.DOTALL)


def test_python_example_arrives() -> None:
    (example,) = blocks("python")
    output = io.StringIO()
    with contextlib.redirect_stdout(output):
        exec(compile(example, "README.md", "exec"), {})
    assert output.getvalue() == "arrived ok arrived\n"


def test_two_set_up_commands() -> None:
    commands = [line for line in README.splitlines() if re.match(r"python3? -m venv ", line)]
    assert [line.split(" && ")[-1] for line in commands] == ["sidestep demo", "pytest"]


def test_every_extra_is_explained() -> None:
    project = tomllib.loads((Path(__file__).parents[1] / "pyproject.toml").read_text(encoding="utf-8"))[
        "project"
    ]
    page = (Path(__file__).parents[1] / "docs" / "start" / "install.md").read_text(encoding="utf-8")
    rows = [row for row in page.splitlines() if row.startswith("| `")]
    named = [extra for row in rows for extra in re.findall(r"`([\w-]+)`", row.split("|")[1])]
    assert sorted(named) == sorted(project["optional-dependencies"])


def test_links_lead_somewhere() -> None:
    root = Path(__file__).parents[1]
    links = [link for link in re.findall(r"\]\(([^)]+)\)", README) if "://" not in link]
    assert links
    assert [link for link in links if not (root / link.partition("#")[0]).exists()] == []
