"""The simulation behind the page, without a page."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import trimesh

from sidestep import ExactClearance, Robot, Scenario
from sidestep.math.pose import pose_at
from sidestep.robot import tip_of
from sidestep.scenario.runner import run_scenario
from sidestep.scenario.scenario import RobotConfig
from sidestep.studio import messages as m
from sidestep.studio.adapter import ControllerAdapter
from sidestep.studio.clearance_monitor import solid_poses
from sidestep.studio.export import save_scenario, scenario_now
from sidestep.studio.page.arm import link_meshes, short_names
from sidestep.studio.page.camera import RIGHT
from sidestep.studio.scene_obstacle import ball, box
from sidestep.studio.session import Session
from sidestep.studio.simulated_scene import DRAG_ACCELERATION, DRAG_SPEED
from sidestep.studio.start import BEND, ends, scenario_of, starting_scenario

MakeSession = Callable[..., Session]


def run(session: Session, seconds: float) -> m.Snapshot:
    for _ in range(round(seconds / session.period)):
        session.step()
    return session.snapshot()


def record(session: Session, seconds: float) -> tuple[m.Snapshot, float]:
    """Runs and measures the smallest exact clearance on the way."""
    session.handle(m.SetRecording(True))
    last = run(session, seconds)
    things = last.things
    exact = ExactClearance(session.robot, [solid for thing in things for solid in thing.solids])
    poses = np.array([solid_poses(things, row.poses) for row in last.rows])
    worst = exact.decided_minimum(np.array([row.q for row in last.rows]), poses)
    return last, worst.clearance.distance


@pytest.mark.slow
@pytest.mark.parametrize("begin", [0.05, 0.2, 0.35, 0.5, 0.6, 0.75])
def test_a_ball_drawn_into_the_way_is_not_touched(
    make_session: MakeSession, scenario: Scenario, begin: float
) -> None:
    session = make_session(scenario)
    q = session.stage.state()[0]
    session.handle(m.SetJointGoal(q + np.array([1.0, 0.0])))
    run(session, begin)
    ball = session.stage.actors[0]
    place = ball.pose.copy()
    place[:3, 3] -= 0.3 * RIGHT  # onto the circle of the tip
    session.handle(m.DragObstacle(ball.thing.name, place))
    last, clearance = record(session, 3.0)
    assert clearance > 0.0
    assert last.touched == 0
    np.testing.assert_allclose(last.poses[0][:3, 3], place[:3, 3], atol=1e-3)


@pytest.mark.slow
def test_the_arm_arrives_past_the_ball(make_session: MakeSession, scenario: Scenario) -> None:
    session = make_session(scenario)
    last, clearance = record(session, 9.0)  # [s] with a way around by a sub-goal
    assert last.goal is not None
    assert np.abs(last.q - last.goal).max() < 0.05  # [rad] the project's definition of arriving
    assert clearance > 0.0
    assert last.touched == 0
    assert last.words == "arrived"
    assert last.status == "ok, arrived"
    assert last.time == pytest.approx(9.0, abs=1e-9)


def test_a_ball_drawn_into_the_arm_at_rest_does_not_touch_it(
    make_session: MakeSession, scenario: Scenario
) -> None:
    session = make_session(scenario)
    run(session, 0.2)
    here = session.stage.state()[0]
    session.handle(m.SetJointGoal(here))
    tip = session.robot.pose(here, session.tip)[:3, 3]
    session.handle(m.DragObstacle("ball", pose_at(tip)))
    last, clearance = record(session, 3.0)
    moved = np.abs(last.q - here).max()
    assert clearance > 0.0
    assert moved > 0.06  # [rad] it yields: the ball of 6 cm takes the place of the tip, one metre out
    assert last.touched == 0
    np.testing.assert_allclose(
        last.poses[0][:3, 3], tip, atol=1e-3
    )  # where it was drawn to, within a millimetre


def test_a_drawn_ball_moves_as_a_hand_does(make_session: MakeSession, scenario: Scenario) -> None:
    session = make_session(scenario, method="unswitched")
    place = session.snapshot().poses[0][:3, 3] + np.array([0.4, 0.3, 0.0])
    session.handle(m.DragObstacle("ball", pose_at(place)))
    velocities = [np.zeros(3)]
    for _ in range(1500):
        session.step()
        velocities.append(session.snapshot().velocities[0])
    speeds = np.linalg.norm(velocities, axis=1)
    changes = np.linalg.norm(np.diff(velocities, axis=0), axis=1)
    assert 0.9 < speeds.max() <= DRAG_SPEED + 1e-9
    at_rest = 10.0 * DRAG_ACCELERATION * session.period  # what is left when it is put in its place
    assert changes.max() <= at_rest + 1e-9
    assert np.median(changes[:200]) == pytest.approx(DRAG_ACCELERATION * session.period, rel=1e-6)
    np.testing.assert_allclose(session.snapshot().poses[0][:3, 3], place, atol=1e-12)
    assert speeds[-1] == 0.0


def test_a_ball_drawn_while_paused_is_put_there_and_what_is_said_follows(
    make_session: MakeSession, scenario: Scenario
) -> None:
    session = make_session(scenario, method="reactive")
    before = run(session, 0.2)
    session.handle(m.SetRunning(False))
    beside = session.robot.pose(before.q, session.tip)[:3, 3] + np.array([0.0, -0.10, 0.0])
    session.handle(m.DragObstacle("ball", pose_at(beside)))
    now = session.snapshot()
    np.testing.assert_array_equal(now.poses[0], pose_at(beside))
    np.testing.assert_array_equal(now.velocities, np.zeros((1, 3)))
    assert now.time == before.time
    exact = ExactClearance(session.robot, [solid for thing in now.things for solid in thing.solids])
    truth = exact.distance(now.q, solid_poses(now.things, now.poses)).distance
    # A covering body is larger than the arm, by a centimetre or two with few ellipsoids.
    assert truth - 0.03 < now.nearest[1] < truth < 0.05
    session.handle(m.DragObstacle("ball", pose_at(session.robot.pose(before.q, session.tip)[:3, 3])))
    assert session.snapshot().contacts == ("link2 - ball",)
    session.handle(m.DragObstacle("ball", before.poses[0]))
    np.testing.assert_array_equal(run(session, 0.1).poses[0], before.poses[0])  # and stays there


def test_a_free_ball_drawn_while_paused_stays_at_rest(make_session: MakeSession, scenario: Scenario) -> None:
    free = replace(scenario, obstacles=(replace(scenario.obstacles[0], free=True),))
    session = make_session(free, method="unswitched")
    session.handle(m.SetRunning(False))
    session.handle(m.DragObstacle("ball", pose_at([-0.7, 0.2, 0.1])))
    np.testing.assert_allclose(run(session, 0.1).poses[0], pose_at([-0.7, 0.2, 0.1]), atol=1e-12)


def test_restart_and_loading_end_a_recording(make_session: MakeSession, scenario: Scenario) -> None:
    for command in (m.Restart(), m.Load(replace(scenario_of(RobotConfig(name="planar3")), obstacles=()))):
        session = make_session(scenario, method="unswitched")
        session.handle(m.SetRecording(True))
        for _ in range(100):
            session.step()
        session.handle(command)
        after = run(session, 0.1)
        assert not after.recording
        np.testing.assert_allclose([row.time for row in after.rows], 0.005 * np.arange(1, 21), atol=1e-12)
        assert {len(row.q) for row in after.rows} == {2}  # none of the other arm


def test_a_thrown_ball_flies_straight_and_is_told_to_the_controller(
    make_session: MakeSession, scenario: Scenario
) -> None:
    session = make_session(scenario)
    start = session.snapshot().poses[0][:3, 3].copy()
    velocity = np.array([0.5, 0.2, 0.1])
    session.handle(m.ThrowObstacle("ball", velocity))
    last = run(session, 0.4)
    np.testing.assert_allclose(last.poses[0][:3, 3], start + 0.4 * velocity, atol=1e-9)  # sums of 400 steps
    np.testing.assert_array_equal(last.velocities[0], velocity)
    np.testing.assert_array_equal(session._obstacles().velocities[0], velocity)


def test_things_come_and_go_while_the_arm_moves(make_session: MakeSession, scenario: Scenario) -> None:
    session = make_session(scenario)
    before = run(session, 0.5)
    session.handle(m.AddObstacle(box("crate", np.array([-0.8, 0.0, 0.0]), np.array([0.1, 0.2, 0.3]))))
    session.handle(m.AddObstacle(ball("second", np.array([0.0, -0.9, 0.0]), 0.05)))
    after = session.snapshot()
    np.testing.assert_array_equal(after.q, before.q)
    np.testing.assert_array_equal(after.v, before.v)
    assert [thing.name for thing in after.things] == ["ball", "crate", "second"]
    assert after.edition == before.edition + 2
    with pytest.raises(ValueError, match="two obstacles are called 'second'"):
        session.handle(m.AddObstacle(ball("second", np.zeros(3), 0.05)))
    session.handle(m.RemoveObstacle("crate"))
    assert [thing.name for thing in run(session, 0.1).things] == ["ball", "second"]
    with pytest.raises(ValueError, match="no obstacle 'crate'; there are: ball, second"):
        session.handle(m.RemoveObstacle("crate"))


def test_a_pose_goal_is_reached(make_session: MakeSession) -> None:
    session = make_session(replace(scenario_of(RobotConfig(name="planar3")), obstacles=()))
    aim = session.robot.pose(np.array([0.3, 0.5, -0.4]), session.tip)
    session.handle(m.SetPoseGoal(aim))
    last = run(session, 5.0)
    assert last.goal is None
    # as to a configuration, e(t) = (1 + 2 t) exp(-2 t), 0.0005 after 5 s; of at most 1 m or rad
    np.testing.assert_allclose(session.robot.pose(last.q, session.tip), aim, atol=1e-3)


def test_a_pose_out_of_reach_is_approached_and_said(make_session: MakeSession, scenario: Scenario) -> None:
    session = make_session(replace(scenario, obstacles=()))
    aim = session.robot.pose(np.array([0.3, 0.0]), session.tip)
    aim[:2, 3] *= 1.2  # the arm of one metre is stretched already
    session.handle(m.SetPoseGoal(aim))
    last = run(session, 6.0)
    tip = session.robot.pose(last.q, session.tip)
    np.testing.assert_allclose(tip[:3, 3], aim[:3, 3] / 1.2, atol=0.01)  # [m] e(t) = (1 + 2 t) exp(-2 t)
    np.testing.assert_allclose(tip[:3, :3], aim[:3, :3], atol=0.01)
    assert last.words == ("the goal is out of reach: nearest posture 200 mm and 0° away; the arm is there")
    assert last.status == "ok, blocked"
    assert last.posture is not None
    assert not last.posture.found


@pytest.mark.slow
@pytest.mark.parametrize("method", ["controller", "barrier", "reactive"])
def test_a_goal_that_is_itself_blocked_is_said_and_the_arm_rests(
    make_session: MakeSession, scenario: Scenario, method: str
) -> None:
    session = make_session(scenario, method=method)
    goal = session.stage.state()[0] + np.array([1.0, 0.0])
    session.handle(m.SetJointGoal(goal))
    session.handle(m.DragObstacle("ball", session.robot.pose(goal, session.tip)))
    last = run(session, 6.0)
    found = re.fullmatch(
        r"at the goal 'link2' is (\d+) mm deep in 'ball'; it goes on when that is free", last.words
    )
    assert found is not None
    assert int(found[1]) > 50  # [mm] the ball's radius and more
    assert last.status == "limited, blocked"
    again = run(session, 3.0)
    np.testing.assert_allclose(again.q, last.q, atol=0.02)  # [rad] no sub-goals: none leads anywhere
    assert again.touched == 0
    session.handle(m.DragObstacle("ball", pose_at([-0.9, 0.0, 0.0])))
    assert run(session, 8.0).words == "arrived"


def test_methods_and_numbers_change_while_it_runs(make_session: MakeSession, scenario: Scenario) -> None:
    session = make_session(scenario)
    assert len(run(session, 0.1).values) > 1  # one coordinate per barrier
    session.handle(m.SetMethod("unswitched"))
    assert len(run(session, 0.1).values) == 1  # one density
    session.handle(m.SetNumbers("unswitched", {"stiffness": 4.0}))
    assert session._adapter.system.stiffness[0, 0] == 4.0
    session.handle(m.SetMethod("controller"))
    assert session._adapter.system.stiffness[0, 0] == session.snapshot().numbers["controller"]["stiffness"]
    assert session.snapshot().numbers["unswitched"]["stiffness"] == 4.0
    with pytest.raises(ValueError, match=r"controller: activation is 9.0, allowed: \[0.01, 1\]"):
        session.handle(m.SetNumbers("controller", {"activation": 9.0}))
    with pytest.raises(ValueError, match="no method is called 'magic'; known: controller, "):
        session.handle(m.SetMethod("magic"))


def test_an_arm_stays_at_its_goal(make_session: MakeSession, scenario: Scenario) -> None:
    """What is left of the way no longer shrinks there: that is no dead end. One that is held on its way says so."""
    session = make_session(replace(scenario, obstacles=()), method="barrier")
    goal = session.snapshot().q + 1e-3
    session.handle(m.SetJointGoal(goal))
    friction = session.stage.end
    session.stage.end = lambda torque: friction(0.0 * torque)  # type: ignore[method-assign]  # it stands still
    for _ in range(3000):
        session.step()
        assert not session.snapshot().words.startswith("leaving")
    session.handle(m.SetJointGoal(goal + 0.5))
    assert "that nothing explains" in run(session, 0.7).words
    session.stage.end = friction  # type: ignore[method-assign]  # let go, and another goal: it goes on
    session.handle(m.SetJointGoal(goal + 0.4))
    assert "that nothing explains" not in run(session, 0.7).words


COMING = """\
format: 1
name: coming
method: controller
robot: {name: planar2}
start: {unit: rad, position: [-2.9, 0.0]}
goal: {unit: rad, position: [-2.9, 0.0]}
body: {ellipsoids: 2}
obstacles:
  - {name: ball, shape: {type: sphere, radius: 0.1}, position: [-0.5, -1.1, 0.0], velocity: [0, 0.5, 0]}
simulation: {mode: torque, period: 0.002, duration: 5.0}
"""  # it presses the arm against the limit of joint 1


@pytest.mark.slow
@pytest.mark.parametrize("drawn", [False, True])
@pytest.mark.parametrize("method", ["controller", "barrier", "reactive"])
def test_an_arm_steps_out_of_the_way_of_what_comes(
    make_session: MakeSession, method: str, drawn: bool
) -> None:
    """But not without looking ahead. It does so as well while its goal is drawn about."""
    session, words = make_session(Scenario.from_text(COMING), method=method), set()
    for k in range(2000):
        if drawn and k % 25 == 0:
            session.handle(m.SetJointGoal(np.array([-2.9, 0.0]) + 1e-4 * (k % 7)))
        session.step()
        if k % 50 == 0:
            words.add(session.snapshot().words)
    looks = method != "reactive"
    assert (session.snapshot().touched == 0) == looks
    assert ("avoiding a moving obstacle" in words) == looks


def test_after_a_restart_it_does_not_step_aside_yet(make_session: MakeSession) -> None:
    session = make_session(Scenario.from_text(COMING))
    for _ in range(2000):
        session.step()
        if session.snapshot().words.startswith("avoiding a moving obstacle"):
            break
    else:
        raise AssertionError("it did not step aside")
    session.handle(m.Restart())
    session.step()
    assert session.snapshot().words == "arrived"


def test_the_controller_is_told_of_what_moves_otherwise_than_it_was_told(
    make_session: MakeSession, scenario: Scenario
) -> None:
    session = make_session(scenario)
    told: list[object] = []
    adapter = session._adapter
    assert isinstance(adapter, ControllerAdapter)

    def counted(seconds: float) -> int:
        before = len(told)
        for _ in range(round(seconds / session.period)):
            known = adapter._told
            session.step()
            if adapter._told is not known:
                told.append(adapter._told)
        return len(told) - before

    assert counted(0.2) == 1
    session.handle(m.ThrowObstacle("ball", np.array([0.0, 0.3, 0.1])))
    assert counted(0.2) == 1  # it flies on as it was told
    place = session.snapshot().poses[0] @ pose_at([0.2, 0.0, 0.0])
    session.handle(m.DragObstacle("ball", place))
    assert 20 < counted(1.0) < 1000  # it speeds up, slows down, and rests
    assert counted(0.2) == 0


def test_a_goal_outside_the_limits_is_refused(make_session: MakeSession, scenario: Scenario) -> None:
    session = make_session(scenario)
    goal = session.snapshot().goal
    with pytest.raises(ValueError, match=r"goal: joint 'joint1' is 9\.0 rad, allowed"):
        session.handle(m.SetJointGoal(np.array([9.0, 0.0])))
    np.testing.assert_array_equal(session.snapshot().goal, goal)


def test_restart_puts_everything_back(make_session: MakeSession, scenario: Scenario) -> None:
    session = make_session(scenario)
    first = session.snapshot()
    session.handle(m.ThrowObstacle("ball", np.array([0.0, 0.0, 1.0])))
    run(session, 0.3)
    session.handle(m.Restart())
    again = session.snapshot()
    assert again.time == 0.0
    np.testing.assert_array_equal(again.q, first.q)
    np.testing.assert_array_equal(again.poses, first.poses)
    np.testing.assert_array_equal(again.velocities, np.zeros((1, 3)))
    assert again.running
    session.handle(m.Restart(until=0.0))
    assert not session.running


@pytest.mark.parametrize("method", ["controller", "barrier", "thesis"])
def test_the_studio_moves_the_arm_as_a_run_does_and_again_after_a_restart(
    make_session: MakeSession, scenario: Scenario, method: str
) -> None:
    session = make_session(scenario, method=method)
    saved = scenario_now(session.snapshot(), name="same")
    short = replace(saved.simulation, duration=1.0)
    expected = run_scenario(replace(saved, simulation=short)).run.q
    assert np.abs(expected[-1] - expected[0]).max() > 0.2  # [rad]
    for _ in range(2):
        q = []
        for _ in range(len(expected)):
            q.append(session.stage.state()[0])
            session.step()
        np.testing.assert_array_equal(q, expected)
        session.handle(m.Restart())


def test_what_is_saved_is_what_is_there(
    make_session: MakeSession, scenario: Scenario, tmp_path: object
) -> None:
    session = make_session(scenario)
    session.handle(m.AddObstacle(box("crate", np.array([-0.8, 0.1, 0.2]), np.array([0.1, 0.2, 0.3]))))
    session.handle(m.ThrowObstacle("ball", np.array([0.1, 0.0, 0.3])))
    last = run(session, 0.5)
    now = scenario_now(last, name="kept")
    file = tmp_path / "kept.yaml"  # type: ignore[operator]
    now.save(file)
    again = make_session(Scenario.load(file)).snapshot()
    np.testing.assert_array_equal(again.q, last.q)
    np.testing.assert_array_equal(again.goal, last.goal)
    np.testing.assert_allclose(again.poses, last.poses, atol=1e-15)  # an angle in degrees loses a digit
    assert [thing.obstacle.shape for thing in again.things] == [thing.obstacle.shape for thing in last.things]


def test_the_thesis_is_told_of_centres_and_barriers_of_balls(make_session: MakeSession) -> None:
    scenario = Scenario.load("planar-one-obstacle")
    bare = replace(scenario, obstacles=tuple(replace(item, points="centre") for item in scenario.obstacles))
    session = make_session(bare, method="unswitched")
    assert session._obstacles().radii[0] == 0.0
    session.handle(m.SetMethod("controller"))
    assert session._obstacles().radii[0] == bare.obstacles[0].shape.radius


def test_an_arm_begins_above_its_base() -> None:
    for name in ("planar2", "ur5", "fr3"):
        robot = Robot.named(name)
        for q in ends(robot):
            assert min(robot.pose(q, frame.name)[2, 3] for frame in robot.frames) >= -1e-9
            assert abs(q[1] - robot.neutral[1]) == pytest.approx(BEND, abs=1e-12)


def test_the_tip_is_the_last_link_of_the_last_joint(make_session: MakeSession, scenario: Scenario) -> None:
    assert tip_of(make_session(scenario).robot) == "tip"


def test_a_density_does_not_tell_what_is_in_the_way(make_session: MakeSession, scenario: Scenario) -> None:
    session = make_session(scenario, method="unswitched")
    here = session.stage.state()[0]
    tip = session.robot.pose(here, session.tip)[:3, 3]
    session.handle(m.AddObstacle(ball("second", tip + np.array([-0.1, 0.15, 0.0]), 0.03)))
    session.handle(m.SetJointGoal(here + np.array([1.0, 0.0])))
    words = run(session, 0.3).words
    assert words == "the arm slides along an obstacle or a limit (a density does not tell which)"


def test_a_diagnosis_names_links_and_obstacles(make_session: MakeSession, scenario: Scenario) -> None:
    session = make_session(scenario, method="reactive")
    here = session.stage.state()[0]
    session.handle(m.SetJointGoal(here))
    middle = session.robot.pose(here + np.array([0.5, 0.0]), session.tip)[:3, 3]
    session.handle(m.DragObstacle("ball", pose_at(0.8 * middle)))
    run(session, 1.5)
    session.handle(m.SetJointGoal(here + np.array([1.0, 0.0])))
    words = run(session, 3.0).words
    assert words.startswith("stuck ")
    assert re.search(r": link2 against 'ball', \d+ mm away$", words)


URDF = """<robot name="two">{links}
  <joint name="two_joint_a" type="revolute"><parent link="base"/><child link="upper"/><axis xyz="0 0 1"/>
    <limit lower="-2" upper="2" effort="50" velocity="3"/></joint>
  <joint name="two_joint_b" type="revolute"><parent link="upper"/><child link="lower"/><origin xyz="0.4 0 0"/>
    <axis xyz="0 0 1"/><limit lower="-2" upper="2" effort="50" velocity="3"/></joint>
</robot>"""
LINK = """
  <link name="{name}"><inertial><origin xyz="0.2 0 0"/><mass value="1"/>
    <inertia ixx="0.01" ixy="0" ixz="0" iyy="0.02" iyz="0" izz="0.02"/></inertial>
    <visual><geometry><mesh filename="package://two/bar.stl"/></geometry></visual>
    <collision><geometry><mesh filename="package://two/bar.stl"/></geometry></collision></link>"""


def test_a_robot_of_a_urdf_with_meshes_moves_and_is_saved_with_them(
    make_session: MakeSession, tmp_path: Path
) -> None:
    (tmp_path / "two").mkdir()
    bar = trimesh.creation.box((0.4, 0.05, 0.05), pose_at([0.2, 0.0, 0.0]))
    bar.export(tmp_path / "two" / "bar.stl")
    links = "".join(LINK.format(name=name) for name in ("upper", "lower"))
    file = tmp_path / "two" / "two.urdf"
    file.write_text(URDF.format(links='<link name="base"/>' + links), encoding="utf-8")
    scenario = replace(starting_scenario(urdf=file, package_dirs=[tmp_path]), obstacles=())
    session = make_session(
        scenario, method="unswitched", numbers={"unswitched": {"stiffness": 4.0, "damping": 4.0}}
    )
    meshes = link_meshes(session.robot)
    assert {name: mesh.bounds[1].tolist() for name, mesh in meshes.items()} == {
        name: pytest.approx([0.4, 0.025, 0.025], abs=1e-6)  # of an STL in single precision
        for name in ("upper", "lower")
    }
    assert short_names(session.robot.coordinate_names) == ["a", "b"]
    last = run(session, 5.0)
    assert last.goal is not None
    assert np.abs(last.q - last.goal).max() < 0.05  # [rad] counts as arrived
    again = Scenario.load(save_scenario(scenario_now(last, name="two"), tmp_path))
    np.testing.assert_array_equal(make_session(again, method="unswitched").snapshot().q, last.q)
