"""Pages of recorded runs, which need no server."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path

import pytest

SCRIPT = Path(__file__).parents[2] / "docs" / "record_runs.py"


@pytest.mark.slow
def test_a_run_is_a_page_that_holds_its_scene(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    spec = importlib.util.spec_from_file_location("record_runs", SCRIPT)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    monkeypatch.setattr(sys, "argv", ["record_runs", str(tmp_path), "Table", "--seconds", "0.2"])
    module.main()
    assert sorted(path.name for path in tmp_path.iterdir()) == ["index.html", "table.html"]
    page = (tmp_path / "table.html").read_text(encoding="utf-8")
    data = page.split('__VISER_EMBED_DATA__="', 1)[1].split('"', 1)[0]
    assert len(data) > 100_000  # characters: an arm of 15,000 triangles, and the objects
    index = (tmp_path / "index.html").read_text(encoding="utf-8")
    assert "src='table.html'" in index
    assert "http" not in index
    monkeypatch.setattr(sys, "argv", ["record_runs", str(tmp_path), "Nowhere"])
    with pytest.raises(SystemExit):
        module.main()
