"""The controller: every part together, with commands that are safe whatever it is told."""

import re
import subprocess
import sys
import threading

import numpy as np
import pytest

import sidestep as ss
from sidestep import _core
from sidestep.bench.methods import barrier_system
from sidestep.control import MotionProgram
from sidestep.controller import BarrierSettings, OnlinePlannerSettings, controller_settings_fields
from sidestep.distance import SelfCollision
from sidestep.obstacles import obstacles_from_shapes, pose_at
from sidestep.system import ClearanceBarrier

PERIOD = 0.001


@pytest.fixture(scope="module")
def robot() -> ss.Robot:
    return ss.Robot.named("fr3")


@pytest.fixture(scope="module")
def arm(robot: ss.Robot) -> ss.Arm:
    return ss.Arm.from_robot(robot)


def settings(**values: object) -> ss.ControllerSettings:
    return ss.ControllerSettings(**{"synchronous": True, "output": "acceleration"} | values)


def balls(seed: int, num: int = 5) -> ss.Obstacles:
    points = np.random.default_rng(seed).uniform([-0.2, -0.6, 0.2], [0.7, 0.6, 0.9], (num, 3))
    return ss.Obstacles(points, [0.05] * num)


def test_a_motion_repeats_bit_for_bit(robot: ss.Robot, arm: ss.Arm) -> None:
    goal = robot.random_configuration(np.random.default_rng(3))
    runs = []
    for _ in range(2):
        controller = ss.Controller(arm, settings())
        controller.set_goal(goal)
        controller.set_obstacles(balls(1))
        runs.append(ss.integrate(controller, robot.neutral, np.zeros(7), steps=2000).q)
    np.testing.assert_array_equal(*runs)


def test_it_arrives_and_says_so(robot: ss.Robot, arm: ss.Arm) -> None:
    goal = robot.random_configuration(np.random.default_rng(0))
    controller = ss.Controller(arm, settings())
    controller.set_obstacles(ss.Obstacles.none())
    controller.set_goal(goal)
    assert controller.step(robot.neutral, np.zeros(7)).activity == ss.Activity.moving
    motion = ss.integrate(controller, robot.neutral, np.zeros(7), steps=8000)
    assert motion.activities[-1] == ss.Activity.arrived
    assert np.abs(motion.last_q - goal).max() < 0.01
    assert controller.explain() == "arrived"


def test_clearances_bound_commands_without_a_goal(robot: ss.Robot, arm: ss.Arm) -> None:
    """A ball comes at the hand by 0.1 m/s; nobody gave a goal."""
    q = robot.neutral
    hand = robot.pose(q, "fr3_hand")[:3, 3]
    controller = ss.Controller(arm, settings())
    ball = ss.Obstacles([hand + np.array([0.3, 0.0, 0.0])], [0.05], [[-0.1, 0.0, 0.0]])
    controller.set_obstacles(ball, valid_for=np.inf)
    motion = ss.integrate(controller, q, np.zeros(7), steps=4500)
    assert set(motion.activities) == {ss.Activity.no_goal}
    assert ss.SafetyStatus.clearance_lost not in motion.statuses
    assert motion.clearance.min() > 0.0


def test_a_goal_that_is_refused_leaves_the_one_before(robot: ss.Robot, arm: ss.Arm) -> None:
    controller = ss.Controller(arm, settings())
    controller.set_obstacles(ss.Obstacles.none())
    controller.set_goal(robot.neutral)
    controller.step(robot.neutral, np.zeros(7))
    outside = robot.neutral.copy()
    outside[3] = 1.0
    with pytest.raises(ValueError, match=r"joint 'fr3_joint4' is 1\.0+, allowed: -"):
        controller.set_goal(outside)
    lost = robot.neutral.copy()
    lost[4] = np.nan
    with pytest.raises(ValueError, match=r"position of joint 'fr3_joint5' is nan, allowed: finite numbers"):
        controller.set_goal(lost)
    other = ss.Robot.named("panda")
    pose = ss.PoseGoal(other, "panda_hand", other.pose(other.neutral, "panda_hand"))
    with pytest.raises(ValueError, match=r"frame 'panda_hand' is made for another robot than 'fr3'"):
        controller.set_goal(pose)
    assert controller.step(robot.neutral, np.zeros(7)).activity == ss.Activity.arrived


@pytest.mark.parametrize("output", ["acceleration", "position", "torque"])
@pytest.mark.parametrize("excess", [1e-6, 1e-3])
def test_a_start_a_rounding_error_outside_its_limits_is_taken_in(
    robot: ss.Robot, arm: ss.Arm, output: str, excess: float
) -> None:
    """Behind a wall, so that the planner searches."""
    q = robot.neutral.copy()
    q[3], q[5] = robot.limits.upper[3] + excess, robot.limits.lower[5] - excess
    goal = robot.neutral + np.array([1.5, 0.2, 0.0, 0.3, 0.0, 0.2, 0.0])
    controller = ss.Controller(arm, settings(output=output))
    hand = robot.pose(q + 0.5 * (goal - q), "fr3_hand")[:3, 3]
    wall = [hand + np.array([0.0, 0.0, z]) for z in (-0.2, -0.1, 0.0, 0.1, 0.2)]
    controller.set_obstacles(ss.Obstacles(wall, [0.05] * 5))
    controller.set_goal(goal)
    motion = ss.integrate(controller, q, np.zeros(7), steps=8000, goal=goal, tolerance=0.01)
    assert motion.arrived
    assert controller.plan.status == _core.PlanStatus.found
    outside = np.maximum(motion.q - robot.limits.upper, robot.limits.lower - motion.q).max(axis=1)
    # It comes in at once and for good; a torque takes a moment to turn it, by less than a micrometre of a 1 m arm.
    assert (np.diff(outside[outside > 0.0]) < 1e-6).all()
    assert (outside[100:] <= 0.0).all()
    assert ss.SafetyStatus.stopping not in motion.statuses


def test_goals_and_trajectories_a_rounding_error_outside_end_at_the_limit(
    robot: ss.Robot, arm: ss.Arm
) -> None:
    start, goal = robot.neutral.copy(), robot.neutral.copy()
    start[3] = robot.limits.upper[3] - 0.1
    goal[3] = robot.limits.upper[3] + 9e-4
    controller = ss.Controller(arm, settings())
    controller.set_obstacles(ss.Obstacles.none())
    controller.set_goal(goal)
    motion = ss.integrate(controller, start, np.zeros(7), steps=4000)
    assert controller.target[3] == robot.limits.upper[3]
    assert motion.activities[-1] == ss.Activity.arrived
    controller.set_trajectory(np.array([start, goal]), [0.0, 1.0])
    with pytest.raises(ValueError, match="joint 'fr3_joint4' is"):
        controller.set_goal(goal + 2e-4)
    with pytest.raises(ValueError, match="joint 'fr3_joint4' of sample 0 is"):
        controller.set_trajectory(np.array([goal + 2e-4, start]), [0.0, 1.0])


@pytest.mark.parametrize("planner", [True, False])
@pytest.mark.parametrize(
    "goal",
    [
        [-1.41897612, -3.09546332, 0.91512722],  # less deep than what the planner allows at ends
        [-1.8764439, 3.0660147, 1.62216081],
    ],
)
def test_a_goal_in_self_collision_is_said_to_be_so(goal: list[float], planner: bool) -> None:
    arm = ss.Arm.load("planar3")
    controller = ss.Controller(arm, settings() if planner else settings(planner=None))
    controller.set_obstacles(ss.Obstacles.none())
    controller.set_goal(goal)
    motion = ss.integrate(controller, arm.neutral, np.zeros(3), steps=6000)
    assert motion.activities[-1] == ss.Activity.blocked
    assert ss.SafetyStatus.clearance_lost not in motion.statuses
    said = r"at the goal links 'link1' and 'link3' touch, \d+ mm deep, according to the covering body; "
    said += "set another goal"
    assert re.search(said, controller.explain())


@pytest.mark.parametrize("planner", [True, False])
def test_a_pose_that_has_no_posture_without_self_collision_is_said_to_be_so(planner: bool) -> None:
    """The tip of three equal links at their base: an equilateral triangle, which ends where it begins."""
    arm = ss.Arm.load("planar3")
    pose = np.eye(4)
    pose[2, 3] = ss.Robot.named("planar3").pose(arm.neutral, "tip")[2, 3]
    controller = ss.Controller(arm, settings() if planner else settings(planner=None))
    controller.set_obstacles(ss.Obstacles.none())
    controller.set_goal(ss.PoseGoal(arm.robot, "tip", pose, position_only=True))
    motion = ss.integrate(controller, arm.neutral, np.zeros(3), steps=4000)
    assert motion.activities[-1] == ss.Activity.blocked
    said = (
        r"no posture without self-collision was found for the pose: at the last one links 'link1' and 'link3' touch, "
        r"\d+ mm deep"
    )
    assert re.search(said, controller.explain())


RAIL = """<robot name="rail"><link name="base"/>
<link name="cart"><collision><geometry><box size="0.2 0.2 0.2"/></geometry></collision></link>
<link name="arm"><collision><origin xyz="0.3 0 0"/><geometry><box size="0.4 0.05 0.05"/></geometry></collision></link>
<joint name="slide" type="prismatic"><parent link="base"/><child link="cart"/><axis xyz="0 1 0"/>
  <limit lower="-1" upper="1" velocity="0.015" effort="100"/></joint>
<joint name="turn" type="revolute"><parent link="cart"/><child link="arm"/><axis xyz="0 0 1"/>
  <limit lower="-2" upper="2" velocity="2" effort="100"/></joint></robot>"""


def test_a_rail_at_its_velocity_limit_is_not_stuck() -> None:
    arm = ss.Arm.load(RAIL, draft=True, cache=False)
    controller = ss.Controller(arm, settings(period=0.002))
    controller.set_goal([0.1, 0.0])
    controller.set_obstacles(ss.Obstacles([[0.9, 0.6, 0.0]], [0.05]))
    motion = ss.integrate(controller, [-0.05, 0.0], np.zeros(2), steps=8000, goal=[0.1, 0.0], tolerance=0.01)
    assert motion.arrived
    assert abs(motion.last_q[0] - 0.1) < 0.001  # [m] a tenth of the tolerance of a joint that turns
    assert controller.searches == 0  # nothing is in the way: no other way is looked for
    assert ss.Activity.blocked not in motion.activities


def test_an_unusable_state_gives_a_stop(robot: ss.Robot, arm: ss.Arm) -> None:
    controller = ss.Controller(arm, settings())
    controller.set_obstacles(ss.Obstacles.none())
    command = controller.step(np.full(7, np.nan), np.zeros(7))
    assert command.status == ss.SafetyStatus.stopping
    assert np.isnan(command.clearance)
    assert np.isfinite(command.acceleration).all()
    assert "unusable" in controller.explain()
    assert controller.step(robot.neutral, np.zeros(7)).status == ss.SafetyStatus.ok


def test_the_status_tells_of_a_lost_clearance(robot: ss.Robot, arm: ss.Arm) -> None:
    """Against the least clearance of the body, evaluated apart, at random states among random balls."""
    barrier = ClearanceBarrier(robot, arm.body)
    rng, lost = np.random.default_rng(7), 0
    for index in range(150):
        seen = balls(100 + index)
        q, v = robot.random_configuration(rng), rng.normal(scale=0.3, size=7)
        controller = ss.Controller(arm, settings(planner=None, look_ahead=None))
        controller.set_obstacles(seen)
        command = controller.step(q, v)
        least = float(barrier.evaluate(q, v, seen).clearances.min())
        if least < 0.0:
            lost += 1
            assert command.status == ss.SafetyStatus.clearance_lost
            assert command.clearance <= least
    assert lost > 10


def test_a_pose_is_reached_by_a_posture_that_it_finds(robot: ss.Robot, arm: ss.Arm) -> None:
    pose = robot.pose(robot.random_configuration(np.random.default_rng(5)), "fr3_hand")
    controller = ss.Controller(arm, settings())
    controller.set_obstacles(ss.Obstacles.none())
    controller.set_goal(ss.PoseGoal(robot, "fr3_hand", pose))
    motion = ss.integrate(controller, robot.neutral, np.zeros(7), steps=8000)
    reached = robot.pose(motion.last_q, "fr3_hand")
    assert np.linalg.norm(reached[:3, 3] - pose[:3, 3]) < 1e-3
    assert np.degrees(np.arccos(min(1.0, (np.trace(reached[:3, :3].T @ pose[:3, :3]) - 1) / 2))) < 0.5
    assert motion.activities[-1] == ss.Activity.arrived


def test_what_is_out_of_reach_is_said(robot: ss.Robot, arm: ss.Arm) -> None:
    pose = np.eye(4)
    pose[:3, 3] = 0.0, 0.0, 3.0
    controller = ss.Controller(arm, settings())
    controller.set_obstacles(ss.Obstacles.none())
    controller.set_goal(ss.PoseGoal(robot, "fr3_hand", pose))
    motion = ss.integrate(controller, robot.neutral, np.zeros(7), steps=8000)
    assert motion.activities[-1] == ss.Activity.blocked
    assert controller.explain().startswith("the goal is out of reach: nearest posture ")


def test_what_blocks_a_goal_is_said_without_a_planner_as_well(robot: ss.Robot, arm: ss.Arm) -> None:
    goal = robot.neutral + np.array([0.8, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    hand = robot.pose(goal, "fr3_hand")[:3, 3]
    words = []
    for planner in (OnlinePlannerSettings(), None):
        controller = ss.Controller(arm, settings(planner=planner))
        controller.set_goal(goal)
        controller.set_obstacles(ss.Obstacles([hand], radii=0.05))
        motion = ss.integrate(controller, robot.neutral, np.zeros(7), steps=6000)
        assert motion.activities[-1] == ss.Activity.blocked
        words.append(controller.explain())
    assert words[0] == words[1]
    assert words[0].startswith("at the goal link 'fr3_")
    assert "obstacle point 0" in words[0]


@pytest.mark.slow
def test_shapes_are_obstacles_and_words_have_their_names(robot: ss.Robot, arm: ss.Arm) -> None:
    """A shape, or a list that mixes shapes and points: as its balls, with links and obstacles by name."""
    goal = robot.neutral + np.array([0.8, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    hand = robot.pose(goal, "fr3_hand")[:3, 3]
    table = ss.Box((0.2, 0.3, 0.1), pose_at(hand), name="table")
    ball = ss.Sphere(0.05, pose_at([-0.5, 0.0, 0.5]), velocity=[-0.1, 0.0, 0.0])
    for planner in (OnlinePlannerSettings(), None):
        controller = ss.Controller(arm, settings(planner=planner))
        controller.set_goal(goal)
        controller.set_obstacles([ss.Obstacles([[-1.0, 0.0, 0.2]], 0.05), table, ball], valid_for=np.inf)
        motion = ss.integrate(controller, robot.neutral, np.zeros(7), steps=16000)
        assert motion.activities[-1] == ss.Activity.blocked
        assert re.match(
            r"at the goal link 'fr3_\w+' is \d+ mm deep in 'table'; it goes on", controller.explain()
        )
        seen = controller.obstacles
        assert seen.groups == [("obstacle0", 1), ("table", len(table.balls()[0])), ("obstacle2", 1)]
        np.testing.assert_allclose(seen.points[-1], [-0.5 - 0.1 * 15.999, 0.0, 0.5], atol=1e-9)
        if controller.command.point >= 0:
            assert seen.name_of(controller.command.point) == "table"
    controller.clear_goal()
    controller.set_obstacles(
        ss.Sphere(0.2, pose_at(robot.pose(robot.neutral, "fr3_hand")[:3, 3]), name="cup")
    )
    command = controller.step(robot.neutral, np.zeros(7))
    assert command.status == ss.SafetyStatus.clearance_lost
    assert re.match(r"link 'fr3_\w+' and 'cup' overlap by \d+ mm", controller.explain())
    assert controller.obstacles.name_of(command.point) == "cup"
    with pytest.raises(TypeError, match="obstacles are of type float, must be a shape, Obstacles or a list"):
        controller.set_obstacles(0.1)
    assert controller.obstacles.groups == [("cup", 1)]


def test_a_diagnosis_has_names(robot: ss.Robot, arm: ss.Arm) -> None:
    controller = ss.Controller(arm, settings())
    cup = ss.Sphere(0.2, pose_at(robot.pose(robot.neutral, "fr3_hand")[:3, 3]), name="cup")
    controller.set_obstacles(cup)
    controller.set_goal(robot.neutral + 0.1)
    controller.step(robot.neutral, np.zeros(7))
    words = controller.geometric_step.diagnosis.describe()
    assert re.match(r"link fr3_\w+ is inside the barrier of 'cup', \d+ mm deep, and moves out", words)
    seen = obstacles_from_shapes(cup)
    other = controller.system.diagnose(robot.neutral, np.zeros(7), robot.neutral + 0.1, seen).describe()
    assert "'cup'" in other


def test_a_posture_is_looked_for_near_the_rest_of_a_pose(robot: ss.Robot, arm: ss.Arm) -> None:
    """Of the many with the same pose."""
    rng = np.random.default_rng(2)
    for _ in range(5):
        rest = robot.random_configuration(rng)
        controller = ss.Controller(arm, settings())
        controller.set_obstacles(ss.Obstacles.none())
        controller.set_goal(ss.PoseGoal(robot, "fr3_hand", robot.pose(rest, "fr3_hand"), rest=rest))
        controller.step(robot.neutral, np.zeros(7))
        found = controller.target
        assert found is not None
        free = SelfCollision(robot).distance(rest).distance > 0.0
        assert not free or np.abs(found - rest).max() < 1e-9


def test_a_posture_that_is_not_free_is_taken_only_where_there_is_no_other(
    robot: ss.Robot, arm: ss.Arm
) -> None:
    pose = robot.pose(robot.neutral, "fr3_hand")

    def found(*points: np.ndarray) -> np.ndarray:
        controller = ss.Controller(arm, settings())
        controller.set_goal(ss.PoseGoal(robot, "fr3_hand", pose))
        controller.set_obstacles(ss.Obstacles(np.array(points), 0.05) if points else ss.Obstacles.none())
        controller.step(robot.neutral, np.zeros(7))
        q = controller.target
        assert q is not None
        np.testing.assert_allclose(robot.pose(q, "fr3_hand"), pose, atol=1e-6)
        return q

    first = found()
    elbow = robot.pose(first, "fr3_link4")[:3, 3]
    assert np.abs(found(elbow) - first).max() > 0.1  # [rad] another
    found(pose[:3, 3])  # in the hand, where no posture is free


@pytest.mark.slow
def test_continuous_joints_take_the_nearest_turn_and_survive_encoders_that_wrap() -> None:
    text = """<robot name="spinner"><link name="base"/><joint name="turn" type="continuous"><parent link="base"/>
      <child link="bar"/><axis xyz="0 0 1"/><limit velocity="2" effort="50"/></joint><link name="bar"><inertial>
      <mass value="1"/><inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial><collision>
      <origin xyz="0.3 0 0"/><geometry><box size="0.6 0.05 0.05"/></geometry></collision></link></robot>"""
    robot = ss.Robot.from_urdf(text)
    spinner = ss.Arm.from_robot(robot, ss.Body.cover(robot, components=2, cache=False))
    controller = ss.Controller(spinner, settings())
    controller.set_obstacles(ss.Obstacles.none())
    controller.set_goal([-3.0])
    q, v, travelled = np.array([3.0]), np.zeros(1), 0.0
    for _ in range(6000):
        measured = (q + np.pi) % (2.0 * np.pi) - np.pi  # an encoder that reports (-pi, pi]
        command = controller.step(measured, v)
        v = v + PERIOD * command.acceleration
        travelled += PERIOD * abs(float(v[0]))
        q = q + PERIOD * v
    assert q[0] == pytest.approx(2.0 * np.pi - 3.0, abs=0.01)
    assert travelled < 0.3
    assert command.activity == ss.Activity.arrived


def test_every_setting_has_a_default_in_its_range() -> None:
    for field in controller_settings_fields():
        assert field["least"] <= field["default"] <= field["most"], field["name"]
        assert field["unit"]
        assert field["trades"]
    with pytest.raises(
        ValueError, match=r"controller: barriers\.stiffness is 1000 1/s\^2, allowed: 0\.01 to 100 1/s\^2"
    ):
        ss.ControllerSettings(barriers=BarrierSettings(stiffness=1000.0))
    with pytest.raises(TypeError, match="has no setting 'stifness'; it has: stiffness, damping"):
        BarrierSettings(stifness=1.0)


@pytest.fixture(scope="module")
def planar() -> ss.Arm:
    return ss.Arm.load("planar3")


BARE = {
    "output": "torque",
    "planner": None,
    "look_ahead": None,
    "local_minimum": None,
    "local_activation": False,
    "limit_margin": 0.0,
    "effort_margin": 0.0,
}


def near_the_tip(arm: ss.Arm, aside: float = 0.0) -> ss.Obstacles:
    return ss.Obstacles([arm.robot.pose(arm.neutral, "link3")[:3, 3] + np.array([0.25, 0.09 + aside, 0.0])])


def states(arm: ss.Arm, num: int) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(4)
    q = arm.neutral + rng.normal(scale=0.1, size=(num, arm.num_coordinates))
    v = rng.normal(scale=0.3, size=q.shape)
    return q, v + np.copysign(0.1, v)  # slower joints count as at rest


def bare(arm: ss.Arm, goal: np.ndarray, seen: ss.Obstacles) -> ss.Controller:
    controller = ss.Controller(arm, settings(**BARE))
    controller.set_goal(goal)
    controller.set_obstacles(seen)
    return controller


# What a controller says of the way in which its program ended.
SAFETY_OF = {
    "ok": ss.SafetyStatus.ok,
    "limited": ss.SafetyStatus.limited,
    "relaxed": ss.SafetyStatus.relaxed,
    "relaxed_safety": ss.SafetyStatus.margin_lost,
    "clearance_lost": ss.SafetyStatus.clearance_lost,
}


def test_without_its_further_parts_it_is_the_system_followed_by_the_program(planar: ss.Arm) -> None:
    robot, goal, seen = planar.robot, planar.neutral + 0.3, near_the_tip(planar)
    system, program = barrier_system(robot, planar.body), MotionProgram(robot)
    bounded = 0
    for q, v in zip(*states(planar, 20), strict=True):
        controller = bare(planar, goal, seen)  # its reference begins at the state, without acceleration
        M, h = robot.mass_matrix(q), robot.bias(q, v)
        step = system.acceleration(q, v, goal, seen)
        expected = program.solve(
            q, v, step.acceleration, M, h, clearances=step, last_acceleration=np.zeros_like(q)
        )
        found = controller.step(q, v, M, h)
        if found.clearance >= 0.0:
            assert found.status == SAFETY_OF[expected.status.name]
        np.testing.assert_array_equal(found.wanted, step.acceleration)
        np.testing.assert_array_equal(found.torque, expected.torque)
        bounded += found.bound_by >= 0
        # Its own mass matrix and bias are those of the robot, but for rounding.
        own = bare(planar, goal, seen).step(q, v)
        np.testing.assert_allclose(own.torque, expected.torque, rtol=1e-9, atol=1e-9)
    assert bounded > 0


def test_new_goals_and_obstacles_count_from_the_next_step_on(planar: ss.Arm) -> None:
    q, v = (rows[0] for rows in states(planar, 1))
    controller = bare(planar, planar.neutral, ss.Obstacles.none())

    def begins_anew() -> np.ndarray:
        controller.step(np.full_like(q, np.nan), v)
        return controller.step(q, v).torque

    free = begins_anew()
    controller.set_obstacles(near_the_tip(planar))
    bent = begins_anew()
    assert not np.allclose(free, bent)
    controller.set_goal(planar.neutral + 0.5)
    elsewhere = begins_anew()
    fresh = bare(planar, planar.neutral + 0.5, near_the_tip(planar)).step(q, v).torque
    np.testing.assert_array_equal(elsewhere, fresh)
    assert not np.allclose(elsewhere, bent)


def test_torque_of_a_stop_is_within_the_limits(planar: ss.Arm) -> None:
    controller = bare(planar, planar.neutral, near_the_tip(planar))
    v = states(planar, 1)[1][0]
    found = controller.step(np.full(planar.num_coordinates, np.nan), v)
    assert found.status == ss.SafetyStatus.stopping
    assert np.all(np.abs(found.torque) <= planar.limits.effort)


def test_obstacles_may_be_replaced_while_steps_run(planar: ss.Arm) -> None:
    """Every step has seen one of the clouds that were set, whole."""
    q, v = (rows[0] for rows in states(planar, 1))
    clouds = [near_the_tip(planar, 0.01 * k) for k in range(4)]
    allowed = [bare(planar, planar.neutral, cloud).step(q, v).torque for cloud in clouds]
    assert not np.array_equal(allowed[0], allowed[1])
    controller, done = bare(planar, planar.neutral, clouds[0]), threading.Event()

    def refresh() -> None:
        for k in range(2000):
            controller.set_obstacles(clouds[k % 4])
        done.set()

    writer = threading.Thread(target=refresh)
    writer.start()
    steps = 0
    while not done.is_set() or steps < 20:
        controller.step(np.full_like(q, np.nan), v)  # after which the reference begins anew at the state
        torque = controller.step(q, v).torque
        assert any(np.array_equal(torque, one) for one in allowed)
        steps += 1
    writer.join()


def test_threads_of_an_asynchronous_controller_end(robot: ss.Robot, arm: ss.Arm) -> None:
    for seed in range(3):
        controller = ss.Controller(arm, _core.ControllerSettings())
        controller.set_goal(robot.random_configuration(np.random.default_rng(seed)))
        controller.set_obstacles(balls(seed))
        q, v = robot.neutral, np.zeros(7)
        for _ in range(300):
            command = controller.step(q, v)
            v = v + PERIOD * command.acceleration
            q = q + PERIOD * v
        assert np.isfinite(q).all()
        assert command.torque.any()
        del controller


def test_a_running_controller_loads_neither_physics_nor_exact_distances(arm: ss.Arm, tmp_path) -> None:
    arm.save(tmp_path / "fr3.arm")
    code = (
        "import sys, numpy as np, sidestep as ss\n"
        f"controller = ss.Controller(ss.Arm.load({str(tmp_path / 'fr3.arm')!r}))\n"
        "controller.step(np.zeros(7), np.zeros(7))\n"
        "print([n for n in ('mujoco', 'coal', 'pinocchio', 'matplotlib', 'sklearn') if n in sys.modules])\n"
    )
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert found.stdout.strip() == "[]"


def test_what_is_written_to_an_optional_part_counts() -> None:
    tree = ss.ControllerSettings()
    tree.planner.search.margin = 0.033
    assert tree.planner.search.margin == 0.033
    assert ss.ControllerSettings().planner.search.margin != 0.033
    tree.planner = None
    assert tree.planner is None
    assert tree.speed_limits is None
