"""The table and the figures of a fit."""

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from sidestep import Body, Robot
from sidestep.body import fit_table, plot_fit


def test_the_table_states_the_fit_in_readable_units(planar: Robot) -> None:
    body = Body.fit(planar, components=2, samples=200)
    for row, fit in zip(fit_table(body), body.link_fits, strict=True):
        assert (row.link, row.num_components, row.converged) == (fit.link, 2, fit.converged)
        assert row.coverage_percent == 100.0 * fit.coverage
        assert row.mean_distance_mm == 1000.0 * fit.mean_distance


@pytest.mark.slow
@pytest.mark.parametrize(
    ("components", "names"), [(1, ["links", "arm"]), ("bic", ["links", "arm", "criterion"])]
)
def test_figures_show_something(planar: Robot, components: object, names: list[str], tmp_path: Path) -> None:
    body = Body.fit(planar, components=components, samples=200, max_components=2)  # type: ignore[arg-type]
    paths = plot_fit(body, planar, tmp_path / "figures")
    assert [path.name for path in paths] == [f"{name}.png" for name in names]
    for path in paths:
        pixels = np.asarray(Image.open(path).convert("RGB"))
        coloured = np.ptp(pixels.astype(int), axis=2) > 40
        assert coloured.mean() > 1e-3  # curves or ellipsoids in colour, not an empty pair of axes


def test_bodies_without_a_fit_or_of_another_robot_are_refused(planar: Robot, tmp_path: Path) -> None:
    by_hand = Body(links=["a"], weights=[1.0], means=[[0.0, 0.0, 0.0]], covariances=[np.eye(3)])
    with pytest.raises(ValueError, match="made by hand and carries no fit"):
        fit_table(by_hand)
    with pytest.raises(ValueError, match="body of robot 'planar2' cannot be drawn on robot 'planar3'"):
        plot_fit(Body.fit(planar, components=1, samples=200), Robot.named("planar3"), tmp_path)
