"""The controller: an arm by the path of its URDF, a goal, an obstacle, a loop at 1 kHz.

Run it in the folder above. A description is prepared on first use and kept; the cover of this one comes with Sidestep.
Here an ideal robot tracks the command exactly. To a real arm you send `command.torque`.
"""

import sidestep as ss

controller = ss.Controller(arm := ss.Arm.load("examples/planar3.urdf"))
controller.set_goal([1.2, 0.4, 0.3])
controller.set_obstacles(ss.Obstacles([[1.0, 0.5, 0.0]], radii=0.05))
q, v = arm.neutral, 0.0 * arm.neutral
while (command := controller.step(q, v)).activity != ss.Activity.arrived:
    q, v = command.position, command.velocity
print(f"{controller.explain()}, torque there up to {abs(command.torque).max():.6f} Nm")
