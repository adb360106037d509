"""Fitting whole robots, the body file, and the cache."""

import json
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from sidestep import Body, Robot
from sidestep.body import cache as fit_cache
from sidestep.body import sample_link

SAMPLES = 300  # enough for two Gaussians per link, and fast


@pytest.fixture
def body(planar: Robot) -> Body:
    return Body.fit(planar, components=2, samples=SAMPLES)


def equal(a: Body, b: Body) -> bool:
    return a.links == b.links and all(
        np.array_equal(getattr(a, name), getattr(b, name)) for name in ("weights", "means", "covariances")
    )


def test_every_link_with_geometry_gets_its_components(fr3: Robot) -> None:
    body = Body.fit(fr3, components=3, samples=SAMPLES)
    expected = [link.name for link in fr3.links if link.geometries]
    assert body.links == [name for name in expected for _ in range(3)]
    assert "fr3_link0" in body.links  # fixed to the world, drawn all the same
    for name in expected:
        own = np.asarray(body.links) == name
        assert body.weights[own].sum() == pytest.approx(1.0, abs=1e-12)  # rounding
        mesh = fr3.collision_mesh(name)
        assert mesh is not None
        assert (body.means[own] > mesh.bounds[0]).all()
        assert (body.means[own] < mesh.bounds[1]).all()
        # the law of total expectation: EM keeps the mean of the cloud exactly (to its rounding)
        cloud = sample_link(fr3, name, count=SAMPLES, seed=0)
        np.testing.assert_allclose(body.weights[own] @ body.means[own], cloud.mean(axis=0), atol=1e-5)


def test_link_fits_tell_the_quality(planar: Robot, body: Body) -> None:
    for fit in body.link_fits:
        cloud = sample_link(planar, fit.link, count=SAMPLES, seed=0)
        own = np.asarray(body.links) == fit.link
        offsets = cloud[:, None] - body.means[own]
        squared = np.einsum("nki,kij,nkj->nk", offsets, np.linalg.inv(body.covariances[own]), offsets)
        assert fit.num_components == 2
        assert fit.coverage == np.mean(squared.min(axis=1) <= 4.0)
        # rounding of a mean of norms
        assert fit.mean_distance == pytest.approx(
            np.linalg.norm(offsets, axis=2).min(axis=1).mean(), rel=1e-12
        )


def test_components_per_link(planar: Robot) -> None:
    names = [link.name for link in planar.links if link.geometries]
    numbers = {name: index + 1 for index, name in enumerate(names)}
    body = Body.fit(planar, components=numbers, samples=SAMPLES)
    assert {fit.link: fit.num_components for fit in body.link_fits} == numbers


@pytest.mark.parametrize("criterion", ["aic", "bic"])
def test_components_by_criterion(planar: Robot, criterion: Any) -> None:
    seen: list[tuple[str, int, int]] = []
    body = Body.fit(
        planar,
        components=criterion,
        samples=SAMPLES,
        max_components=3,
        progress=lambda link, done, total: seen.append((link, done, total)),
    )
    for fit in body.link_fits:
        assert fit.curve is not None
        values = fit.curve.aic if criterion == "aic" else fit.curve.bic
        assert fit.num_components == fit.curve.components[np.argmin(values)]
    num_links = len(body.link_fits)
    done = [step[1] for step in seen]
    assert done == sorted(done)
    assert (done[0], done[-1]) == (0, 4 * num_links)
    assert {step[2] for step in seen} == {4 * num_links}


def test_a_fit_depends_on_its_seed_and_nothing_else(planar: Robot, body: Body) -> None:
    assert equal(body, Body.fit(planar, components=2, samples=SAMPLES, cache=False))
    assert not equal(body, Body.fit(planar, components=2, samples=SAMPLES, cache=False, seed=1))


def test_bad_requests_are_refused(planar: Robot) -> None:
    names = [link.name for link in planar.links if link.geometries]
    with pytest.raises(
        ValueError, match=rf"names unknown links \['arm'\]; the links with geometry are {names[0]}"
    ):
        Body.fit(planar, components={"arm": 2, **dict.fromkeys(names, 1)})
    with pytest.raises(ValueError, match=rf"has no number for links \['{names[-1]}'\]"):
        Body.fit(planar, components=dict.fromkeys(names[:-1], 1))
    with pytest.raises(ValueError, match=f"components of link '{names[0]}' is 0, must be a whole number"):
        Body.fit(planar, components=0)
    with pytest.raises(ValueError, match=r"is 2\.5, must be a whole number"):
        Body.fit(planar, components=2.5)  # type: ignore[arg-type]
    with pytest.raises(ValueError, match=r"components is 'mdl', must be .* one of aic, bic"):
        Body.fit(planar, components="mdl")  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="covariance is 'tied'"):
        Body.fit(planar, covariance="tied")  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="seed is -1"):
        Body.fit(planar, seed=-1)
    with pytest.raises(ValueError, match="samples is 4, must be above the 4 components"):
        Body.fit(planar, samples=4)
    with pytest.raises(ValueError, match="samples is 50 and max_components is 10"):
        Body.fit(planar, components="bic", samples=50)


def test_a_robot_without_geometry_is_refused() -> None:
    robot = Robot.from_urdf(
        '<robot name="bones"><link name="a"/><link name="b"/><joint name="j" type="revolute">'
        '<parent link="a"/><child link="b"/><axis xyz="0 0 1"/>'
        '<limit lower="-1" upper="1" velocity="1" effort="1"/></joint></robot>'
    )
    with pytest.raises(ValueError, match="robot 'bones' has no link with geometry"):
        Body.fit(robot)


def test_a_body_file_gives_the_body_back(planar: Robot, tmp_path: Path) -> None:
    body = Body.fit(
        planar, components="bic", covariance="diagonal", samples=SAMPLES, max_components=3, seed=6
    )
    body.save(tmp_path / "arm.json")
    loaded = Body.load(tmp_path / "arm.json", planar)
    assert equal(body, loaded)
    assert loaded.settings == body.settings
    assert (loaded.robot_name, loaded.fingerprint) == (planar.name, planar.fingerprint)
    for fit, again in zip(body.link_fits, loaded.link_fits, strict=True):
        assert (fit.link, fit.coverage, fit.log_likelihood) == (
            again.link,
            again.coverage,
            again.log_likelihood,
        )
        assert fit.curve is not None
        assert again.curve is not None
        np.testing.assert_array_equal(fit.curve.bic, again.curve.bic)
    assert [path.name for path in tmp_path.glob("*arm*")] == ["arm.json"]  # no temporary file is left


def test_a_body_of_another_robot_is_refused(body: Body, tmp_path: Path) -> None:
    body.save(tmp_path / "arm.json")
    with pytest.raises(ValueError, match=r"fitted to robot 'planar2' .* cannot be used with robot 'planar3'"):
        Body.load(tmp_path / "arm.json", Robot.named("planar3"))


def test_a_body_made_by_hand_cannot_be_saved(tmp_path: Path) -> None:
    body = Body(links=["a"], weights=[1.0], means=[[0.0, 0.0, 0.0]], covariances=[np.eye(3)])
    assert body.num_components == 1
    with pytest.raises(ValueError, match=r"made by hand .* Body\.fit\(robot\)"):
        body.save(tmp_path / "arm.json")
    assert not (tmp_path / "arm.json").exists()


def remove(name: str) -> Callable[[dict[str, Any]], object]:
    return lambda document: document.pop(name)


def in_link(name: str, value: object) -> Callable[[dict[str, Any]], object]:
    return lambda document: document["links"][1].__setitem__(name, value)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (remove("format"), 'its "format" is not'),
        (lambda d: d.update(format_version=3), "has format version 3, this sidestep reads versions 1, 2"),
        (remove("links"), "'links' is a required property"),
        (lambda d: d.update(links=[]), r"at \$\.links"),
        (lambda d: d["settings"].update(covariance="tied"), r"at \$\.settings\.covariance: 'tied'"),
        (in_link("means", [[float("nan"), 0.0, 0.0]]), "NaN is not a finite number"),
        (in_link("weights", [10**400, 1]), "10{198,200}….* is too large; what is not finite or beyond 1e.30"),
        (in_link("means", [[1e300, 0.0, 0.0]] * 2), r"1e\+300 is too large"),
        (
            in_link("weights", json.loads("[" * 900 + "]" * 900)),
            "nested more than 32 deep; at most 32 is allowed",
        ),
        (lambda d: d.update({"x" * 9999: 1}), r"at \$: Additional properties.*x…$"),
        (in_link("means", [[1.0, 2.0], [0.0, 0.0, 0.0]]), r"at \$\.links\[1\]\.means\[0\]"),
        (in_link("means", [[0.0, 0.0, 0.0]]), "2 weights, 1 means and 2 covariances"),
        (in_link("weights", [0.9, 0.9]), r"sum to 1\.8"),
        (in_link("covariances", [(-np.eye(3)).tolist()] * 2), "symmetric positive definite"),
        (in_link("link", "elbow"), "unknown link 'elbow'; links are"),
        (lambda d: d["links"].append(d["links"][0]), "a link appears twice"),
        (lambda d: d.update(comment="hello"), "'comment' was unexpected"),
    ],
)
def test_a_malformed_file_is_refused(
    change: Callable[[dict[str, Any]], object], message: str, planar: Robot, body: Body, tmp_path: Path
) -> None:
    path = tmp_path / "arm.json"
    body.save(path)
    document = json.loads(path.read_text())
    change(document)
    path.write_text(json.dumps(document))
    with pytest.raises(ValueError, match=message) as error:
        Body.load(path, planar)
    assert "arm.json" in str(error.value)


def test_files_that_are_no_body_are_refused(planar: Robot, tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError, match=r"absent\.json' does not exist"):
        Body.load(tmp_path / "absent.json", planar)
    for content, message in (
        ("{", "not valid JSON"),
        ("[]", "is not a body file"),
        ("[" * 100_000, "nested more than 32 deep; at most 32 is allowed"),
        ('{"a":' * 3000 + "1" + "}" * 3000, "nested more than 32 deep; at most 32 is allowed"),
        ("\x00\xff", "not valid JSON"),
    ):
        (tmp_path / "arm.json").write_bytes(content.encode("latin-1"))
        with pytest.raises(ValueError, match=message):
            Body.load(tmp_path / "arm.json", planar)


def test_the_cache_answers_the_second_time(planar: Robot, body: Body, cache_folder: Path) -> None:
    assert len(list((cache_folder / "bodies").iterdir())) == 1
    steps: list[int] = []
    again = Body.fit(planar, components=2, samples=SAMPLES, progress=lambda _, done, __: steps.append(done))
    assert equal(body, again)
    assert steps == []  # nothing was fitted


def test_the_cache_tells_settings_and_robots_apart(planar: Robot, body: Body, cache_folder: Path) -> None:
    Body.fit(planar, components=2, samples=SAMPLES, seed=1)
    Body.fit(planar, components=2, samples=SAMPLES, covariance="spherical")
    Body.fit(Robot.named("planar3"), components=2, samples=SAMPLES)
    assert len(list((cache_folder / "bodies").iterdir())) == 4


def test_a_fit_without_cache_leaves_none(planar: Robot, cache_folder: Path) -> None:
    Body.fit(planar, components=1, samples=SAMPLES, cache=False)
    assert not cache_folder.exists()


def test_a_spoiled_cache_entry_is_fitted_again(planar: Robot, body: Body) -> None:
    assert body.settings is not None
    path = fit_cache.cache_path(planar, body.settings)
    path.write_text(path.read_text()[:200])
    with pytest.warns(RuntimeWarning, match="cached body is unreadable and is fitted again"):
        again = Body.fit(planar, components=2, samples=SAMPLES)
    assert equal(body, again)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert equal(body, Body.fit(planar, components=2, samples=SAMPLES))  # the entry has been repaired


def test_a_cache_that_cannot_be_written_is_no_failure(
    planar: Robot, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "file").write_text("in the way of the folder")
    monkeypatch.setenv("SIDESTEP_CACHE_DIR", str(tmp_path / "file"))
    with pytest.warns(RuntimeWarning):
        assert Body.fit(planar, components=1, samples=SAMPLES).num_components >= 2


def test_a_body_serves_a_robot_whose_joints_are_locked_elsewhere() -> None:
    closed, opened = (Robot.named("panda", locked={"panda_finger_joint1": at}) for at in (0.0, 0.03))
    body = Body.fit(closed, components=1, samples=SAMPLES, cache=False)
    moved = body.for_robot(opened, source=closed)
    assert equal(moved, body)
    assert moved.fingerprint == opened.fingerprint != body.fingerprint
    with pytest.raises(ValueError, match="not to 'panda' as it is"):
        body.for_robot(closed, source=opened)
    with pytest.raises(ValueError, match="has no link 'panda_link0'"):
        body.for_robot(Robot.named("planar2"), source=closed)
