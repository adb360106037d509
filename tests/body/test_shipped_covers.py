"""The covering bodies that come with Sidestep are used, and hold their robots."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from sidestep import Body, Robot, clearance_tables
from sidestep.body import cache
from sidestep.body.cover import CoverSettings
from sidestep.body.cover_certificate import certify
from sidestep.body.cover_overshoot import overshoot
from sidestep.body.cover_refine import Ellipsoids
from sidestep.body.cover_surface import LinkSurface
from sidestep.link_pairs import stored_at

FILES = sorted(path for path in cache.SHIPPED.glob("*.json") if not path.name.startswith("pairs-"))


@pytest.mark.parametrize("path", FILES, ids=lambda path: json.loads(path.read_text())["robot"]["name"])
def test_it_is_taken_and_holds_every_link(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    written = json.loads(path.read_text())["robot"]
    try:
        robot = Robot.named(written["name"])
    except ModuleNotFoundError as error:
        pytest.skip(str(error))
    if robot.fingerprint != written["fingerprint"]:
        pytest.skip("its package has other meshes by now: run benchmarks/ship_covers.py")
    assert cache.cache_path(robot, CoverSettings()).name == path.name  # of today's algorithm
    monkeypatch.setattr("sidestep.body.body.cover_mixtures", None)  # nothing is left to fit
    body = Body.cover(robot)
    assert len(body.links) <= 80
    assert (cache.SHIPPED / stored_at(robot, body).name).is_file()
    assert (cache.SHIPPED / clearance_tables.stored_at(robot).name).is_file()
    for link in dict.fromkeys(body.links):
        mesh = robot.collision_mesh(link)
        assert mesh is not None
        ks = [k for k, name in enumerate(body.links) if name == link]
        offsets = mesh.vertices[None] - body.means[ks][:, None]
        shapes = np.asarray(body.levels)[ks, None, None] * body.covariances[ks]
        depth = np.einsum("kni,kij,knj->kn", offsets, np.linalg.inv(shapes), offsets).min(axis=0)
        assert depth.max() <= 1.0 + 1e-9


def test_that_of_the_fr3_overshoots_by_as_little_as_is_said() -> None:
    robot = Robot.named("fr3")
    body = Body.cover(robot)
    assert body.num_components <= 80
    for cover in body.link_covers:
        mesh = robot.collision_mesh(cover.link)
        assert mesh is not None
        surface = LinkSurface(np.asarray(mesh.triangles))
        ks = [k for k, name in enumerate(body.links) if name == cover.link]
        shapes = np.linalg.cholesky(np.asarray(body.levels)[ks, None, None] * body.covariances[ks])
        ellipsoids = Ellipsoids(body.means[ks], shapes)
        assert certify(surface.triangles, ellipsoids, tolerance=surface.size / 800).complete
        measured = overshoot(surface, ellipsoids)
        # The base, which no joint moves, by 15.6 mm.
        assert measured.maximum <= (16e-3 if cover.link == "fr3_link0" else 15e-3)
        assert measured.mean == pytest.approx(cover.mean_overshoot, rel=0.02)
        if cover.link.endswith("finger"):
            assert measured.mean <= 2e-3


def test_planar3_is_there() -> None:
    assert cache.cache_path(Robot.named("planar3"), CoverSettings()).name in {path.name for path in FILES}
