"""Noise models of depth cameras against their equations."""

from __future__ import annotations

import numpy as np
import pytest

from sidestep.simulation import D435, DepthNoiseModel, Kinect, StructuredLight, TriangulationNoise
from sidestep.simulation.depth_effects import correlated, hidden
from sidestep.simulation.depth_noise import NOISES, noise_model

FX = 425.0
SHAPE = (480, 848)
QUIET = {"missing": 0.0, "bleeding": 0.0, "flying": 0.0, "holes": 0.0}
QUIETENED = [D435(**QUIET), Kinect(**QUIET), StructuredLight(**QUIET)]


def _rng(seed: int = 0) -> np.random.Generator:
    return np.random.default_rng(seed)


def _wall(depth: float) -> np.ndarray:
    return np.full(SHAPE, depth, dtype=np.float32)


def _slope(nearest: float, farthest: float) -> np.ndarray:
    """Depth that grows from the top row to the bottom row: all phases of the steps occur."""
    return np.repeat(np.linspace(nearest, farthest, SHAPE[0], dtype=np.float32)[:, None], SHAPE[1], axis=1)


def _step(near: float, far: float, *, columns: slice) -> np.ndarray:
    depth = _wall(far)
    depth[:, columns] = near
    return depth


@pytest.mark.parametrize("model", QUIETENED, ids=lambda model: type(model).__name__)
@pytest.mark.parametrize("z", [0.6, 1.0, 2.0, 2.8])
def test_error_is_that_of_the_formula(model: TriangulationNoise, z: float) -> None:
    true = _slope(z - 0.08, z + 0.08)
    measured = model.apply(true, FX, _rng())
    seen = measured > 0.0
    assert seen[:, 100:].all()
    ratio = (measured[seen] - true[seen]) / model.deviation(true[seen], FX)
    # 400,000 pixels, of which 25 share a window: 0.6 % of deviation; 2 % where the slope crosses few steps
    assert np.sqrt(np.mean(ratio**2)) == pytest.approx(1.0, abs=0.03)
    assert abs(ratio.mean()) < 0.05


def test_deviation_of_the_d435() -> None:
    # z^2 s / (f b) with s = 0.08 pixel, f = 425 pixel, b = 50 mm at 2 m: 15 mm
    assert D435().deviation(2.0, FX) == pytest.approx(4.0 * 0.08 / (425.0 * 0.05), rel=1e-12)
    assert D435(sigma=0.1).deviation(2.0, FX) == pytest.approx(0.01882, rel=1e-3)


def test_deviation_and_steps_of_the_kinect_are_those_of_khoshelham() -> None:
    kinect = Kinect(**QUIET)
    z = np.array([0.5, 1.0, 3.0, 5.0])
    for fx in (300.0, 580.0):  # of the image that is wanted: the sensor measures with its own
        np.testing.assert_allclose(kinect.deviation(z, fx), 1.425e-3 * z**2, rtol=1e-12)
    levels = np.unique(kinect.apply(_wall(4.8), FX, _rng()))
    levels = levels[levels > 0.0]
    # neighbouring levels are 2.85e-3 z^2 apart: 7 cm at 5 m
    np.testing.assert_allclose(np.diff(levels), 2.85e-3 * levels[:-1] * levels[1:], rtol=1e-3)


@pytest.mark.parametrize(("model", "step"), [(D435(), 1 / 32), (Kinect(), 1 / 8), (StructuredLight(), 1 / 8)])
def test_disparities_are_whole_steps(model: TriangulationNoise, step: float) -> None:
    measured = model.apply(_slope(0.6, 2.5), FX, _rng())
    inside = measured[measured > 0.0].astype(float)
    steps = (model.focal or FX) * model.baseline / inside / step
    # single precision: 1e-7 of up to 2,300 steps
    assert np.abs(steps - np.rint(steps)).max() < 1e-3
    assert len(np.unique(np.rint(steps))) > 20


@pytest.mark.parametrize("window", [1, 3, 5])
def test_noise_is_correlated_by_the_share_of_a_common_window(window: int) -> None:
    field = correlated(SHAPE, window, _rng())
    assert field.std() == pytest.approx(1.0, abs=0.03)
    for lag in range(1, 7):
        for one, other in ((field[:, lag:], field[:, :-lag]), (field[lag:], field[:-lag])):
            expected = max(0.0, 1.0 - lag / window)
            assert np.mean(one * other) == pytest.approx(expected, abs=0.03)


def test_noise_of_two_images_is_independent() -> None:
    one, other = (D435().apply(_wall(1.0), FX, _rng(seed)) for seed in (1, 2))
    both = (one > 0.0) & (other > 0.0)
    assert abs(np.corrcoef(one[both], other[both])[0, 1]) < 0.05


@pytest.mark.parametrize("model", [model() for model in NOISES.values()], ids=list(NOISES))
def test_the_same_seed_gives_the_same_image(model: DepthNoiseModel) -> None:
    true = _step(0.7, 1.5, columns=slice(300, 500))
    untouched = true.copy()
    first = model.apply(true, FX, _rng(7))
    np.testing.assert_array_equal(first, model.apply(true, FX, _rng(7)))
    np.testing.assert_array_equal(true, untouched)
    assert first.dtype == np.float32
    assert first is not true


@pytest.mark.parametrize("model", QUIETENED, ids=lambda model: type(model).__name__)
def test_the_shadow_is_left_of_what_is_near(model: TriangulationNoise) -> None:
    near, far = 0.8, 2.0
    measured = model.apply(_step(near, far, columns=slice(300, 500)), FX, _rng())
    missing = measured[240] == 0.0
    width = FX * model.baseline * (1.0 / near - 1.0 / far)
    shadow = np.flatnonzero(missing[200:600]) + 200
    assert shadow.max() == 299
    assert len(shadow) == shadow.max() - shadow.min() + 1
    assert len(shadow) == pytest.approx(width, abs=1.01)  # whole pixels


def test_a_pole_hides_no_more_than_its_own_width() -> None:
    # disparities 21.25 / 0.5 = 42.5 and 21.25 / 2 = 10.6: the pole of 8 pixels at 400 hides 8 pixels 32 further left
    mask = hidden(_step(0.5, 2.0, columns=slice(400, 408)), 21.25, border=False)
    columns = np.flatnonzero(mask[100])
    assert columns.min() == pytest.approx(400 - 31.9, abs=1.0)
    assert len(columns) == pytest.approx(8, abs=1)


def test_smooth_surfaces_hide_nothing() -> None:
    v, u = np.mgrid[: SHAPE[0], : SHAPE[1]]
    for sign in (-1.0, 1.0):  # planes that turn away from either camera
        plane = (1.0 / (0.8 + sign * 0.0009 * (u - 424.0) + 0.0003 * (v - 240.0))).astype(np.float32)
        assert not hidden(plane, 21.25, border=False).any()


def test_a_stereo_camera_is_blind_at_its_left_border() -> None:
    measured = D435(**QUIET).apply(_wall(0.5), FX, _rng())
    blind = np.flatnonzero(measured[100] == 0.0)
    assert blind.tolist() == list(
        range(42)
    )  # f b / z = 42.5 pixels; a pixel reaches half a pixel to its left
    assert (StructuredLight(**QUIET).apply(_wall(0.5), FX, _rng()) > 0.0).all()


@pytest.mark.parametrize("model", [D435(holes=0.0), Kinect(holes=0.0), StructuredLight(holes=0.0)])
def test_flying_pixels_are_at_edges_and_between_near_and_far(model: TriangulationNoise) -> None:
    near, far = 0.8, 1.6
    measured = model.apply(_step(near, far, columns=slice(300, 500)), FX, _rng())
    margin = 6.0 * float(model.deviation(far, FX))
    flying = (measured > near + margin) & (measured < far - margin)
    columns = np.flatnonzero(flying.any(axis=0))
    assert set(columns) <= {*range(500 - model.reach, 500 + model.reach), *range(300, 300 + model.reach)}
    # right edge: half of the pixels drawn lie beyond it at most, and the margin cuts what is near either surface
    share = flying[:, 500 - model.reach : 500 + model.reach].mean()
    assert 0.1 * model.flying < share < 0.5 * model.flying
    assert (measured[measured > 0.0] > near - margin).all()
    assert measured.max() < far + margin
    at_edge = measured[:, 500 - model.reach : 500 + model.reach] == 0.0
    assert at_edge.mean() == pytest.approx(model.missing, abs=0.06)  # 960 to 1,920 pixels: 1.6 %


def test_bleeding_widens_what_is_near() -> None:
    measured = D435(bleeding=1.0, missing=0.0, flying=0.0, holes=0.0).apply(
        _step(0.8, 1.6, columns=slice(300, 500)), FX, _rng()
    )
    # pixel 500 draws from columns 498 to 502, two of which are near; pixel 501 from 499 to 503, one of which is
    for column, share in ((500, 0.4), (501, 0.2), (502, 0.0)):
        assert (measured[:, column] < 1.2).mean() == pytest.approx(share, abs=0.09)  # 480 rows: 2.2 %


def test_holes_have_the_share_that_is_set() -> None:
    model = StructuredLight(holes=0.02)
    missing = [(model.apply(_wall(1.0), FX, _rng(seed)) == 0.0).mean() for seed in range(10)]
    assert np.mean(missing) == pytest.approx(0.02, rel=0.15)  # some 400 patches an image


@pytest.mark.parametrize(("degrees", "seen"), [(70.0, True), (77.0, True), (83.0, False)])
def test_structured_light_does_not_measure_flat_surfaces(degrees: float, seen: bool) -> None:
    # a plane through (0, 0, 1), turned about the camera's y axis: z = 1 / (1 - tan(angle) x), x = (u - 424) / fx
    x = (np.arange(400, 448, dtype=np.float32) - 424.0) / FX
    row = 1.0 / (1.0 - np.tan(np.radians(degrees)) * x)
    depth = np.repeat(row[None].astype(np.float32), 100, axis=0)
    measured = StructuredLight(**QUIET).apply(depth, FX, _rng())
    middle = measured[:, 22:26] > 0.0
    assert middle.all() if seen else not middle.any()


@pytest.mark.parametrize(("model", "ends"), [(D435(), (0.28, 10.0)), (Kinect(), (0.5, 5.0))])
def test_nothing_is_measured_outside_the_range(model: TriangulationNoise, ends: tuple[float, float]) -> None:
    near, far = ends
    for z in (0.9 * near, 1.4 * far):
        assert (model.apply(_wall(z), FX, _rng()) == 0.0).mean() > 0.99
    measured = model.apply(_slope(0.5 * near, 1.2 * far), FX, _rng())
    assert measured[measured > 0.0].min() >= near
    assert measured.max() <= far
    assert (model.apply(np.zeros(SHAPE, np.float32), FX, _rng()) == 0.0).all()


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"sigma": 0.0}, "sigma is 0.0"),
        ({"step": 1.0}, "step is 1.0, allowed: at most"),
        ({"near": 20.0}, "near is 20.0 and far is 10.0"),
        ({"missing": 0.9}, "together at most 1"),
        ({"holes": -0.1}, "allowed: 0 to 1"),
        ({"steepest": 3.0}, "steepest is 3.0"),
        ({"focal": -1.0}, "focal is -1.0"),
        ({"reach": 0}, "reach is 0"),
    ],
)
def test_values_outside_their_range_are_named(values: dict[str, float], words: str) -> None:
    with pytest.raises(ValueError, match=words):
        D435(**values)


def test_an_unknown_noise_is_named() -> None:
    with pytest.raises(ValueError, match="noise is 'lidar', allowed: none, d435, kinect, structured_light"):
        noise_model("lidar")
    mine = D435(sigma=0.1)
    assert noise_model(mine) is mine
