"""Covers: the proof on triangles, levels, overshoot by value, the file."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh

from sidestep import Body, Robot, _core
from sidestep._core import distance_to_triangles
from sidestep.body.cover_certificate import certify, complete
from sidestep.body.cover_overshoot import overshoot, union_volume
from sidestep.body.cover_problem import TradeOff
from sidestep.body.cover_refine import OUTLINE, Ellipsoids, rearranged, refine
from sidestep.body.cover_settings import CoverSettings, components_for
from sidestep.body.cover_surface import LinkSurface
from sidestep.body.sampling import sample_link

TRIANGLE = np.array([[[0.0, 0.0, 0.0], [0.1, 0.0, 0.0], [0.0, 0.1, 0.0]]])


@pytest.fixture(scope="module")
def planar() -> Robot:
    return Robot.named("planar2")


@pytest.fixture(scope="module")
def body(planar: Robot) -> Body:
    return Body.cover(planar, components=3, cache=False)


def ball(radius: float, centre: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> Ellipsoids:
    return Ellipsoids(np.array([centre]), radius * np.eye(3)[None])


def ellipsoids_of(body: Body, link: str) -> Ellipsoids:
    own = np.asarray(body.links) == link
    assert body.levels is not None
    shapes = np.linalg.cholesky(body.covariances[own] * body.levels[own][:, None, None])
    return Ellipsoids(body.means[own], shapes)


def test_one_ball_around_a_triangle_is_proven_at_once() -> None:
    certificate = certify(TRIANGLE, ball(0.11), tolerance=1e-3)
    assert certificate.complete
    assert certificate.num_pieces == 1
    assert certificate.covered_area == pytest.approx(0.005, rel=1e-12)  # rounding


def test_a_bare_corner_is_found_where_samples_would_miss_it() -> None:
    certificate = certify(TRIANGLE, ball(0.0999), tolerance=1e-4)
    assert not certificate.complete
    corners = np.linalg.norm(certificate.remaining.reshape(-1, 3), axis=1)
    assert corners.max() == pytest.approx(0.1, abs=1e-12)  # the far corners themselves
    assert corners.min() > 0.0997  # every remainder is within the tolerance of the ball's boundary


def test_a_gap_between_two_balls_is_not_hidden_by_covered_corners() -> None:
    two = Ellipsoids(np.array([[0.0, 0.0, 0.0], [0.1, 0.0, 0.0]]), 0.049 * np.stack([np.eye(3)] * 2))
    sliver = np.array([[[0.0, 0.0, 0.0], [0.1, 0.0, 0.0], [0.0, 1e-3, 0.0]]])
    certificate = certify(sliver, two, tolerance=1e-4)
    assert not certificate.complete
    middle = certificate.remaining.reshape(-1, 3)[:, 0]
    assert middle.min() < 0.05 < middle.max()  # the bare band is 49 to 51 mm along the sliver


def test_completing_grows_a_ball_to_the_farthest_corner_and_no_farther() -> None:
    grown, certificate = complete(TRIANGLE, ball(0.09), tolerance=1e-4, points=np.zeros((1, 3)))
    assert certificate.complete
    assert grown.shapes[0, 0, 0] == pytest.approx(0.1, rel=1e-6)  # grows by 1e-9 over what is needed


def test_overshoot_of_a_ball_around_a_cube_by_value(planar: Robot) -> None:
    import trimesh

    cube = LinkSurface(np.asarray(trimesh.creation.box(extents=(0.1, 0.1, 0.1)).triangles))
    measured = overshoot(cube, ball(0.05 * np.sqrt(3.0)), directions=5000)
    # over the middle of a face; 5000 points miss it by less than 3 mm, which is 0.05 mm of height
    assert measured.maximum == pytest.approx(0.05 * (np.sqrt(3.0) - 1.0), abs=1e-4)
    volume = union_volume(ball(0.1), np.random.default_rng(0), 200_000)
    assert volume == pytest.approx(4.0 / 3.0 * np.pi * 1e-3, rel=0.01)  # three standard errors are 0.5 %


def test_distance_to_a_triangle_by_value() -> None:
    triangles = np.array([[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]], [[5.0, 0.0, 0.0]] * 3])
    points = [[0.2, 0.2, -0.3], [0.5, -2.0, 0.0], [1.0, 1.0, 0.0], [-3.0, -4.0, 0.0], [5.0, 0.0, 2.0]]
    both = np.tile([0, 1], (5, 1))
    expected = [0.3, 2.0, np.sqrt(0.5), 5.0, 2.0]  # face, edge, edge, corner, a triangle without area
    np.testing.assert_allclose(distance_to_triangles(points, triangles, both), expected, rtol=1e-14)
    with pytest.raises(ValueError, match="candidate 2 is none of the 2 triangles"):
        distance_to_triangles(points, triangles, both + 1)


def test_distances_agree_with_every_triangle_examined() -> None:
    import trimesh

    mesh = trimesh.creation.cylinder(radius=0.05, height=0.2)
    surface = LinkSurface(np.asarray(mesh.triangles))
    points = surface.sample(200, np.random.default_rng(1)) + np.random.default_rng(2).normal(
        0.0, 0.01, (200, 3)
    )
    every = np.tile(np.arange(len(mesh.triangles)), (len(points), 1))
    slow = distance_to_triangles(points, mesh.triangles, every)
    np.testing.assert_allclose(surface.distance(points), slow, atol=1e-9)  # rounding of cut triangles
    inside = np.linalg.norm(points[:, :2], axis=1) < 0.04
    inside &= np.abs(points[:, 2]) < 0.09
    assert surface.field.surely_inside(points)[inside].all()
    outside = np.linalg.norm(points[:, :2], axis=1) > 0.0501
    assert not surface.field.surely_inside(points)[outside].any()


@pytest.mark.slow
def test_every_link_of_a_planar_arm_is_proven_covered(planar: Robot, body: Body) -> None:
    assert body.num_components == 6
    for cover in body.link_covers:
        mesh = planar.collision_mesh(cover.link)
        assert mesh is not None
        assert cover.coverage == 1.0
        ellipsoids = ellipsoids_of(body, cover.link)
        assert certify(np.asarray(mesh.triangles), ellipsoids, tolerance=1e-4).complete
        points = sample_link(planar, cover.link, count=10_000, seed=5)
        assert (ellipsoids.radii(points).min(axis=1) <= 1.0).all()
        # one ellipsoid about the 0.5 x 0.08 x 0.08 m box reaches 183 mm past its ends; three halve that
        assert cover.max_overshoot < 0.09
        assert cover.slimness >= 0.2 - 1e-9  # rounding of the limit


@pytest.mark.slow
def test_weights_are_shares_of_volume_and_levels_those_of_solids(body: Body) -> None:
    own = np.asarray(body.links) == "link1"
    volumes = np.sqrt(np.linalg.det(body.covariances[own]))
    np.testing.assert_allclose(body.weights[own], volumes / volumes.sum(), rtol=1e-9)  # rounding
    np.testing.assert_allclose(body.levels, 5.0, rtol=1e-8)  # widened by 1e-9 against rounding


@pytest.mark.slow
def test_equal_seeds_give_equal_covers(planar: Robot, body: Body) -> None:
    again = Body.cover(planar, components=3, cache=False)
    np.testing.assert_array_equal(again.covariances, body.covariances)


def test_a_cover_survives_its_file_and_an_old_file_has_no_levels(
    planar: Robot, body: Body, tmp_path: Path
) -> None:
    path = tmp_path / "arm.json"
    body.save(path)
    loaded = Body.load(path, planar)
    np.testing.assert_array_equal(loaded.levels, body.levels)
    assert [c.trade_off for c in loaded.link_covers] == [c.trade_off for c in body.link_covers]
    assert [c.max_overshoot for c in loaded.link_covers] == [c.max_overshoot for c in body.link_covers]
    assert loaded.settings == CoverSettings(components=3)
    Body.fit(planar, components=2, cache=False).save(path)
    document = json.loads(path.read_text())
    document["format_version"] = 1
    for link in document["links"]:
        del link["levels"], link["cover"]
    path.write_text(json.dumps(document))
    assert Body.load(path, planar).levels is None


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"max_components": 1}, "max_components is 1, must be at least 2"),
        ({"components": 0}, "components of link 'link1' is 0"),
        ({"components": {"link1": 80}}, "max_components is 80, must be at least 81"),
        ({"components": {"link3": 2}}, r"names unknown links \['link3'\]"),
        ({"seed": -1}, "seed is -1"),
    ],
)
def test_bad_settings_are_refused(planar: Robot, arguments: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        Body.cover(planar, cache=False, **arguments)


@pytest.mark.slow
def test_the_finger_of_the_fr3_is_covered_closely() -> None:
    from sidestep.body.cover_problem import LinkProblem

    robot = Robot.named("fr3")
    mesh = robot.collision_mesh("fr3_leftfinger")
    assert mesh is not None
    problem = LinkProblem(np.asarray(mesh.triangles), seed=0)
    solution = problem.solve(10)
    assert certify(problem.surface.triangles, solution.ellipsoids, tolerance=5e-5).complete  # proven at 6e-5
    # 2.2 mm and 4.8 mm were measured; the bounds leave room for another machine's rounding
    assert solution.measured.mean < 2.4e-3
    assert solution.measured.maximum < 5.4e-3


@pytest.mark.slow
def test_a_longer_search_covers_more_closely(planar: Robot) -> None:
    from sidestep.body.cover_problem import LinkProblem

    mesh = planar.collision_mesh("link2")
    assert mesh is not None
    gains = []
    for seed in range(3):
        problem = LinkProblem(np.asarray(mesh.triangles), seed=seed)
        quick = problem.excess(3)
        finished = problem.finish(3)
        problem.trials.clear()
        gains.append(quick - problem.excess(3))
        assert problem.finish(3) is finished
        assert problem.trade_off() == (TradeOff(3, finished.measured.mean, finished.measured.maximum),)
    # What the search minimises, a trade of mean and maximum, is never worse: 33.3, 34.3, 29.6, then 30.2, 28.0, 29.6
    # were measured. Which seeds gain is chance.
    assert min(gains) >= 0.0
    assert max(gains) > 1.0


def test_the_size_of_a_square_bar_does_not_depend_on_rounding() -> None:
    bar = np.asarray(trimesh.creation.box((0.5, 0.08, 0.08)).triangles)
    for seed in range(
        3
    ):  # noise as of another order of sums: it must not choose the axes of a square section
        noisy = bar + np.random.default_rng(seed).uniform(-1e-16, 1e-16, bar.shape)
        assert LinkSurface(noisy).size == pytest.approx(0.08, abs=1e-12)  # rounding


def test_a_rearrangement_splits_one_ellipsoid_and_leaves_another_out_or_shifts_all() -> None:
    cube = LinkSurface(np.asarray(trimesh.creation.box((0.1, 0.1, 0.1)).triangles))
    far = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0]])
    three = Ellipsoids(far, np.tile(np.diag([0.2, 0.1, 0.1]), (3, 1, 1)))
    points, weights = (
        np.array([[1.2, 0.0, 0.0], [2.2, 0.0, 0.0]]),
        np.array([1.0, 0.0]),
    )  # on the second and the third
    kinds = set()
    for seed in range(30):
        moved = rearranged(cube, three, points, weights, np.random.default_rng(seed))
        assert len(moved) == 3
        changed = [k for k in range(3) if not np.array_equal(moved.centres[k], three.centres[k])]
        if len(changed) == 3:
            kinds.add("shifted")
            assert np.array_equal(moved.shapes, three.shapes)
            assert np.abs(moved.centres - three.centres).max() < 5 * 0.06 * cube.size
            continue
        kept = ({0, 2} - set(changed)).pop()
        assert sorted(changed) == sorted(
            {0, 1, 2} - {kept}
        )  # the second is split, one of the others left out
        assert np.array_equal(moved.shapes[kept], three.shapes[kept])
        halves = moved.centres[changed] - far[1]
        assert halves.sum(axis=0) == pytest.approx(
            0.0, abs=1e-15
        )  # to both sides of it, along one of its axes
        axis = int(np.abs(halves[0]).argmax())
        kinds.add("x" if axis == 0 else "yz")
        semi_axes = np.array([0.2, 0.1, 0.1])
        assert np.abs(halves[0]) == pytest.approx(
            np.where(np.arange(3) == axis, 0.5 * semi_axes, 0.0), abs=1e-15
        )
        expected = np.diag(np.where(np.arange(3) == axis, 0.6 * semi_axes, semi_axes))
        assert moved.shapes[changed] == pytest.approx(np.tile(expected, (2, 1, 1)), abs=1e-15)
    assert kinds == {"shifted", "x", "yz"}
    # One ellipsoid cannot be split for another, and without overshoot there is none to split.
    for few, seen in ((Ellipsoids(far[:1], three.shapes[:1]), points[:1]), (three, points[:0])):
        for seed in range(5):
            moved = rearranged(cube, few, seen, np.ones(len(seen)), np.random.default_rng(seed))
            assert np.array_equal(moved.shapes, few.shapes)
            assert not np.any(np.all(moved.centres == few.centres, axis=1))


@pytest.mark.slow
def test_a_named_link_gets_its_number_and_the_others_share_the_rest(planar: Robot) -> None:
    shared = Body.cover(planar, components={"link2": 2}, max_components=3, cache=False)
    assert {c.link: c.num_components for c in shared.link_covers} == {"link1": 1, "link2": 2}


def test_arms_with_many_links_have_more_ellipsoids_to_share() -> None:
    assert [components_for(n) for n in (1, 12, 13, 17)] == [80, 80, 90, 130]


def test_refining_a_ball_inside_a_ball_finds_its_surface() -> None:
    import trimesh

    mesh = trimesh.creation.icosphere(subdivisions=4, radius=0.05)
    surface = LinkSurface(np.asarray(mesh.triangles))
    start = ball(0.03, (0.004, -0.003, 0.002))
    points = surface.points(1000)
    refined, multipliers = refine(surface, points, start, OUTLINE)
    # within the last steps' length, 0.2 % of 0.1 m, of the sphere and the margin of 0.1 mm
    np.testing.assert_allclose(refined.centres[0], 0.0, atol=3e-4)
    np.testing.assert_allclose(np.linalg.svd(refined.shapes[0], compute_uv=False), 0.0501, atol=3e-4)
    assert multipliers.min() == 0.0  # what is inside does not push
    _, multipliers = refine(surface, points, start, replace(OUTLINE, steps=20))
    assert multipliers.min() > 1.0  # a ball that is still smaller than the sphere: every point pushes


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"values": np.zeros((1, 2, 2))}, "at least 2 nodes"),
        ({"shapes": np.zeros((2, 3, 3))}, "1 centres and 2 shapes"),
        ({"multipliers": np.zeros(3)}, "1 points and 3 multipliers"),
        ({"directions": np.zeros((0, 4, 3))}, "no directions"),
        ({"steps": 0}, "steps and multiplier_steps must be at least 1"),
    ],
)
def test_the_core_refuses_what_does_not_fit_together(change: dict[str, Any], message: str) -> None:
    arguments: dict[str, Any] = {
        "origin": np.zeros(3), "spacing": 1.0, "values": np.zeros((2, 2, 2)), "points": np.zeros((1, 3)),
        "multipliers": np.zeros(1), "directions": np.zeros((1, 4, 3)), "centres": np.zeros((1, 3)),
        "shapes": np.eye(3)[None], "steps": 1, "first_rate": 1.0, "last_rate": 1.0, "stiffness": 1.0,
        "multiplier_steps": 1, "margin": 0.0, "unit": 1.0, "area": 1.0, "slimness": 0.2,
    }  # fmt: skip
    with pytest.raises(ValueError, match=message):
        _core.refine_cover(**{**arguments, **change})
