"""A trajectory, of a policy or another planner: kept to, and waited on while something blocks it."""

import numpy as np

import sidestep as ss

controller = ss.Controller(arm := ss.Arm.load("fr3"), ss.ControllerSettings(synchronous=True))
controller.set_obstacles(ss.Obstacles.none())  # the space is free
times = np.linspace(0.0, 2.0, 41)  # 20 Hz
chunk = arm.neutral + np.outer(0.5 - 0.5 * np.cos(np.pi * times / 2.0), [0.6, 0.2, 0.0, 0.3, 0.0, 0.0, 0.0])
controller.set_trajectory(chunk, times)  # or behaviour="steer": around what is in the way
q, v, most = arm.neutral, 0.0 * arm.neutral, 0.0
while (command := controller.step(q, v)).activity != ss.Activity.arrived:  # command.torque goes to an arm
    q, v, most = command.position, command.velocity, max(most, command.deviation)
print(f"{controller.explain()}, {command.delay:.2f} s late, at most {1e3 * most:.2f} mrad off its path")
