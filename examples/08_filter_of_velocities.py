"""A filter of velocities: whatever velocity you send, the arm avoids the ball; without new ones it stops.

No goal is needed. The arm slides along obstacles; each velocity is valid for `inputs.timeout`, 0.25 s.
"""

import sidestep as ss

controller = ss.Controller(arm := ss.Arm.load("fr3"), ss.ControllerSettings(synchronous=True))
controller.set_obstacles(ss.Obstacles([[0.3, 0.55, 0.6]], radii=0.1))
q, v, least = arm.neutral, 0.0 * arm.neutral, 1.0
for _ in range(4000):
    controller.set_velocity([0.5, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0])  # at any rate, from any thread
    command = controller.step(q, v)  # command.torque goes to an arm
    q, v, least = command.position, command.velocity, min(least, command.clearance)
print(f"{controller.explain()}; clearance at least {1e3 * least:.1f} mm")
