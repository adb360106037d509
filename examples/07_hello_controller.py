"""The controller: an arm, a goal, an obstacle, a loop at 1 kHz.

Here a model takes the acceleration; an arm is sent `command.torque`.
"""

import numpy as np

import sidestep as ss

arm = ss.Arm.load("fr3")  # or a URDF, xacro or .arm file
controller = ss.Controller(arm)
controller.set_goal(arm.neutral + 0.3)
controller.set_obstacles(ss.Obstacles([[0.6, 0.3, 0.6]], radii=0.05))
q, v, steps = arm.neutral, np.zeros(arm.num_coordinates), 0
while (command := controller.step(q, v)).activity != ss.Activity.arrived and steps < 10000:
    q, v, steps = command.position, command.velocity, steps + 1
print(f"{controller.explain()}, largest torque {np.abs(command.torque).max():.0f} Nm")
