"""Running a scenario, end to end."""

import math
from dataclasses import replace

import numpy as np
import pytest

from sidestep.distance import sweep
from sidestep.scenario import Scenario, run_scenario, runner
from sidestep.scenario.assembly import assemble

# Without obstacles the system is e'' = -0.5 e - 1.5 e', so e(t) = e0 (2 exp(-t/2) - exp(-t)). With e0 = 1 it
# passes 0.05 where exp(-t/2) = 1 - sqrt(0.95).
FREE = """\
format: 1
name: free
robot: {{name: planar2}}
start: {{unit: rad, position: [0, 0.5]}}
goal: {{unit: rad, position: [1, 0.5]}}
body: {{components: 1}}
simulation: {{mode: {mode}, period: {period}, duration: 12.0}}
"""
TIME_TO_GOAL = -2.0 * math.log(1.0 - math.sqrt(0.95))


@pytest.fixture(autouse=True)
def _own_cache(tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SIDESTEP_CACHE_DIR", str(tmp_path_factory.getbasetemp() / "bodies"))


@pytest.mark.parametrize("mode", ["kinematic", "torque"])
def test_the_free_motion_arrives_when_the_solution_in_closed_form_does(mode: str) -> None:
    period = 0.005
    result = run_scenario(Scenario.from_text(FREE.format(mode=mode, period=period)))
    document = result.to_document()
    assert document["success"] is document["reached"] is True
    # semi-implicit Euler is of first order: its time is off by less than two periods here
    assert document["time_to_goal_s"] == pytest.approx(TIME_TO_GOAL, abs=2 * period)
    assert document["position_error_rad"] < 0.05
    assert document["min_clearance_m"] is None
    assert (
        document["path_deviation_rad"] < 1e-6
    )  # straight: rounding, and the tolerance of the torque program
    if mode == "torque":
        assert document["contacts"] == 0
        assert (
            document["max_tracking_error"] < 1e-6
        )  # tolerance of the program; the physics has the same model
        assert 0.0 < document["max_torque_ratio"] < 1.0
    else:
        assert document["contacts"] is document["max_torque_ratio"] is document["max_tracking_error"] is None


@pytest.mark.parametrize("mode", ["kinematic", "torque"])
@pytest.mark.parametrize("method", ["custom", "controller"])
def test_a_start_a_rounding_error_outside_its_limits_runs_and_breaks_none(mode: str, method: str) -> None:
    text = FREE.format(mode=mode, period=0.002).replace("body: {components: 1}", f"method: {method}")
    document = run_scenario(Scenario.from_text(text.replace("[0, 0.5]", "[3.1420, 0.5]"))).to_document()
    assert document["reached"] is True
    assert document["limits"]["position"] == 0
    if mode == "kinematic":  # the weak motor of joint 2 cannot hold it while joint 1 comes in
        assert document["success"] is True


@pytest.mark.parametrize("integrator", ["semi_implicit_euler", "second_order", "runge_kutta_4"])
def test_every_integrator_can_be_chosen(integrator: str) -> None:
    text = FREE.format(mode="kinematic", period=0.01).replace(
        "duration", f"integrator: {integrator}, duration"
    )
    document = run_scenario(Scenario.from_text(text)).to_document()
    # two periods for the schemes of first order, one (the grid) for the fourth
    bound = 0.01 if integrator == "runge_kutta_4" else 0.02
    assert document["time_to_goal_s"] == pytest.approx(TIME_TO_GOAL, abs=bound)


def test_a_start_velocity_is_used() -> None:
    # e0 = 1 and e'(0) = -0.5 leave the slow mode alone: e = exp(-t/2), which passes 0.05 at 2 log 20
    text = FREE.format(mode="kinematic", period=0.005).replace(
        "[0, 0.5]}", "[0, 0.5], velocity: [0.5, 0]}", 1
    )
    document = run_scenario(Scenario.from_text(text)).to_document()
    assert document["time_to_goal_s"] == pytest.approx(2.0 * math.log(20.0), abs=0.02)  # first order


def test_a_run_that_ends_too_early_fails_and_says_so() -> None:
    text = FREE.format(mode="kinematic", period=0.005).replace("12.0", "1.0")
    result = run_scenario(Scenario.from_text(text))
    assert not result.success
    assert not result.to_document()["reached"]
    assert result.evaluation.position_error_rad == pytest.approx(
        2.0 * math.exp(-0.5) - math.exp(-1.0), abs=0.01
    )  # first order in the period of 0.005 s
    assert "does not reach" in result.sentence()


def test_a_run_that_diverges_is_judged_and_said_in_short(monkeypatch: pytest.MonkeyPatch) -> None:
    """A spring far too stiff for the period: the joints turn more often than anyone can check for clearance."""
    monkeypatch.setattr(sweep, "FINE_CHECKS", 1_000)  # this much sooner it is given up
    text = FREE.format(mode="kinematic", period=0.005).replace("12.0", "1.0")
    text += "system: {stiffness: 1.0e+12, switch: {type: harmonic_only}}\n"
    text += "obstacles: [{name: ball, shape: {type: sphere, radius: 0.03}, position: [0.0, 0.0, 0.8]}]\n"
    result = run_scenario(Scenario.from_text(text))
    assert not result.success
    assert result.evaluation.position_error_rad > 1e6
    assert not result.evaluation.collision_free  # 0.73 m apart at every angle, but no check can say so
    assert len(result.sentence()) < 300


def test_hitting_a_free_ball_is_seen_by_physics_and_by_exact_clearance() -> None:
    text = (
        FREE.format(mode="torque", period=0.002).replace("[0, 0.5]", "[0, 0]").replace("[1, 0.5]", "[1, 0]")
    )
    text += "system: {switch: {type: harmonic_only}}\n"
    ball = "{name: ball, free: true, shape: {type: sphere, radius: 0.03}, position: [0.8, 0.4, 0.0]}"
    text += f"obstacles: [{ball}]\n"
    result = run_scenario(Scenario.from_text(text))
    document = result.to_document()
    assert not result.success
    assert document["contacts"] > 0
    assert document["contact_pairs"] == ["link2 - ball"]
    assert document["moved_objects"]["ball"] > 0.01
    assert "touches on the way" in result.sentence()
    assert "pushes ball away" in result.sentence()


@pytest.mark.slow
@pytest.mark.parametrize("name", ["planar-one-obstacle", "planar-several", "planar-drop"])
def test_planar_scenarios_go_around(name: str) -> None:
    result = run_scenario(Scenario.load(name))
    assert result.success, result.sentence()
    assert result.evaluation.min_clearance_m is not None
    assert result.evaluation.min_clearance_m > 0.003  # [m] as measured when they were made, less a safe part
    assert result.evaluation.path_deviation_rad > 0.1  # the straight path would have hit


POSE = """
format: 1
name: pose
method: {method}
robot: {{name: planar3}}
start: {{unit: rad, position: [0.2, 0.3, 0.4]}}
goal: {{frame: tip, position: [{x}, 0.6, 0.0], rotation_deg: [0, 0, 90]}}
body: {{ellipsoids: 2}}
simulation: {{mode: {mode}, duration: {duration}}}
"""


@pytest.mark.parametrize(
    ("method", "mode"),
    [("barrier", "torque"), ("barrier", "kinematic"), ("controller", "torque"), ("controller", "kinematic")],
)
def test_a_pose_is_reached(method: str, mode: str) -> None:
    result = run_scenario(Scenario.from_text(POSE.format(method=method, mode=mode, x=0.5, duration=6.0)))
    document = result.to_document()
    assert result.success, result.sentence()
    assert document["position_error_rad"] is None
    assert document["pose_distance_m"] < 0.01
    assert document["pose_angle_rad"] < 0.05
    np.testing.assert_allclose(
        result.run.robot.pose(result.run.q[-1], "tip")[:3, 3], [0.5, 0.6, 0.0], atol=0.01
    )
    assert (
        document["time_to_goal_s"] < 5.0
    )  # stiffness 4, damping 4: e(t) = (1 + 2 t) exp(-2 t), 1 mm after 5 s


def test_a_pose_out_of_reach_is_said() -> None:
    result = run_scenario(
        Scenario.from_text(POSE.format(method="barrier", mode="kinematic", x=2.0, duration=2.0))
    )
    assert not result.success
    assert "mm and" in result.sentence()
    assert "from the goal, which it does not reach" in result.sentence()
    assert (result.stop or "").startswith("the goal is out of reach: nearest posture ")


@pytest.mark.slow
@pytest.mark.parametrize("name", ["thesis-6.2.2", "thesis-6.2.3", "thesis-6.2.4"])
def test_the_thesis_s_scenarios_arrive_by_the_barriers(name: str) -> None:
    result = run_scenario(replace(Scenario.load(name), method="barrier"))
    evaluation = result.evaluation
    assert evaluation.reached
    assert evaluation.contacts == 0
    assert not evaluation.moved_objects
    assert not evaluation.limits.any
    if name == "thesis-6.2.2":
        assert evaluation.min_clearance_m is None  # nothing is in the way
    else:
        assert evaluation.min_clearance_m is not None
        assert evaluation.min_clearance_m > 0.01


@pytest.mark.slow
@pytest.mark.parametrize("mode", ["kinematic", "torque"])
@pytest.mark.parametrize(
    "how",
    [
        "velocity: [0, 0.4, 0]",
        "velocity: [0, 0.5, 0]",
        "velocity: [0, 0.6, 0]",
        "motion: {to: [-0.5, 1.4, 0], begin: 0.0, end: 5.0}",
    ],
)
def test_an_arm_steps_out_of_the_way_of_what_moves(mode: str, how: str) -> None:
    """A ball presses the arm against a joint's limit, unless it looks ahead."""
    text = f"""\
format: 1
name: aside
method: barrier
robot: {{name: planar2}}
start: {{unit: rad, position: [-2.89, 0.0]}}
goal: {{unit: rad, position: [-2.9, 0.0]}}
obstacles:
  - {{shape: {{type: sphere, radius: 0.1}}, position: [-0.5, -1.1, 0.0], {how}}}
simulation: {{mode: {mode}, period: 0.002, duration: 4.0, tolerance: 1.0e-7}}
"""  # it has not arrived before the ball comes; in torque mode its torques give less than its acceleration limits
    scenario = Scenario.from_text(text)
    aside = run_scenario(scenario).evaluation
    assert aside.collision_free
    run = runner._run
    first, second = (run(scenario, assemble(scenario), None).q for _ in range(2))
    np.testing.assert_array_equal(first, second)
    pressed = run_scenario(replace(scenario, method="reactive")).evaluation
    assert not pressed.collision_free
