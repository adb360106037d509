"""What a controller says of itself: distances to the goal that was set, velocities that are not kept, ages, reprs."""

import re
import subprocess
import sys
from collections.abc import Callable

import numpy as np
import pytest

import sidestep as ss
from sidestep.controller import InputSettings, TrackingSettings
from sidestep.obstacles import pose_at

ARM = ss.Arm.load("planar3")
TIP = "tip"
PERIOD = 0.001
GOAL = np.array([1.6, 0.3, 0.3])
START = np.array([-1.0, -0.3, -0.3])
BENT = r"bent by the clearance of link '\w+' and 'ball'$"
RAIL = """<robot name="rail"><link name="base"/>
<link name="cart"><collision><geometry><box size="0.2 0.2 0.2"/></geometry></collision></link>
<joint name="slide" type="prismatic"><parent link="base"/><child link="cart"/><axis xyz="0 1 0"/>
  <limit lower="-1" upper="1" velocity="0.5" effort="100"/></joint></robot>"""


def controller(arm: ss.Arm = ARM, **settings: object) -> ss.Controller:
    made = ss.Controller(
        arm, ss.ControllerSettings(**{"synchronous": True, "output": "acceleration"} | settings)
    )
    made.set_obstacles(ss.Obstacles.none())
    return made


def numbers(pattern: str, words: str) -> list[float]:
    """What the groups of a pattern hold in a sentence, which has them."""
    found = re.search(pattern, words)
    assert found is not None, words
    return [float(group) for group in found.groups()]


def ball() -> ss.Sphere:
    """In the straight way from START to GOAL, at the tip's height."""
    middle = ARM.robot.pose(0.5 * (START + GOAL), TIP)[:3, 3]
    return ss.Sphere(0.05, pose_at(0.8 * middle), name="ball")


def on_the_path(goal: object) -> tuple[ss.Controller, np.ndarray]:
    """A controller under way on a path of the planner, far from its goal, and where the arm is."""
    c = controller()
    c.set_obstacles(ball())
    c.set_goal(goal)  # type: ignore[arg-type]
    q, v = START, np.zeros(3)
    for _ in range(5000):
        command = c.step(q, v)
        if command.on_path and np.abs(v).max() > 0.3:
            return c, q
        v = v + PERIOD * command.acceleration
        q = q + PERIOD * v
    raise AssertionError(c.explain())


def test_on_a_path_the_distance_is_that_to_the_goal() -> None:
    c, q = on_the_path(GOAL)
    away = np.abs(GOAL - q).max()
    assert away > 1.0
    assert c.explain() == f"follows a path; on the way, {away:.2f} rad from the goal"


def test_on_a_path_to_a_pose_the_distance_is_that_of_the_frame() -> None:
    pose = ARM.robot.pose(GOAL, TIP)
    c, q = on_the_path(ss.PoseGoal(ARM.robot, TIP, pose))
    now = ARM.robot.pose(q, TIP)
    turn = now[:3, :3].T @ pose[:3, :3]
    position = 1000.0 * np.linalg.norm(now[:3, 3] - pose[:3, 3])
    rotation = abs(np.arctan2(turn[1, 0], turn[0, 0]))  # of a planar arm
    assert position > 300.0
    told = numbers(r"on the way, (\S+) mm and (\S+)° from the goal", c.explain())
    assert told == pytest.approx([position, np.rad2deg(rotation)], abs=0.6)  # as they are rounded


def test_what_slides_is_in_millimetres() -> None:
    arm = ss.Arm.load(RAIL, draft=True, cache=False)
    c = controller(arm)
    c.set_goal([0.5])
    motion = ss.integrate(c, [0.0], [0.0], steps=300)
    away = numbers(r"on the way, (\S+) mm from the goal$", c.explain())
    assert away == [pytest.approx(1000.0 * (0.5 - motion.q[-1, 0]), abs=0.06)]
    with pytest.raises(ValueError, match=r"joint 'slide' is 1\.5\d*, allowed: -1\.0\d* to 1\.0\d* m$"):
        c.set_goal([1.5])
    with pytest.raises(ValueError, match=r"sample 0 is 1\.5\d*, allowed: -1\.0\d* to 1\.0\d* m$"):
        c.set_trajectory([[1.5]], [0.0])


def test_goals_outside_the_limits_are_refused_with_the_unit() -> None:
    with pytest.raises(ValueError, match=r"joint 'joint2' is 9\.0\d*, allowed: -\d\S+ to \d\S+ rad$"):
        controller().set_goal([0.0, 9.0, 0.0])


def until_slower(c: ss.Controller, q: np.ndarray, pattern: str) -> tuple[float, float, np.ndarray]:
    """Steps until it says that it has less than 0.8 of what was asked: both [SI], and the reference's velocity."""
    v = np.zeros(3)
    for _ in range(4000):
        command = c.step(q, v)
        if re.match(pattern, c.explain()):
            got, asked = numbers(pattern, c.explain())
            if got < 0.8 * asked:
                return got, asked, command.velocity
        v = v + PERIOD * command.acceleration
        q = q + PERIOD * v
    raise AssertionError(c.explain())


def test_a_velocity_that_a_clearance_holds_back_is_told() -> None:
    c = controller(inputs=InputSettings(timeout=10.0))
    place = ARM.robot.pose(START + np.array([0.5, 0.0, 0.0]), TIP)[:3, 3]
    c.set_obstacles(ss.Sphere(0.05, pose_at(place), name="ball"))
    c.set_velocity([0.4, 0.0, 0.0])
    said = r"slower than asked: (\S+) of (\S+) rad/s of joint 'joint1', " + BENT
    got, asked, v = until_slower(c, START, said)
    assert asked == 0.4
    assert got == pytest.approx(v[0], abs=0.006)  # rounded


def test_a_twist_that_a_clearance_holds_back_is_told() -> None:
    c = controller(inputs=InputSettings(timeout=10.0))
    q = np.array([-1.0, 1.0, 0.8])
    tip = ARM.robot.pose(q, TIP)[:3, 3]
    aside = np.array([-tip[1], tip[0], 0.0]) / np.linalg.norm(tip)
    c.set_obstacles(ss.Sphere(0.05, pose_at(tip + 0.25 * aside), name="ball"))
    c.set_twist(TIP, [*(0.2 * aside), 0.0, 0.0, 0.0])
    said = r"slower than asked: (\S+) of (\S+) m/s of frame 'tip', " + BENT
    got, asked, _ = until_slower(c, q, said)
    assert asked == 0.2
    assert 0.0 < got < 0.16


def test_a_velocity_into_a_limit_names_the_limit() -> None:
    c = controller()
    q = np.array([ARM.limits.upper[0] - 0.1, 0.5, 0.5])
    v = np.zeros(3)
    for _ in range(1000):
        c.set_velocity([0.3, 0.0, 0.0])
        command = c.step(q, v)
        v = v + PERIOD * command.acceleration
        q = q + PERIOD * v
    assert re.match(
        r"slower than asked: -?0\.0\d of 0\.30 rad/s of joint 'joint1', "
        r"bent by the clearance of joint 'joint1' and its upper limit$",
        c.explain(),
    )


def test_timeouts_are_told_in_seconds() -> None:
    c = controller(inputs=InputSettings(timeout=0.2), obstacle_timeout=0.5)
    c.set_obstacles(ss.Obstacles([[5.0, 0.0, 0.0]]))
    c.set_velocity([0.1, 0.0, 0.0])
    ss.integrate(c, START, np.zeros(3), steps=301)
    assert c.explain() == (
        "stopped: the velocity is 0.3 s old, more than inputs.timeout (0.2 s); "
        "set_velocity or set_twist must be called more often"
    )
    ss.integrate(c, START, np.zeros(3), steps=300)
    assert c.explain() == (
        "stopped: source 'scene' is 0.60 s old and valid for 0.50 s; the arm goes on when it comes again"
    )


def test_reprs_are_short_and_say_what_matters() -> None:
    settings = ss.ControllerSettings(
        planner=None, tracking=TrackingSettings(stiffness=50.0), output="position"
    )
    assert repr(ss.ControllerSettings()) == "ControllerSettings()"
    assert repr(settings) == (
        "ControllerSettings(tracking=TrackingSettings(stiffness=50.0), planner=None, output='position')"
    )
    assert repr(InputSettings(timeout=0.5)) == "InputSettings(timeout=0.5)"
    assert repr(ss.Obstacles.none()) == "Obstacles(0 points)"
    named = ss.Obstacles([[1, 0, 0], [2, 0, 0]]).named(["cup", "box"], [1, 1])
    assert repr(named) == "Obstacles(2 points, of 'cup', 'box')"
    many = ss.Obstacles(np.eye(3).repeat(2, axis=0)).named(list("abcdef"), [1] * 6)
    assert repr(many) == "Obstacles(6 points, of 'a', 'b', 'c', 'd' and 2 more)"
    assert repr(ss.JointGoal([0.5, -1.23456])) == "JointGoal([0.5, -1.23])"
    assert repr(ss.JointGoal([0.5], [0.1])) == "JointGoal([0.5], moves)"
    pose = pose_at([0.5, 0.25, 0.0])
    assert repr(ss.PoseGoal(ARM.robot, TIP, pose)) == "PoseGoal('tip' at [0.5, 0.25, 0] m)"
    c = controller()
    assert repr(c) == "Controller(arm 'planar3', 3 coordinates)"
    command = c.step(START, np.zeros(3))
    assert repr(command) == "Command(ok, no_goal, clearance=inf m, speed=0 m/s)"
    assert (
        repr(ss.integrate(c, START, np.zeros(3), steps=2)) == "MotionRecord(2 steps, least clearance=inf m)"
    )
    assert repr(c.plan).startswith("Plan(")
    assert repr(ARM.body) == f"Body(3 links, {ARM.body.num_components} ellipsoids)"


def test_a_thread_that_holds_a_controller_at_exit_is_no_message() -> None:
    program = (
        "import threading, time, sidestep as ss\n"
        "c = ss.Controller(ss.Arm.load('planar3'))\n"
        "threading.Thread(target=lambda held: time.sleep(60), args=(c,), daemon=True).start()\n"
        "print(c)\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True, timeout=60
    )
    assert done.stdout.strip() == "Controller(arm 'planar3', 3 coordinates)"
    assert done.stderr == ""


def test_before_the_first_step_it_says_that_there_was_none() -> None:
    c = controller()
    assert c.explain() == "no step was made yet: call step with the measured state, once a period"
    c.step([0.0, np.nan, 0.0], np.zeros(3))
    assert "the position of this step is unusable" in c.explain()


def test_goals_that_are_not_finite_are_refused_when_they_are_made() -> None:
    with pytest.raises(ValueError, match=r"^position\[1\] is nan, must be a finite number$"):
        ss.JointGoal([0.0, np.nan, 0.0])
    for name in ("velocity", "acceleration"):
        with pytest.raises(ValueError, match=rf"^{name}\[2\] is inf, must be a finite number$"):
            ss.JointGoal(np.zeros(3), **{name: [0.0, 0.0, np.inf]})
    robot = ss.Robot.named("planar3")
    frame = robot.frames[-1].name
    pose = np.eye(4)
    pose[1, 3] = np.nan
    with pytest.raises(ValueError, match=r"^pose\[1, 3\] is nan, must be a finite number$"):
        ss.PoseGoal(robot, frame, pose)
    with pytest.raises(ValueError, match=r"^pose\[2\] is inf, must be a finite number$"):
        ss.PoseGoal(robot, frame, [0.0, 0.0, np.inf], position_only=True)
    with pytest.raises(ValueError, match=r"^twist\[5\] is nan"):
        ss.PoseGoal(robot, frame, np.eye(4), twist=[0.0] * 5 + [np.nan])
    with pytest.raises(ValueError, match=r"^rest\[0\] is nan"):
        ss.PoseGoal(robot, frame, np.eye(4), rest=[np.nan, 0.0, 0.0])


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (
            lambda c: ss.Controller("fr3"),
            "arm is 'fr3', of type str, must be an Arm, such as Arm.load('fr3')",
        ),
        (lambda c: ss.Controller(None), "arm is None, must be an Arm"),
        (
            lambda c: ss.Controller(c.arm, {"period": 0.001}),
            "settings is {'period': 0.001}, of type dict, must be",
        ),
        (
            lambda c: c.set_goal(None),
            "goal is None, must be a configuration, a JointGoal, a PoseGoal or a list",
        ),
        (lambda c: c.set_velocity(None), "v is None, must be an array of real numbers"),
        (lambda c: c.set_twist(None, np.zeros(6)), "frame is None, must be the name of a link"),
        (lambda c: c.set_twist("link3", None), "twist is None, must be an array of real numbers"),
        (lambda c: c.set_trajectory(None, [0.0]), "q is None, must be an array of real numbers"),
        (
            lambda c: c.set_obstacles(None),
            "obstacles are of type NoneType, must be a shape, Obstacles or a list",
        ),
        (lambda c: c.set_arm("fr3"), "arm is 'fr3', of type str, must be an Arm"),
        (lambda c: c.step(None, np.zeros(3)), "q is None, must be an array of real numbers"),
        (lambda c: c.step(np.zeros(3), None), "v is None, must be an array of real numbers"),
        (
            lambda c: ss.integrate(c, None, np.zeros(3), steps=1),
            "q is None, must be an array of real numbers",
        ),
        (lambda c: ss.JointGoal(None), "position is None, must be an array of real numbers"),
        (lambda c: ss.PoseGoal("fr3", "link3", np.eye(4)), "robot is 'fr3', of type str, must be a Robot"),
        (
            lambda c: ss.PoseGoal(ss.Robot.named("planar3"), 3, np.eye(4)),
            "frame is 3, of type int, must be the name",
        ),
    ],
)
def test_arguments_of_a_wrong_type_are_named_in_one_line(
    call: Callable[[ss.Controller], object], message: str
) -> None:
    with pytest.raises(TypeError) as caught:
        call(controller())
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)


def test_of_a_link_that_hardly_moves_it_is_not_said_that_it_goes_on():
    controller = ss.Controller(arm := ss.Arm.load("fr3"), ss.ControllerSettings(synchronous=True))
    controller.set_obstacles(ss.Box((0.3, 0.3, 0.1), pose_at([0.0, 0.0, 0.1]), name="block"))
    controller.set_goal(arm.neutral + 0.3)
    for _ in range(30):  # the planner has looked
        controller.step(arm.neutral, np.zeros(7))
    words = controller.explain()
    assert "only joint 'fr3_joint1' moves that link" in words
    assert "remove the obstacle" in words
    assert "it goes on when that is free" not in words
