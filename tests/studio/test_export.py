"""What is taken away from the studio is what was there."""

from __future__ import annotations

import ast
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import sidestep as ss
from sidestep import Scenario
from sidestep.scenario import shipped_scenarios
from sidestep.scenario.assembly import assemble
from sidestep.scenario.scenario import (
    BodyConfig,
    EmbeddingConfig,
    JointLimitConfig,
    JointState,
    RobotConfig,
    StraightMove,
    SwitchConfig,
    SystemConfig,
)
from sidestep.studio import messages as m
from sidestep.studio.export import (
    not_kept,
    packed_scenario,
    save_scenario,
    scenario_now,
    unpacked_scenario,
)
from sidestep.studio.methods import METHODS
from sidestep.studio.parameters import Parameter
from sidestep.studio.scene_obstacle import CLOUD_LIMIT, CLOUD_RADIUS, box, cloud, scattered, thinned
from sidestep.studio.session import Session
from sidestep.studio.snippet import python_snippet
from sidestep.studio.systems import as_file, numbers_of
from sidestep.system import GeometricSystem
from sidestep.thesis.studio.methods import CUSTOM

SPRING = {"stiffness": 3.0, "damping": 2.0}
SMALL_ARM: dict[str, Any] = {
    "start": JointState("rad", (0.1, 0.2, 0.3)),
    "goal": JointState("rad", (0.5, 0.2, 0.3)),
}
POSE = np.array([0.4, -0.7])  # [rad] whose pose of the tip is a goal


def tuned(name: str) -> dict[str, Any]:
    """Every number of a method away from its default, with all its digits."""

    def other(p: Parameter) -> Any:
        if p.options:
            return next(option for option in p.options if option != p.default)
        assert isinstance(p.default, int | float)
        value = 1.0712345678901 * p.default or 0.0712345678901 * p.upper
        if not p.allows(value):  # the default is the largest
            value = 0.0712345678901 * p.upper
        return round(value) if p.whole else value

    return {p.name: other(p) for p in METHODS[name].parameters}


def recorded(session: Session, steps: int) -> list[tuple[Any, ...]]:
    """Of each step q, v, mass matrix and bias that are measured, obstacles that are seen, and the torque."""
    found: list[tuple[Any, ...]] = []
    step = session._adapter.step

    def spy(*told: Any) -> Any:
        found.append((*(np.copy(array) for array in told[:4]), told[4], step(*told)))
        return found[-1][-1]

    session._adapter.step = spy  # type: ignore[method-assign]
    for _ in range(steps):
        session.step()
    return found


@pytest.mark.parametrize("goal", ["configuration", "pose"])
@pytest.mark.parametrize("name", [name for name in METHODS if name not in ("geodesic_only", CUSTOM)])
def test_the_saved_file_and_the_snippet_move_the_arm_as_before(
    make_session: Callable[..., Session], scenario: Scenario, tmp_path: Path, name: str, goal: str
) -> None:
    """The first torques are the same to the last digit, and so is every number after loading."""
    session = make_session(scenario, method=name, numbers={name: tuned(name)})
    if goal == "pose":
        session.handle(m.SetPoseGoal(session.robot.pose(POSE, session.tip)))
    session.step()
    before = session.snapshot()
    session.handle(m.Restart())
    at_start = session.snapshot()
    motion = recorded(session, 40)
    expected = np.array([torque for *_, torque in motion])
    assert before.numbers[name] == tuned(name)
    assert np.abs(session.snapshot().v).max() > 0.01  # [rad/s] it does move

    controlled = METHODS[name].controlled
    loaded = Scenario.load(save_scenario(scenario_now(at_start, name="mine"), tmp_path))
    assert loaded.method == (name if controlled else "custom")
    again = make_session(loaded, method=numbers_of(loaded)[0])
    assert again.snapshot().method == name
    kept = tuned(name)
    if name == "thesis":
        kept["inner"] = METHODS[name].defaults["inner"]  # two joints have no inner ones
    assert again.snapshot().numbers[name] == kept
    # A rotation in degrees has lost its last digits, and with it the pose, but not the posture.
    np.testing.assert_array_equal([torque for *_, torque in recorded(again, 40)], expected)

    parts, code = assemble(loaded), python_snippet(at_start)
    run = parts.driver
    variables: dict[str, Any] = {}
    exec(code, variables)
    assert max(len(line) for line in code.splitlines() if "[" not in line) <= 100
    np.testing.assert_array_equal(variables["q"], at_start.q)
    controller, place = variables["controller"], variables.get("posture", variables["goal"])
    if controlled:
        variables["settings"].synchronous = True  # in this test: motions that repeat
        controller = ss.Controller(variables["arm"], variables["settings"])
        controller.set_goal(variables["goal"])
        controller.set_obstacles(motion[0][4])
    for k, (q, v, mass, bias, seen, torque) in enumerate(motion):
        np.testing.assert_array_equal(run.drive(k * session.period, q, v, mass, bias).torque, torque)
        if controlled:
            written = controller.step(q, v, mass, bias)
        else:
            step = variables["system"].acceleration(q, v, place, seen)
            written = controller.solve(q, v, step.acceleration, mass, bias)
        np.testing.assert_array_equal(written.torque, torque)


def test_the_thresholds_of_seven_joints_survive() -> None:
    numbers = tuned("thesis")
    state = JointState("rad", (0.0,) * 7)
    mine = Scenario("mine", RobotConfig("fr3"), state, state)
    mine = as_file(METHODS["thesis"], numbers, mine)
    assert numbers_of(mine) == ("thesis", numbers)
    # What no method of the page is exactly stays what the file says.
    for other in (
        replace(mine, body=replace(mine.body, components=7)),  # not on the list
        replace(mine, body=replace(mine.body, seed=1)),
        replace(mine, embedding=replace(mine.embedding, joint_limits=None)),
        replace(mine, controller={**mine.controller, "stop_time": 50.0}),  # out of its range
        replace(mine, system=replace(mine.system, stiffness=50.0)),  # out of its range
    ):
        assert numbers_of(other) == (CUSTOM, {})
    fall = replace(mine, system=SystemConfig(switch=SwitchConfig("geodesic_only")))
    own = {p.name: numbers[p.name] for p in METHODS["geodesic_only"].parameters}
    assert numbers_of(fall) == ("geodesic_only", own)


CLASSES = {  # of the snippet, by places in a scenario file
    "controller.barriers": "BarrierSettings",
    "controller.local_minimum": "LocalMinimumSettings",
    "controller.look_ahead": "LookAheadSettings",
    "controller.planner": "OnlinePlannerSettings",
    "controller.planner.search": "PlannerSettings",
    "controller.planner.route": "TimedPathSettings",
    "controller.arrival": "ArrivalSettings",
    "controller.safety": "SafetySettings",
    "system": "GeometricSystem",
    "embedding.joint_limits": "JointLimitPotential",
    "body": "fit",
}


@pytest.mark.parametrize("name", [name for name in METHODS if name != CUSTOM])
def test_every_number_is_in_the_file_and_in_the_snippet(
    make_session: Callable[..., Session], scenario: Scenario, tmp_path: Path, name: str
) -> None:
    numbers = tuned(name)
    snapshot = make_session(scenario, method=name, numbers={name: numbers}).snapshot()
    loaded = Scenario.load(save_scenario(scenario_now(snapshot, name="mine"), tmp_path))
    for parameter in METHODS[name].parameters:
        if parameter.place != "system.switch":  # its numbers are in a list, see the test above
            assert parameter.of(loaded) == numbers[parameter.name] != parameter.default
    code = python_snippet(snapshot)
    exec(code, {})
    given: dict[str, dict[str, Any]] = {}
    for call in ast.walk(ast.parse(code)):
        if isinstance(call, ast.Call) and isinstance(call.func, ast.Attribute | ast.Name):
            called = call.func.attr if isinstance(call.func, ast.Attribute) else call.func.id
            plain = [k for k in call.keywords if k.arg and isinstance(k.value, ast.Constant | ast.UnaryOp)]
            given[called] = {str(k.arg): ast.literal_eval(k.value) for k in plain}
    for parameter in METHODS[name].parameters:
        value = numbers[parameter.name]
        if parameter.name == "ellipsoids":
            assert given["cover"]["components"] == value
        elif parameter.name == "density":
            assert given["CollisionDensity"]["average"] == (value == "average")
        elif parameter.name == "combine":
            assert ("thesis.Sum(" in code) == (value == "sum")
        elif parameter.place == "controller":
            kind = "ControllerSettings" if METHODS[name].controlled else "MotionProgram"
            assert given[kind][parameter.field] == value
        elif parameter.place in CLASSES:
            assert given[CLASSES[parameter.place]][parameter.field] == value


@pytest.mark.parametrize("name", shipped_scenarios())
def test_a_shipped_scenario_is_saved_as_it_was_loaded(
    make_session: Callable[..., Session], tmp_path: Path, name: str
) -> None:
    shipped = Scenario.load(name)
    session = make_session(shipped, method=numbers_of(shipped)[0], ellipsoids=None)
    for _ in range(2):  # as it opens, and after a motion and a restart
        now = scenario_now(session.snapshot(), name=name)
        assert Scenario.load(save_scenario(now, tmp_path, replace=True)) == shipped
        for _ in range(20):
            session.step()
        session.handle(m.Restart())


STRANGE: dict[str, Any] = {
    "method": "custom",
    "body": BodyConfig(components=3, covariance="diagonal", seed=1),
    "embedding": EmbeddingConfig(
        density="average", joint_limits=JointLimitConfig(slope=20.0), combine="stack"
    ),
    "system": SystemConfig(stiffness=12.0, damping=0.3, damping_form="metric"),
}


def test_what_the_page_has_no_controls_for_moves_the_arm_and_is_kept(
    make_session: Callable[..., Session], scenario: Scenario, tmp_path: Path
) -> None:
    start = replace(scenario.start, velocity=(0.2, -0.1))
    strange = replace(scenario, start=start, **STRANGE)
    session = make_session(strange, method=numbers_of(strange)[0])
    session.step()
    parts = assemble(strange)
    assert isinstance(parts.mover, GeometricSystem)
    expected = parts.mover.acceleration(
        parts.start, parts.start_velocity, parts.goal, parts.seen
    ).acceleration
    np.testing.assert_array_equal(session._adapter._step.acceleration, expected)  # type: ignore[union-attr]
    variables: dict[str, Any] = {}
    exec(python_snippet(session.snapshot()), variables)
    again = variables["system"].acceleration(parts.start, parts.start_velocity, parts.goal, parts.seen)
    np.testing.assert_array_equal(again.acceleration, expected)
    for _ in range(50):
        session.step()
    now = session.snapshot()
    kept = Scenario.load(save_scenario(scenario_now(now, name="kept"), tmp_path))
    assert {key: getattr(kept, key) for key in STRANGE} == STRANGE
    np.testing.assert_allclose(kept.start.velocity, now.v, rtol=1e-12)  # type: ignore[arg-type]
    np.testing.assert_array_equal(make_session(kept, method=CUSTOM).snapshot().v, kept.start.velocity)


def test_numbers_beyond_their_sliders_are_kept_and_others_can_be_moved(
    make_session: Callable[..., Session], scenario: Scenario, tmp_path: Path
) -> None:
    stiff = replace(scenario, controller={"barriers": {"stiffness": 50.0}}, body=BodyConfig(ellipsoids=2))
    session = make_session(stiff)
    assert session.snapshot().numbers["controller"]["stiffness"] == 50.0
    kept = Scenario.load(save_scenario(scenario_now(session.snapshot(), name="kept"), tmp_path))
    assert (kept.controller, kept.body) == (stiff.controller, stiff.body)
    moved = {**session.snapshot().numbers["controller"], "damping": 5.0}
    session.handle(m.SetNumbers("controller", moved))
    assert session.snapshot().numbers["controller"] == moved
    with pytest.raises(ValueError, match=r"stiffness is 200.0, allowed: \[0.01, 100\]"):
        session.handle(m.SetNumbers("controller", {"stiffness": 200.0}))


def test_a_file_of_the_thesis_goes_on_with_the_controller(
    make_session: Callable[..., Session], scenario: Scenario, tmp_path: Path
) -> None:
    """Its mode and integrator are of runs without physics; what is saved can be run."""
    alone = replace(scenario.simulation, mode="kinematic", integrator="runge_kutta_4")
    session = make_session(replace(scenario, method="custom", simulation=alone), method="controller")
    for _ in range(20):  # its jerk is limited: the torque begins at none
        session.step()
    assert session.snapshot().torque_share > 0.0
    loaded = Scenario.load(save_scenario(scenario_now(session.snapshot(), name="mine"), tmp_path))
    assert (loaded.simulation.mode, loaded.simulation.integrator) == ("kinematic", "semi_implicit_euler")
    assert isinstance(assemble(loaded).mover, ss.Controller)


def test_obstacles_go_on_as_they_moved(
    make_session: Callable[..., Session], scenario: Scenario, tmp_path: Path
) -> None:
    ball = scenario.obstacles[0]
    move = StraightMove((-0.9, 0.3, 0.0), 0.1, 0.9)
    scripted = replace(ball, name="scripted", motion=move, position=(-0.9, 0.0, 0.0))
    drifting = replace(ball, name="drifting", velocity=(0.1, 0.0, 0.2), position=(-0.9, -0.4, 0.0))
    free = replace(ball, name="free", free=True, position=(-0.4, -0.9, 0.0))
    several = replace(scenario, obstacles=(ball, scripted, drifting, free))
    session = make_session(several, method="unswitched")
    session.handle(m.ThrowObstacle("ball", np.array([0.0, 0.3, 0.1])))
    for _ in range(400):
        session.step()
    assert not_kept(session.snapshot()) == ""
    session.handle(m.ThrowObstacle("free", np.array([0.2, 0.0, 0.0])))
    now = session.snapshot()
    assert not_kept(now) == "At rest in a file, as free obstacles are: free."
    loaded = Scenario.load(save_scenario(scenario_now(now, name="kept"), tmp_path))
    again = make_session(loaded, method="unswitched")
    for _ in range(700):
        session.step()
        again.step()
    moved = session.snapshot().poses - now.poses
    assert (np.linalg.norm(moved[:3, :3, 3], axis=1) > 0.1).all()
    # Degrees of a rotation lose a digit; the sums of the steps begin elsewhere.
    np.testing.assert_allclose(again.snapshot().poses[:3], session.snapshot().poses[:3], atol=1e-9)
    np.testing.assert_allclose(again.snapshot().poses[1][:3, 3], (-0.9, 0.3, 0.0), atol=1e-9)  # its end


def test_the_snippet_of_a_pose_holds_the_same_pose(
    make_session: Callable[..., Session], scenario: Scenario
) -> None:
    session = make_session(scenario)
    session.handle(m.SetPoseGoal(session.robot.pose(POSE, session.tip)))
    variables: dict[str, Any] = {}
    exec(python_snippet(session.snapshot()), variables)
    np.testing.assert_array_equal(variables["goal"].pose, session.snapshot().goal_pose)
    assert variables["goal"].frame == session.tip


def test_a_loaded_file_brings_its_method_a_shipped_scenario_leaves_it(
    make_session: Callable[..., Session], scenario: Scenario
) -> None:
    session = make_session(scenario, method="reactive", numbers={"reactive": SPRING})
    saved = scenario_now(session.snapshot(), name="mine")
    session.handle(m.SetMethod("unswitched"))
    session.handle(m.Load(saved))
    assert session.snapshot().method == "unswitched"
    session.handle(m.SetNumbers("reactive", {name: METHODS["reactive"].defaults[name] for name in SPRING}))
    session.handle(m.Load(saved, numbers_of(saved)[0]))
    last = session.snapshot()
    assert last.method == "reactive"
    assert last.numbers["reactive"] == {**METHODS["reactive"].defaults, **SPRING, "ellipsoids": 2}
    assert saved.body.ellipsoids == 2


def test_a_pose_goal_survives_saving_and_loading(
    make_session: Callable[..., Session], scenario: Scenario, tmp_path: Path
) -> None:
    session = make_session(replace(scenario, robot=RobotConfig(name="planar3"), **SMALL_ARM))
    aim = session.robot.pose(np.array([0.3, 0.5, -0.4]), session.tip)
    session.handle(m.SetPoseGoal(aim))
    assert session.snapshot().posture is None  # it is looked for in the next step
    session.step()
    session.handle(m.Restart())
    posture = session.snapshot().posture
    assert posture is not None
    assert posture.found
    loaded = Scenario.load(save_scenario(scenario_now(session.snapshot(), name="mine"), tmp_path))
    again = make_session(loaded).snapshot()
    assert again.goal is None
    assert again.goal_pose is not None
    np.testing.assert_allclose(again.goal_pose, aim, atol=1e-14)  # an angle in degrees loses a digit
    assert again.posture is not None
    np.testing.assert_array_equal(again.posture.q, posture.q)


def test_a_cloud_is_saved_beside_its_scenario(
    make_session: Callable[..., Session], scenario: Scenario, tmp_path: Path
) -> None:
    points = scattered(0.2, seed=1)
    source = tmp_path / "somewhere" / "cloud.npy"
    source.parent.mkdir()
    np.save(source, points)
    session = make_session(scenario)
    session.handle(m.AddObstacle(cloud("wall", np.array([-0.9, 0.0, 0.0]), source, 0.01)))
    assert len(session._obstacles()) == 1 + len(points)
    np.testing.assert_allclose(
        session._obstacles().points[1:], points + np.array([-0.9, 0.0, 0.0]), atol=1e-12
    )
    folder = tmp_path / "saved"
    folder.mkdir()
    now = scenario_now(session.snapshot(), name="mine")
    path = save_scenario(replace(now, folder=folder), folder)  # as of a studio that was started there
    assert Scenario.load(path).obstacles[1].shape.file == "mine-cloud.npy"
    path = save_scenario(now, folder, replace=True)
    source.unlink()
    loaded = Scenario.load(path)
    assert loaded.obstacles[1].shape.file == "mine-cloud.npy"
    np.testing.assert_array_equal(make_session(loaded).snapshot().things[1].cloud, points)


def test_a_download_is_complete_by_itself(
    make_session: Callable[..., Session], scenario: Scenario, tmp_path: Path
) -> None:
    """Two clouds of one file name, whose files are deleted afterwards, as when the studio ends."""
    session = make_session(scenario, method="unswitched")
    assert packed_scenario(scenario_now(session.snapshot(), name="mine"))[0] == "mine.yaml"
    points = [scattered(0.2, seed=seed) for seed in (1, 2)]
    for k, own in enumerate(points):
        source = tmp_path / f"folder{k}" / "cloud.npy"
        source.parent.mkdir()
        np.save(source, own)
        session.handle(m.AddObstacle(cloud(f"wall{k}", np.array([-0.9 - k, 0.0, 0.0]), source, 0.01)))
    now = session.snapshot()
    name, content = packed_scenario(scenario_now(now, name="mine"))
    assert name == "mine.zip"
    for k in range(2):
        (tmp_path / f"folder{k}" / "cloud.npy").unlink()
    place = tmp_path / "elsewhere"
    place.mkdir()
    loaded = unpacked_scenario(name, content, tmp_path, place)
    assert sorted(file.name for file in place.iterdir()) == [
        "mine-cloud-2.npy",
        "mine-cloud.npy",
        "mine.yaml",
    ]
    again = make_session(loaded, method="unswitched").snapshot()
    for k, own in enumerate(points):
        np.testing.assert_array_equal(again.things[1 + k].cloud, own)
    np.testing.assert_array_equal(again.poses, now.poses)
    assert packed_scenario(loaded)[1] == packed_scenario(loaded)[1]  # and it can be taken away again


def test_a_download_that_would_not_be_complete_is_refused(scenario: Scenario, tmp_path: Path) -> None:
    mine = replace(scenario, robot=RobotConfig(urdf="arm.urdf"), folder=tmp_path)
    with pytest.raises(ValueError, match=r"the robot is the file .*arm\.urdf, .* use Save"):
        packed_scenario(mine)


def test_an_upload_that_is_no_scenario_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"mine\.zip is not a zip file"):
        unpacked_scenario("mine.zip", b"no zip", tmp_path, tmp_path)
    with pytest.raises(ValueError, match=r"mine\.yaml: "):
        unpacked_scenario("mine.yaml", b"robot: 3", tmp_path, tmp_path)


def test_a_file_that_is_there_is_replaced_only_if_asked(scenario: Scenario, tmp_path: Path) -> None:
    mine = replace(scenario, name="mine")
    path = save_scenario(mine, tmp_path)
    other = replace(mine, description="another")
    with pytest.raises(FileExistsError, match=r"mine\.yaml exists"):
        save_scenario(other, tmp_path)
    assert Scenario.load(path).description == ""
    assert Scenario.load(save_scenario(other, tmp_path, replace=True)).description == "another"


@pytest.mark.parametrize("method", ["unswitched", "controller"])
def test_a_box_is_seen_as_a_run_sees_it(
    make_session: Callable[..., Session], scenario: Scenario, tmp_path: Path, method: str
) -> None:
    session = make_session(scenario, method=method)
    session.handle(m.AddObstacle(box("crate", np.array([0.5, 0.5, 0.0]), np.full(3, 0.1))))
    seen = session._obstacles()
    run = assemble(Scenario.load(save_scenario(scenario_now(session.snapshot(), name="mine"), tmp_path))).seen
    order = [np.lexsort(np.array(o.points).T) for o in (seen, run)]
    np.testing.assert_allclose(np.array(seen.points)[order[0]], np.array(run.points)[order[1]], atol=1e-12)
    np.testing.assert_array_equal(np.array(seen.radii)[order[0]], np.array(run.radii)[order[1]])
    assert len(seen.points) > 20


def test_a_large_cloud_is_thinned() -> None:
    points = np.random.default_rng(0).uniform(0.0, 1.0, (5000, 3))
    thin, radius = thinned(points)
    assert 0.3 * CLOUD_LIMIT < len(thin) <= CLOUD_LIMIT
    away = np.linalg.norm(points[:, None] - thin[None], axis=2).min(axis=1)
    assert 0.5 * radius < away.max() <= radius  # balls of that radius hold every point
    few, radius = thinned(points[:100])
    np.testing.assert_array_equal(few, points[:100])
    assert radius == CLOUD_RADIUS
