"""The first page of the site links to the recorded runs where they are made, and else says how to make them; their list
links back."""

import runpy
from pathlib import Path
from types import SimpleNamespace
from unittest import mock

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


def test_the_list_links_back_as_part_of_the_site_only(tmp_path: Path) -> None:
    pytest.importorskip("mkdocs")
    hooks = runpy.run_path(str(DOCS / "hooks.py"))
    runs, site = tmp_path / "runs", tmp_path / "site"
    heading = hooks["RUNS_HEADING"]
    assert heading in (DOCS / "record_runs.py").read_text(encoding="utf-8")
    runs.mkdir()
    (runs / "index.html").write_text(f"<html>{heading}</html>", encoding="utf-8")
    after = hooks["on_post_build"]
    after.__globals__["RUNS"] = runs
    with mock.patch("shutil.which", return_value=None):  # no Doxygen
        after(SimpleNamespace(site_dir=str(site)))
    assert '<a href="../index.html">Sidestep</a>' in (site / "runs" / "index.html").read_text(
        encoding="utf-8"
    )
    assert "href" not in (runs / "index.html").read_text(encoding="utf-8")
