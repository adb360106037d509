"""Reach around an obstacle.

A damped spring pulls a planar arm to its goal; the straight way there, in joint space, goes through a ball.
On the graph of psi the same spring goes around. The same program in C++:
examples/cpp/03_reach_around_an_obstacle.cpp.
"""

import numpy as np

import sidestep as ss
from sidestep import thesis
from sidestep.system import GeometricSystem

LENGTH, WIDTH = 0.5, 0.08  # [m] of a link
robot = ss.Robot.named("planar3")
variances = np.array([LENGTH**2, WIDTH**2, WIDTH**2]) / 12  # second moments of a box
body = ss.Body(
    links=["link1", "link2", "link3"],
    weights=np.ones(3),
    means=np.tile([LENGTH / 2, 0.0, 0.0], (3, 1)),
    covariances=np.tile(np.diag(variances), (3, 1, 1)),
)
ball = ss.Obstacles([[0.91, 0.76, 0.0]], radii=0.05)
start, goal = np.array([1.5, -0.6, 0.3]), np.array([-0.9, 1.2, 1.4])

system = GeometricSystem([thesis.CollisionDensity(robot, body)], stiffness=2.0, damping=3.0)
motion = thesis.rollout(system, start, np.zeros(3), goal, ball, steps=12000, integrator="second_order")
for k in range(2000, 12001, 2000):
    print(f"t = {motion.time[k]:4.1f} s   q = {motion.q[k].round(5)}")
print(f"joint error {np.abs(motion.q[-1] - goal).max():.6f} rad")

# Judged by exact distances between link meshes and ball, never by the Gaussians.
scene = [ss.SceneObject("ball", "sphere", (0.05,), pose=np.block([[np.eye(3), ball.points.T], [0, 0, 0, 1]]))]
exact = ss.ExactClearance(robot, scene)
straight = start + np.linspace(0, 1, 2)[:, None] * (goal - start)
for name, path in ("straight line", straight), ("around", motion.q):
    print(f"{name}: smallest clearance {exact.minimum_over(path).clearance.distance:.3f} m")
