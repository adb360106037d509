"""Torque control in MuJoCo.

The whole chain on a Franka Research 3: the controller's torque within every limit, rigid-body physics with the real
meshes, 1 kHz. The run is judged afterwards by exact clearance and by MuJoCo's contacts.
"""

import numpy as np

import sidestep as ss

arm = ss.Arm.load("fr3_arm")
start = np.deg2rad([0, 45, 0, -66, 0, 66, 45])
goal = np.deg2rad([60, 45, 0, -66, 0, 66, 45])

# A ball beside the hand's way. What the controller sees is one point with the ball's radius.
pose = np.eye(4)
pose[:3, 3] = 0.55, 0.32, 0.72
scene = [ss.SceneObject("ball", "sphere", (0.05,), pose=pose)]
seen = ss.Obstacles([pose[:3, 3]], radii=0.05)

controller = ss.Controller(arm, ss.ControllerSettings(synchronous=True))  # the same motion every time
controller.set_goal(goal)
driver = ss.ControllerAdapter(controller, seen)
run = ss.Simulation(arm.robot, scene).run(driver, start, goal, 8.0)

found = ss.evaluate(run)
print(
    f"reached: {found.reached}, after {found.time_to_goal_s:.2f} s, error {found.position_error_rad:.4f} rad"
)
print(
    f"contacts: {found.contacts}, smallest clearance {found.min_clearance_m:.3f} m ({found.clearance_pair})"
)
print(f"largest torque over its limit: {found.max_torque_ratio:.2f}")
print(f"limits kept: {not found.limits.any}")
print(f"largest error of the model: {found.max_model_error:.2e} rad/s^2")
