"""The first page of the site links to the recorded runs where they are made, and else says how to make them."""

import runpy
from pathlib import Path
from types import SimpleNamespace

import pytest

DOCS = Path(__file__).parents[2] / "docs"


@pytest.mark.parametrize("made", [False, True])
def test_the_first_page_links_to_recorded_runs(made: bool, tmp_path: Path) -> None:
    pytest.importorskip("mkdocs")
    hooks = runpy.run_path(str(DOCS / "hooks.py"))
    if made:
        (tmp_path / "index.html").touch()
    on_page = hooks["on_page_markdown"]
    on_page.__globals__["RUNS"] = tmp_path
    page = SimpleNamespace(file=SimpleNamespace(src_uri="index.md"))
    text = on_page((DOCS / "index.md").read_text(encoding="utf-8"), page)
    row = next(line for line in text.splitlines() if line.startswith("| watch it in the browser"))
    assert ('<a href="runs/index.html">Recorded runs</a>' in row) == made
    assert ("how-to/studio.md#pages-of-recorded-runs" in row) != made
