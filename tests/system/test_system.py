"""The geometric system's parts, modes, damping forms and settings against NumPy."""

from collections.abc import Callable

import numpy as np
import pytest

import sidestep as ss
from sidestep import thesis
from sidestep._core import StepStatus
from sidestep.system import Embedding, GeometricSystem
from support.random_scene import ROBOTS, Scene, State, scene

STIFFNESS, DAMPING = 2.0, 1.2
# The same formulas in another order, relative to the larger of h and g.
EXACT = 1e-9


def solve(jacobian: np.ndarray, x: np.ndarray) -> np.ndarray:
    """G^-1 x by the singular vectors of J, which keeps every direction's digits."""
    _, singular, rows = np.linalg.svd(jacobian, full_matrices=True)
    factors = np.ones(len(x))
    factors[: len(singular)] += singular**2
    return rows.T @ ((rows @ x) / factors)


def parts(
    case: Scene, state: State, embeddings: list[Embedding], form: str
) -> tuple[np.ndarray, np.ndarray, float]:
    """h, g and psi."""
    evaluations = [e.evaluate(state.q, state.v, state.obstacles) for e in embeddings]
    J = np.vstack([e.jacobian for e in evaluations])
    c = np.concatenate([e.curvatures for e in evaluations])
    spring = STIFFNESS * (state.q - case.robot.neutral)
    damping = DAMPING * state.v
    h = -solve(J, spring) - damping if form == "plain" else -solve(J, spring + damping)
    return h, thesis.geodesic_acceleration(J, c), sum(float(e.values.sum()) for e in evaluations)


def embeddings_of(case: Scene) -> list[Embedding]:
    return [thesis.CollisionDensity(case.robot, case.body), thesis.JointLimitPotential(case.robot, slope=4.0)]


def distances(case: Scene, state: State) -> np.ndarray:
    """T6.1: smallest distance between points and means, for what each joint carries directly."""
    result = np.full(case.robot.num_coordinates, np.inf)
    frames = {frame.name: frame for frame in case.robot.frames}
    for link, mean in zip(case.body.links, case.body.means, strict=True):
        joint = frames[link].joint
        if joint >= 0:
            pose = case.robot.pose(state.q, link)
            to_points = state.obstacles.points - (pose[:3, 3] + pose[:3, :3] @ mean)
            i = case.robot.joints[joint].coordinate
            result[i] = min(result[i], (np.linalg.norm(to_points, axis=1) - state.obstacles.radii).min())
    return result


def sigmoid(u: np.ndarray | float) -> np.ndarray | float:
    with np.errstate(over="ignore"):
        return 1.0 / (1.0 + np.exp(-u))


SWITCHES = ["unswitched", "harmonic", "geodesic", "binary", "sigmoid", "distance"]


def make(kind: str, psi: float, nv: int) -> thesis.Unswitched:
    """A switch of each kind whose threshold is near the state's psi, so that weights are of every size."""
    return {
        "unswitched": thesis.Unswitched(),
        "harmonic": thesis.HarmonicOnly(),
        "geodesic": thesis.GeodesicOnly(),
        "binary": thesis.BinarySwitch(psi),
        "sigmoid": thesis.SigmoidSwitch(0.8 * psi, 5.0 / (psi + 1.0)),
        "distance": thesis.DistanceSwitch(np.linspace(0.05, 0.4, nv), 12.0),
    }[kind]


@pytest.mark.slow
@pytest.mark.parametrize("kind", SWITCHES)
@pytest.mark.parametrize("name", ROBOTS)
def test_every_mode_and_damping_form(name: str, kind: str) -> None:
    case = scene(name)
    nv = case.robot.num_coordinates
    embeddings = embeddings_of(case)
    threshold = float(np.median([state.psi for state in case.states]))
    switch = make(kind, threshold, nv)
    systems = {
        form: GeometricSystem(
            embeddings, stiffness=STIFFNESS, damping=DAMPING, damping_form=form, switch=switch
        )
        for form in ("plain", "metric")
    }
    seen = []
    for state in case.states:
        for form, system in systems.items():
            step = system.acceleration(state.q, state.v, case.robot.neutral, state.obstacles)
            h, g, psi = parts(case, state, embeddings, form)
            match kind:
                case "unswitched" | "harmonic":
                    weights = np.ones(nv)
                case "geodesic":
                    weights = np.zeros(nv)
                case "binary":
                    weights = np.full(nv, float(psi <= threshold))
                case "sigmoid":
                    weights = np.full(nv, 1.0 - sigmoid(5.0 / (threshold + 1.0) * (psi - 0.8 * threshold)))
                case "distance":
                    weights = sigmoid(12.0 * (distances(case, state) - np.linspace(0.05, 0.4, nv)))
            a = h + g if kind == "unswitched" else weights * h + (1.0 - weights) * g
            scale = max(1.0, np.abs(h).max(), np.abs(g).max())
            assert step.status == StepStatus.ok
            np.testing.assert_allclose(step.harmonic, h, rtol=0, atol=EXACT * scale)
            np.testing.assert_allclose(step.geodesic, g, rtol=0, atol=EXACT * scale)
            np.testing.assert_allclose(step.switch, weights, rtol=0, atol=EXACT)
            np.testing.assert_allclose(step.acceleration, a, rtol=0, atol=2 * EXACT * scale)
            np.testing.assert_allclose(step.metric, thesis.metric_matrix(step.jacobian), rtol=1e-13)
            assert step.values.sum() == pytest.approx(psi, rel=1e-13)
            seen += list(weights)
    if kind in ("binary", "sigmoid", "distance"):
        # the comparison means nothing if every weight is 0 or every weight is 1
        assert min(seen) < 0.2
        assert max(seen) > 0.8


def test_a_binary_switch_is_harmonic_up_to_and_including_its_threshold() -> None:
    case = scene("fr3")
    state = case.states[0]
    density = thesis.CollisionDensity(case.robot, case.body)
    psi = float(density.evaluate(state.q, state.v, state.obstacles).values[0])
    for threshold, weight in ((psi, 1.0), (np.nextafter(psi, 0.0), 0.0)):
        system = GeometricSystem([density], switch=thesis.BinarySwitch(threshold))
        step = system.acceleration(state.q, state.v, case.robot.neutral, state.obstacles)
        assert (step.switch == weight).all()


def test_flat_space_is_a_damped_spring() -> None:
    robot = ss.Robot.named("fr3")
    rng = np.random.default_rng(0)
    K, D = (a @ a.T for a in rng.normal(size=(2, 7, 7)))
    for form in ("plain", "metric"):
        system = GeometricSystem([], robot=robot, stiffness=K, damping=D, damping_form=form)
        assert system.num_embedding_coordinates == 0
        for _ in range(50):
            q, v = robot.random_configuration(rng), rng.normal(size=7)
            goal = robot.random_configuration(rng)
            step = system.acceleration(q, v, goal, ss.Obstacles.none())
            expected = -K @ (q - goal) - D @ v
            # two products of 7 terms
            np.testing.assert_allclose(step.acceleration, expected, rtol=1e-12, atol=1e-12)
            assert np.array_equal(step.metric, np.eye(7))
            assert not step.geodesic.any()


def test_gains_are_scalars_diagonals_or_matrices() -> None:
    robot = ss.Robot.named("planar3")
    system = GeometricSystem([], robot=robot, stiffness=2.0, damping=[1.0, 2.0, 3.0])
    assert np.array_equal(system.stiffness, 2.0 * np.eye(3))
    assert np.array_equal(system.damping, np.diag([1.0, 2.0, 3.0]))
    assert system.damping_form == thesis.DampingForm.plain
    assert isinstance(system.switch, thesis.Unswitched)


def test_no_geodesic_term_at_rest() -> None:
    for name in ("fr3", "ur5", "planar2"):
        case = scene(name)
        system = GeometricSystem(embeddings_of(case), switch=thesis.GeodesicOnly())
        for state in case.states:
            rest = np.zeros_like(state.q)
            step = system.acceleration(state.q, rest, case.robot.neutral, state.at_rest())
            assert not step.geodesic.any()
            # an obstacle that moves changes the space under a resting arm: errata 11
            step = system.acceleration(state.q, rest, case.robot.neutral, state.obstacles)
            assert step.geodesic.any() == (state.psi > 0.0)


def test_the_geodesic_term_is_quadratic_in_velocity() -> None:
    case = scene("fr3")
    system = GeometricSystem(embeddings_of(case), switch=thesis.GeodesicOnly())
    for state in case.states:
        once, back, twice = (
            system.acceleration(state.q, f * state.v, case.robot.neutral, state.at_rest()).acceleration
            for f in (1.0, -1.0, 2.0)
        )
        # every product has a factor of v twice, and factors of -1 and 2 are exact
        np.testing.assert_allclose(back, once, rtol=1e-13)
        np.testing.assert_allclose(twice, 4.0 * once, rtol=1e-13)


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        (lambda: {"stiffness": -1.0}, "stiffness must be finite, symmetric and positive semi-definite"),
        (lambda: {"damping": [1.0, np.nan]}, "damping must be finite, symmetric and positive semi-definite"),
        (
            lambda: {"damping": [[1.0, 0.5], [0.0, 1.0]]},
            "damping must be finite, symmetric and positive semi-definite",
        ),
        (
            lambda: {"stiffness": [[1.0, 2.0], [2.0, 1.0]]},
            "stiffness must be finite, symmetric and positive semi-",
        ),
        (lambda: {"stiffness": np.eye(3)}, r"stiffness has shape \(3, 3\), expected \(2, 2\)"),
        (lambda: {"damping": [1.0, 1.0, 1.0]}, r"damping has shape \(3,\), expected \(2,\)"),
        (lambda: {"damping_form": "strong"}, "damping_form is 'strong', must be one of: plain, metric"),
        (lambda: {"switch": thesis.BinarySwitch(np.nan)}, "switch threshold must be finite"),
        (
            lambda: {"switch": thesis.SigmoidSwitch(1.0, 0.0)},
            "switch slope is 0.0*, must be finite and positive",
        ),
        (lambda: {"switch": thesis.SigmoidSwitch(np.inf, 1.0)}, "switch threshold must be finite"),
        (
            lambda: {"switch": thesis.DistanceSwitch([0.1], 1.0)},
            "switch thresholds: expected 2 finite values, got 1",
        ),
        (
            lambda: {"switch": thesis.DistanceSwitch([0.1, np.nan], 1.0)},
            "switch thresholds: expected 2 finite values",
        ),
        (
            lambda: {"switch": thesis.DistanceSwitch([0.1, 0.1], -1.0)},
            "switch slope is -1.0*, must be finite and positive",
        ),
    ],
)
def test_a_bad_setting_is_named(settings: Callable[[], dict], message: str) -> None:
    case = scene("planar2")
    with pytest.raises(ValueError, match=message):
        GeometricSystem([thesis.CollisionDensity(case.robot, case.body)], **settings())


def test_embeddings_must_fit_the_system() -> None:
    case = scene("planar2")
    limits = thesis.JointLimitPotential(case.robot)
    other = thesis.JointLimitPotential(ss.Robot.named("planar3"))
    with pytest.raises(ValueError, match="an embedding was made for robot 'planar3', not for 'planar2'"):
        GeometricSystem([limits, other])
    with pytest.raises(ValueError, match="a distance switch needs an embedding with a body, such as"):
        GeometricSystem([limits], switch=thesis.DistanceSwitch([0.1, 0.1], 1.0))
    with pytest.raises(ValueError, match="give either embeddings, which know their robot, or an empty list"):
        GeometricSystem([])
    with pytest.raises(ValueError, match="give either embeddings, which know their robot, or an empty list"):
        GeometricSystem([limits], robot=case.robot)
