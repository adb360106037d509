"""Torque for an arm that is not as its model: dry friction of 1 Nm and rotors, which the controller finds out about."""

import numpy as np

import sidestep as ss

controller = ss.Controller(arm := ss.Arm.load("fr3"), ss.ControllerSettings(synchronous=True))
controller.set_obstacles(ss.Obstacles.none())  # the space is free
controller.set_goal(arm.neutral + 0.3)
q, v = arm.neutral, 0.0 * arm.neutral
while (command := controller.step(q, v)).activity != ss.Activity.arrived:
    force = command.torque - arm.bias(q, v) - np.tanh(v / 0.01)  # command.torque goes to an arm
    v = v + 0.001 * np.linalg.solve(arm.mass_matrix(q) + 0.1 * np.eye(7), force)
    q = q + 0.001 * v
print(f"{controller.explain()}; rotors up to {command.rotors.max():.3f} kg m2")
