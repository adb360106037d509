"""Teleoperation: the twist of the hand, 0.1 m/s along y and a turn about the vertical."""

import numpy as np

import sidestep as ss

controller = ss.Controller(arm := ss.Arm.load("fr3"), ss.ControllerSettings(synchronous=True))
controller.set_obstacles(ss.Obstacles.none())  # the space is free
q, v = arm.neutral, 0.0 * arm.neutral
for _ in range(1000):
    controller.set_twist(
        "fr3_hand_tcp", [0.0, 0.1, 0.0, 0.0, 0.0, 0.2]
    )  # of the world; local=True: the hand's
    command = controller.step(q, v)  # command.torque goes to an arm
    q, v = command.position, command.velocity
print("twist of the hand", np.round(arm.robot.jacobian(q, "fr3_hand_tcp") @ v, 3))
