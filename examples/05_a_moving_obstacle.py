"""A moving obstacle.

Points carry velocities, and the second derivative of psi along the motion contains them: also for an arm at
rest. This is checked against finite differences in time; then the arm of example 03 passes a ball that
moves.
"""

import numpy as np

import sidestep as ss
from sidestep import thesis
from sidestep.system import GeometricSystem

robot = ss.Robot.named("planar3")
body = ss.Body.fit(robot, components=1, seed=0)
psi = thesis.CollisionDensity(robot, body)
position, velocity = np.array([1.0, 0.7, 0.0]), np.array([-0.03, 0.02, 0.0])
start, goal = np.array([1.5, -0.6, 0.3]), np.array([-0.9, 1.2, 1.4])
rest = np.zeros(3)


def ball(time: float) -> ss.Obstacles:
    return ss.Obstacles([position + time * velocity], radii=0.05, velocities=[velocity])


near = np.array([0.9, -0.2, 0.0])
curvature = psi.evaluate(near, rest, ball(0.0)).curvatures[0]
h = 0.05  # [s]
around = [psi.evaluate(near, rest, ball(k * h)).values[0] for k in (-2, -1, 0, 1, 2)]
difference = np.dot([-1, 16, -30, 16, -1], around) / (12 * h * h)
print(f"d2psi/dt2 of an arm at rest: {curvature:.6f}, by finite differences {difference:.6f}")

system = GeometricSystem([psi], stiffness=2.0, damping=3.0)
motion = thesis.rollout(system, start, rest, goal, ball(0.0), steps=10000)
print(f"joint error {np.abs(motion.q[-1] - goal).max():.4f} rad")

pose = np.eye(4)
pose[:3, 3] = position
exact = ss.ExactClearance(robot, [ss.SceneObject("ball", "sphere", (0.05,), pose=pose)])
at = position + motion.time[:, None] * velocity
poses = np.hstack([at, np.tile([1.0, 0.0, 0.0, 0.0], (len(at), 1))])[:, None]
print(f"smallest clearance {exact.minimum_over(motion.q, poses).clearance.distance:.3f} m")
