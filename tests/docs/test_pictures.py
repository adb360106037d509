"""The pictures of the site can be made: what they compute still runs, and draws something."""

import itertools
import sys
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

IMAGES = Path(__file__).parents[2] / "docs" / "images"


@pytest.fixture
def figures(monkeypatch: pytest.MonkeyPatch, tmp_path: Path):
    monkeypatch.syspath_prepend(str(IMAGES))
    import camera_figures
    import figures
    import source_figures
    import theory_figures

    monkeypatch.setattr(figures, "HERE", tmp_path)
    yield figures, theory_figures, source_figures, camera_figures
    for name in ("figures", "theory_figures", "source_figures", "camera_figures"):
        sys.modules.pop(name)


@pytest.mark.slow
@pytest.mark.parametrize(
    "name",
    [
        *("barriers", "planner", "density", "geometry", "systems", "control", "timed_path", "believes"),
        *("camera_pixels", "camera_map", "camera_unseen"),
    ],
)
def test_figure_is_drawn(figures, tmp_path: Path, name: str) -> None:
    module = next(module for module in figures if hasattr(module, name))
    getattr(module, name)()
    (path,) = tmp_path.glob("*.png")
    picture = np.asarray(Image.open(path).convert("L"))
    assert picture.shape[1] == 990  # 9 inches at 110 dots
    assert 0.01 < np.mean(picture < 250) < 0.9  # neither empty nor full
    committed = Image.open(IMAGES / path.name)
    assert committed.size[0] == 990


def test_diagram_of_the_loop_is_the_committed_one(figures, tmp_path: Path) -> None:
    figures[0].loop()
    assert (tmp_path / "loop.svg").read_text(encoding="utf-8") == (IMAGES / "loop.svg").read_text(
        encoding="utf-8"
    )


@pytest.mark.slow
def test_the_arm_of_the_first_picture_leaves_for_its_goal(monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("mujoco")
    monkeypatch.syspath_prepend(str(IMAGES))
    import table

    rows = list(itertools.islice(table.motion(), 80))
    first, last = rows[0], rows[-1]
    assert last[5] == 0  # contacts
    assert np.abs(last[3] - first[3]).max() > 1e-3  # [rad] in 0.08 s, while a posture is searched and a path
    assert np.linalg.norm(last[4] - first[4]) == pytest.approx(0.079 * table.FASTEST, rel=0.01)  # the ball
