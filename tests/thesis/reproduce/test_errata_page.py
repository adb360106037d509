import re
from pathlib import Path

from sidestep.thesis.reproduce.errata import ERRATA, markdown

ROOT = Path(__file__).parents[3]


def test_the_documentation_is_the_list():
    assert (ROOT / "docs" / "results" / "errata.md").read_text(encoding="utf-8") == markdown()


def test_every_erratum_names_a_test_that_exists():
    for erratum in ERRATA:
        file, name = erratum.test.split("::")
        source = (Path(__file__).parent / file).read_text(encoding="utf-8")
        assert re.search(rf"^def {name}\(", source, re.MULTILINE), erratum.test
    assert [erratum.number for erratum in ERRATA] == list(range(1, len(ERRATA) + 1))
