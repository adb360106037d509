"""Load a robot and fit its body.

A robot comes from a URDF, or by name. Its body is a mixture of Gaussians per link, fitted to points on the
link's collision mesh; it is what obstacles are compared with. Fits are cached by content.
"""

import numpy as np

import sidestep as ss

robot = ss.Robot.named("fr3_arm")  # or ss.Robot.from_urdf("arm.urdf", package_dirs=[...])
print(f"{robot.name}: {robot.num_coordinates} joints, {len(robot.links)} links")
print("position limits [rad]:", np.round(robot.limits.upper, 2))

tip = robot.pose(robot.neutral, robot.links[-1].name)
print("tip at", np.round(tip[:3, 3], 3), "m")

body = ss.Body.fit(robot, components=4, seed=0)  # components="bic" chooses a number per link
for link in dict.fromkeys(body.links):
    print(f"{link}: {body.links.count(link)} Gaussians")
print(f"in all: {body.num_components} Gaussians")
