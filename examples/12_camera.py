"""Torque at 1 kHz among what a depth camera sees: nobody tells of the box. Physics and camera in MuJoCo."""

import mujoco
import numpy as np

import sidestep as ss
from sidestep.obstacles import pose_at
from sidestep.perception import DepthCamera, Perception, look_at
from sidestep.simulation import SimulatedCamera, build_model

arm, X_WC = ss.Arm.load("fr3"), look_at([1.8, 0.6, 1.0], [0.3, 0.0, 0.4])  # the camera and what it looks at
box = ss.SceneObject("box", "box", (0.2, 0.1, 0.5), pose=pose_at([0.5, 0.0, 0.25]))
model = build_model(arm.robot, [box])
data = mujoco.MjData(model.model)
model.set_state(data, np.array([0.7, -0.785, 0.0, -2.356, 0.0, 1.571, 0.785]), np.zeros(7))

camera = DepthCamera("front", width=424, height=240, fx=210, fy=210, cx=211.5, cy=119.5, pose=X_WC)
device = SimulatedCamera(model, camera, noise="d435", latency=0.05)  # 30 images a second, 50 ms late
controller = ss.Controller(arm, ss.ControllerSettings(synchronous=True))
perception = Perception(controller, [camera])
controller.set_goal(ss.PoseGoal(arm.robot, "fr3_hand_tcp", pose_at([0.45, -0.3, 0.3], xyzw=[1, 0, 0, 0])))
touched = 0
while (command := controller.step(*model.state(data), time=data.time)).activity != ss.Activity.arrived:
    for image in device.observe(data, data.time):
        perception.update(image.camera, image.depth, time=image.time)
    data.ctrl[model.actuators] = command.torque
    mujoco.mj_step(model.model, data)
    touched += data.ncon
print(f"{command.activity.name} after {data.time:.1f} s, contacts: {touched}")
