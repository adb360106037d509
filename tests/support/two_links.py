"""A planar arm of two links, of balls or with a box, and what is in its way."""

import numpy as np

import sidestep as ss
from sidestep.obstacles import pose_at

PLANAR = """<robot name="two">
  <link name="base"/>
  <link name="l1"><collision><origin xyz="0.15 0 0"/><geometry><sphere radius="0.05"/></geometry></collision></link>
  <link name="l2"><collision><origin xyz="0.15 0 0"/><geometry><sphere radius="0.04"/></geometry></collision></link>
  <joint name="j1" type="revolute"><parent link="base"/><child link="l1"/><axis xyz="0 0 1"/>
    <limit lower="-2" upper="2" velocity="2" effort="50"/></joint>
  <joint name="j2" type="revolute"><origin xyz="0.3 0 0"/><parent link="l1"/><child link="l2"/><axis xyz="0 0 1"/>
    <limit lower="-2" upper="2" velocity="2" effort="50"/></joint>
</robot>"""

BOX = PLANAR.replace(
    '<origin xyz="0.15 0 0"/><geometry><sphere radius="0.04"/></geometry>',
    '<origin xyz="0.2 0 0"/><geometry><box size="0.3 0.08 0.08"/></geometry>',
)


def beside(robot: ss.Robot, goal: np.ndarray, gap: float) -> ss.Sphere:
    """A ball that leaves a gap [m] to the flat side of the box at the goal."""
    X = robot.pose(goal, "l2")
    return ss.Sphere(0.02, pose_at(X[:3, 3] + X[:3, :3] @ [0.2, 0.04 + 0.02 + gap, 0.0]), name="ball")
