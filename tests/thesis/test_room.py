"""The thesis's room has one door: it uses the rest of the core, which does not know it."""

from pathlib import Path

CPP = Path(__file__).parents[2] / "cpp"


def test_nothing_of_the_core_includes_the_thesis() -> None:
    files = [path for folder in ("include", "src") for path in (CPP / folder).rglob("*.*")]
    outside = [path for path in files if "thesis" not in path.relative_to(CPP).parts]
    assert len(outside) > 100
    assert len(files) - len(outside) > 10
    assert [path for path in outside if "thesis/" in path.read_text("utf-8")] == []
