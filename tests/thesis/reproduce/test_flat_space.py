import csv
import re

import numpy as np
import pytest

from sidestep.thesis.reproduce import Figure, reproduce, select


def test_flat_space_is_the_damped_oscillation(tmp_path):
    outcome = reproduce(tmp_path, only=["5.1"])
    figure = outcome.items["figure-5.1"]
    assert isinstance(figure, Figure)
    # Runge-Kutta with 1 ms: its error over 15 s is far below 1e-10; the closed form is exact.
    np.testing.assert_allclose(figure.data["q_rad"], figure.data["q_closed_form_rad"], atol=1e-10)
    # A straight line: the cross product with the direction to the goal stays zero.
    offset = figure.data["q_rad"] - figure.data["q_rad"][0]
    along = np.array([1.5, 1.35])
    assert np.abs(offset[:, 0] * along[1] - offset[:, 1] * along[0]).max() < 1e-12


def test_files_are_written_and_the_page_needs_nothing_else(tmp_path):
    outcome = reproduce(tmp_path, only=["5.1"])
    names = {path.name for path in tmp_path.iterdir()}
    assert names == {"index.html", "figure-5.1.png", "figure-5.1.svg", "figure-5.1.csv"}
    page = outcome.page.read_text(encoding="utf-8")
    assert "data:image/png;base64," in page
    # Whatever the page points to is inside it: pictures as data, links to its own headings.
    targets = re.findall(r"(?:src|href)\s*=\s*[\"']?([^\"'>\s]{1,20})", page)
    assert targets
    assert all(target.startswith(("data:image/png", "#")) for target in targets)
    assert not re.search(r"url\(|@import|<script|<link|https?://", page)
    with (tmp_path / "figure-5.1.csv").open(encoding="utf-8") as file:
        rows = list(csv.reader(file))
    assert rows[0][:3] == ["time_s", "q_rad[0]", "q_rad[1]"]
    assert [float(x) for x in rows[1][:3]] == [0.0, -0.5, -1.2]


def test_unknown_part_is_refused_with_those_allowed():
    with pytest.raises(ValueError, match=r"no part '9\.9'; allowed: .*5\.1"):
        select(["9.9"])
