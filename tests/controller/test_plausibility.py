"""Millimetres for metres, degrees for radians: questioned where neither limits nor reach explain them."""

from __future__ import annotations

import re
import warnings

import numpy as np
import pytest

import sidestep as ss
from sidestep._core import looks_like_degrees
from sidestep.obstacles import pose_at

DEGREES = np.array([0.0, -45.0, 0.0, -135.0, 0.0, 90.0, 45.0])  # a common posture of the FR3
TIP = "fr3_hand_tcp"


@pytest.fixture(scope="module")
def fr3() -> ss.Arm:
    return ss.Arm.load("fr3")


@pytest.fixture(scope="module")
def gen3() -> ss.Arm:
    """An arm of two joints without limits and a slide."""
    urdf = """<robot name="turns"><link name="base"/>
    <link name="a"><collision><origin xyz="0.2 0 0"/><geometry><box size="0.4 0.1 0.1"/></geometry></collision></link>
    <link name="b"><collision><origin xyz="0.2 0 0"/><geometry><box size="0.4 0.1 0.1"/></geometry></collision></link>
    <link name="c"><collision><origin xyz="0.1 0 0"/><geometry><box size="0.1 0.1 0.1"/></geometry></collision></link>
    <joint name="j1" type="continuous"><parent link="base"/><child link="a"/><axis xyz="0 0 1"/>
      <limit velocity="2" effort="100"/></joint>
    <joint name="j2" type="continuous"><parent link="a"/><child link="b"/><origin xyz="0.4 0 0"/><axis xyz="0 0 1"/>
      <limit velocity="2" effort="100"/></joint>
    <joint name="s" type="prismatic"><parent link="b"/><child link="c"/><origin xyz="0.4 0 0"/><axis xyz="1 0 0"/>
      <limit lower="0" upper="0.3" velocity="0.2" effort="100"/></joint></robot>"""
    return ss.Arm.load(urdf, draft=True, cache=False)


def grid(edge: float, depth: float) -> np.ndarray:
    """Points (N, 3) every 0.2 m of a floor with this edge [m], this much below the base."""
    line = np.linspace(-0.5 * edge, 0.5 * edge, round(5 * edge))
    x, y = np.meshgrid(line, line)
    return np.stack([x.ravel(), y.ravel(), np.full(x.size, -depth)], axis=1)


def controller(arm: ss.Arm, **options: object) -> ss.Controller:
    made = ss.Controller(
        arm, ss.ControllerSettings(synchronous=True, **({"output": "acceleration"} | options))
    )
    made.set_obstacles(ss.Obstacles.none())
    return made


@pytest.mark.parametrize(
    ("things", "words"),
    [
        (
            [ss.Sphere(80.0, pose_at([450.0, 100.0, 300.0]), name="ball")],
            "'ball' is 470 m .* in millimetres",
        ),
        ([ss.Sphere(0.08, pose_at([450.0, 100.0, 300.0]), name="ball")], "'ball' is .* in millimetres"),
        ([ss.Sphere(60.0, pose_at([0.4, 0.1, 0.3]), name="ball")], "'ball' is a ball of radius 60 m"),
        (
            [
                ss.Box((1.0, 1.0, 0.1), pose_at([0.5, 0.0, -0.1]), name="table"),
                ss.Sphere(50.0, pose_at([300.0, 0.0, 80.0]), name="cup"),
            ],
            "'cup' is .* in millimetres",
        ),
        (
            [ss.Sphere(0.08, pose_at([0.6, 0.3, 0.3]), velocity=[300.0, 0.0, 0.0], name="hand")],
            "'hand' .* in mm/s",
        ),
        ([ss.Plane([0.0, 0.0, -100.0], [0.0, 0.0, 1.0], name="floor")], "'floor' is 100 m"),
    ],
)
def test_a_shape_in_millimetres_is_questioned(fr3: ss.Arm, things: list[object], words: str) -> None:
    made = controller(fr3)
    with warnings.catch_warnings():  # the points are warned of where they are made, without any arm
        warnings.filterwarnings("ignore", "obstacles: all points are farther", RuntimeWarning)
        with pytest.warns(RuntimeWarning, match=words):
            made.set_obstacles(things)
    assert re.search(words, made.questions[0])
    made.set_goal(fr3.neutral + 0.1)
    made.step(fr3.neutral, np.zeros(7))
    assert re.search("; check the units: obstacles: .*" + words, made.explain())
    made.set_obstacles(ss.Obstacles.none())
    assert made.questions == []
    assert "check the units" not in made.explain()


def test_a_cloud_in_millimetres_is_questioned_with_zeros_of_what_was_not_seen(fr3: ss.Arm) -> None:
    rng = np.random.default_rng(3)
    cloud = rng.uniform([200.0, -600.0, 0.0], [1500.0, 600.0, 900.0], size=(5000, 3))
    cloud[::3] = 0.0
    made = controller(fr3)
    with pytest.warns(RuntimeWarning, match=r"most points are more than \d+ m .* in millimetres"):
        made.set_obstacles(ss.Obstacles(cloud, 0.005))


@pytest.mark.parametrize(
    "things",
    [
        [ss.Obstacles(grid(20.0, 0.1), 0.1)],
        [ss.Box((0.2, 20.0, 5.0), pose_at([8.0, 0.0, 2.0]), name="wall")],
        [ss.Plane([0.0, 0.0, -0.02], [0.0, 0.0, 1.0])],
        [ss.Sphere(0.3, pose_at([12.0, 0.0, 0.0]), velocity=[-6.0, 0.0, 0.0], name="truck")],
        [ss.Sphere(1000.0, pose_at([0.0, 0.0, -1000.1]), name="earth")],
        [ss.Obstacles(np.random.default_rng(0).uniform(-30.0, 30.0, size=(3000, 3)), 0.02)],
    ],
)
def test_floors_walls_and_halls_are_not(fr3: ss.Arm, things: list[object]) -> None:
    made = controller(fr3)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        made.set_obstacles(things)
    assert made.questions == []


def test_a_goal_in_degrees_is_refused_with_the_likely_cause(fr3: ss.Arm) -> None:
    made = controller(fr3)
    with pytest.raises(ValueError, match=r"joint 'fr3_joint2' is -45\.0+, allowed: .* rad; in degrees\?"):
        made.set_goal(DEGREES)
    with pytest.raises(ValueError, match=r"of sample 1 is .* rad; in degrees\?"):
        made.set_trajectory([fr3.neutral, DEGREES], [0.0, 2.0])
    with pytest.raises(ValueError, match=r"allowed: .* rad$"):  # beyond the limit by a little: no degrees
        made.set_goal(fr3.neutral + np.array([3.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]))


def test_joints_without_limits_are_questioned(gen3: ss.Arm) -> None:
    made = controller(gen3)
    with pytest.warns(RuntimeWarning, match=r"goal: joint 'j1' is 90 rad; in degrees\?"):
        made.set_goal([90.0, -45.0, 0.1])
    with pytest.warns(RuntimeWarning, match=r"joint 'j2' of sample 1 is -45 rad; in degrees\?"):
        made.set_trajectory([[0.0, 0.0, 0.0], [0.1, -45.0, 0.0]], [0.0, 30.0])
    with pytest.raises(ValueError, match=r"joint 's' is 250\.0+, .* m; in millimetres\?"):
        made.set_goal([0.0, 0.0, 250.0])
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        made.set_goal([4.0 * np.pi, -7.0, 0.1])  # turns; an angle of more than one turn
    assert made.questions == []


def test_velocities_far_beyond_limits_are_questioned(fr3: ss.Arm, gen3: ss.Arm) -> None:
    made = controller(fr3)
    with pytest.warns(
        RuntimeWarning,
        match=r"velocity of joint 'fr3_joint1' is 90 rad/s, its limit is 2\.62 rad/s; in degrees",
    ):
        made.set_velocity([90.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    made.step(fr3.neutral, np.zeros(7))
    assert "; check the units: velocity of joint 'fr3_joint1' is 90 rad/s" in made.explain()
    with pytest.warns(RuntimeWarning, match=r"goal: velocity of joint 'fr3_joint1' is 60 rad/s"):
        made.set_goal(ss.JointGoal(fr3.neutral, velocity=np.array([60.0, 0, 0, 0, 0, 0, 0])))
    with pytest.warns(RuntimeWarning, match=r"twist: its speed is 150 m/s, .* in mm/s"):
        made.set_twist(TIP, [150.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    with pytest.warns(RuntimeWarning, match=r"twist: it turns by 45 rad/s, .* in degrees per second"):
        made.set_twist(TIP, [0.0, 0.0, 0.0, 0.0, 0.0, 45.0])
    with pytest.warns(
        RuntimeWarning, match=r"velocity of joint 's' is 50 m/s, its limit is 0\.2 m/s; in mm/s"
    ):
        controller(gen3).set_velocity([0.0, 0.0, 50.0])
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        made.set_velocity(2.0 * fr3.robot.limits.velocity)  # as fast as it can
        made.set_twist(TIP, [2.0, 0.0, 0.0, 0.0, 3.0, 0.0])
    assert made.questions == []


def test_a_pose_in_millimetres_and_times_in_milliseconds_are_questioned(fr3: ss.Arm) -> None:
    made = controller(fr3)
    pose = fr3.robot.pose(fr3.neutral, TIP)
    pose[:3, 3] = 450.0, 200.0, 400.0
    with pytest.warns(RuntimeWarning, match=rf"the pose of frame '{TIP}' is 6\d\d m from .* in millimetres"):
        made.set_goal(ss.PoseGoal(fr3.robot, TIP, pose))
    with pytest.warns(RuntimeWarning, match="it takes 4e.03 s and .* times in milliseconds"):
        made.set_trajectory([fr3.neutral, fr3.neutral + 0.3], [0.0, 4000.0])
    pose[:3, 3] = 2.0, 0.0, 0.5  # out of reach, by metres
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        made.set_goal(ss.PoseGoal(fr3.robot, TIP, pose))
        made.set_trajectory([fr3.neutral, fr3.neutral + 0.3], [0.0, 60.0])
    assert made.questions == []


def test_the_newest_question_is_told(fr3: ss.Arm) -> None:
    made = controller(fr3)
    with pytest.warns(RuntimeWarning):
        made.set_velocity(np.full(7, 90.0))
    with pytest.warns(RuntimeWarning):
        made.set_obstacles([ss.Sphere(0.1, pose_at([60.0, 0.0, 0.0]), name="far")])
    made.step(fr3.neutral, np.zeros(7))
    assert [words.split()[0] for words in made.questions] == ["velocity", "obstacles:"]
    assert made.explain().count("check the units") == 1
    assert "'far'" in made.explain()
    made.set_obstacles(ss.Obstacles.none())
    assert [words.split()[0] for words in made.questions] == ["velocity"]


@pytest.mark.parametrize("output", ["torque", "acceleration", "velocity", "position"])
def test_a_state_in_degrees_moves_nothing(fr3: ss.Arm, output: str) -> None:
    made = controller(fr3, output=output)
    made.set_obstacles(ss.Obstacles.none())
    made.set_goal(fr3.neutral)
    for _ in range(5):
        command = made.step(DEGREES, np.zeros(7))
        assert command.status == ss.SafetyStatus.stopping
        np.testing.assert_array_equal(command.acceleration, 0.0)
        np.testing.assert_array_equal(command.velocity, 0.0)
        assert np.isnan(command.position).all()  # as long as no state was known
    limits = r"its limits are -1\.78 and 1\.78 rad; in degrees\?"
    said = f"braking to a stop: joint 'fr3_joint2' is measured at -45 rad, {limits}"
    assert re.fullmatch(said, made.explain())
    assert made.step(np.radians(DEGREES), np.zeros(7)).status <= ss.SafetyStatus.limited
    assert "degrees" not in made.explain()


def test_a_velocity_in_degrees_per_second_moves_nothing_either(fr3: ss.Arm) -> None:
    made = controller(fr3)
    made.set_obstacles(ss.Obstacles.none())
    v = np.array([0.0, 60.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    command = made.step(fr3.neutral, v)
    assert command.status == ss.SafetyStatus.stopping
    assert (
        "joint 'fr3_joint2' is measured at 60 rad/s, its limit is 2.62 rad/s; in degrees?" in made.explain()
    )


def test_an_arm_a_little_outside_its_limits_is_led_back(fr3: ss.Arm) -> None:
    """Soft limits are moved inwards; the arm stands outside of them and goes back."""
    made = controller(fr3)
    made.set_obstacles(ss.Obstacles.none())
    made.set_goal(fr3.neutral)
    q = fr3.neutral.copy()
    q[1] = fr3.robot.limits.upper[1] + 0.3
    assert made.step(q, np.zeros(7)).status < ss.SafetyStatus.stopping


def test_what_looks_like_degrees() -> None:
    looks = [looks_like_degrees(angle) for angle in (90.0, -45.0, 10.0, 1080.0)]
    assert looks == [True, True, True, True]
    plain = (3.0 * np.pi, 4.0 * np.pi, 20.0 * np.pi, 0.5, 1081.0, np.inf, np.nan)
    assert not any(looks_like_degrees(angle) for angle in plain)


def test_a_state_in_another_order_of_joints_moves_nothing_and_says_so(fr3: ss.Arm) -> None:
    c = controller(fr3)
    c.set_goal(fr3.neutral)
    swapped = fr3.neutral[[0, 1, 2, 5, 4, 3, 6]]
    command = c.step(swapped, np.zeros(7))
    assert command.status == ss.SafetyStatus.stopping
    np.testing.assert_array_equal(command.acceleration, np.zeros(7))
    assert "joint 'fr3_joint4' is measured at" in c.explain()
    assert c.explain().endswith("are the joints in another order? It could be that of 'fr3_joint6'")
