"""Ways to a goal of joints that turn without limits."""

import numpy as np
import pytest

import sidestep as ss
from sidestep.bench.motion import Columns, MotionSettings
from sidestep.bench.problems import ReachProblem
from sidestep.robot.turns import ways_to

TEXT = """<robot name="mixed"><link name="a"/><link name="b"/><link name="c"/><link name="d"/>
  <joint name="free" type="continuous"><parent link="a"/><child link="b"/><limit velocity="1" effort="1"/></joint>
  <joint name="held" type="revolute"><parent link="b"/><child link="c"/>
    <limit lower="-7" upper="7" velocity="1" effort="1"/></joint>
  <joint name="slide" type="prismatic"><parent link="c"/><child link="d"/>
    <limit lower="-9" upper="9" velocity="1" effort="1"/></joint></robot>"""


def test_a_turn_more_is_the_same_place_for_joints_without_limits_alone():
    robot = ss.Robot.from_urdf(TEXT)
    turn = 2.0 * np.pi
    q = np.array([[0.1, 0.2, 0.3], [0.1 + turn, 0.2 + turn, 0.3 + turn], [-3.0 * turn + 0.4, 0.2, 0.0]])
    expected = [[0.0, 0.0, 0.0], [0.0, turn, turn], [0.3, 0.0, 0.3]]
    assert ways_to(robot, q, [0.1, 0.2, 0.3]) == pytest.approx(np.array(expected), abs=1e-12)
    assert ways_to(robot, [3.1, 0.0, 0.0], [-3.1, 0.0, 0.0])[0] == pytest.approx(turn - 6.2)


def test_benchmarks_count_the_nearest_turn_as_arrived():
    robot = ss.Robot.from_urdf(TEXT)
    nothing = np.zeros((0, 3))
    goal = np.array([3.0, 0.0, 0.0])
    problem = ReachProblem("mixed", 0, 0, np.zeros(3), goal, nothing, nothing, np.zeros(0), False)
    columns = Columns(robot, problem, MotionSettings())
    assert columns.near(np.array([[3.0 - 2.0 * np.pi, 0.0, 0.0], [0.0, 0.0, 0.0]])).tolist() == [True, False]
