"""The README's first picture: the controller moves round a table while a ball chases the hand, by torque in MuJoCo.

MuJoCo draws it too. `python docs/images/make.py table` takes minutes, and prints contacts and the least clearance of
the exact meshes.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
from PIL import Image

import sidestep as ss
from sidestep.drawing.palette import BLUE, GREEN, ORANGE, SKY, VERMILLION, YELLOW
from sidestep.obstacles import pose_at
from sidestep.simulation import build_model

TARGET = Path(__file__).parent / "table.webp"
SECONDS, FRAMES_PER_SECOND = 6.0, 20
SIZE = 640, 400  # [px]
FASTEST = 0.42  # [m/s] of the ball
BACK = 0.75  # [m/s] on its way home
RADIUS = 0.06  # [m] of the ball
REST = np.array([0.35, -0.75, 0.75])  # where the ball begins and ends [m]
HOME = np.array([-0.7, -0.2, 0.0, -2.2, 0.0, 2.0, 0.785])  # start and end of the arm [rad]
PLACES = (0.55, 0.27, 0.34), (0.72, -0.32, 0.44), (0.38, 0.42, 0.42)  # of the hand's tip, pointing down [m]
FLOOR = 0.62, 0.68, 0.74, 1.0  # its colour: the arm is white
DOWN = np.diag([1.0, -1.0, -1.0])  # of the hand
CHANGES = 0.0, 1.7, 2.9, 3.8  # [s] at which the next goal is told
CHASE_ENDS = 3.5  # [s] from when on the ball goes back


def things() -> list[tuple[ss.SceneObject, str]]:
    """What stands there, with its colour. The table's top is at z = 0.2 m."""

    def at(x: float, y: float, z: float) -> np.ndarray:
        return pose_at([x, y, z])

    return [
        (ss.SceneObject("table", "box", (0.75, 1.5, 0.04), pose=at(0.68, 0.0, 0.18)), "#C9B79C"),
        (ss.SceneObject("shelf", "box", (0.14, 0.1, 0.42), pose=at(0.58, 0.0, 0.41)), BLUE),
        (ss.SceneObject("can", "cylinder", (0.05, 0.2), pose=at(0.5, 0.48, 0.3)), ORANGE),
        (ss.SceneObject("parcel", "box", (0.2, 0.16, 0.14), pose=at(0.75, -0.32, 0.27)), SKY),
        (ss.SceneObject("cup", "cylinder", (0.04, 0.12), pose=at(0.48, -0.25, 0.26)), YELLOW),
    ]


def goals(robot: ss.Robot) -> list[ss.PoseGoal | np.ndarray]:
    """To the other side of the shelf, above the parcel, beside the can, and home."""
    return [*(ss.PoseGoal(robot, "fr3_hand_tcp", pose_at(place, DOWN)) for place in PLACES), HOME]


def chase(ball: np.ndarray, hand: np.ndarray, time: float) -> np.ndarray:
    """The velocity of the ball: to the hand, as fast as it may, and back in the end."""
    way = (hand if time < CHASE_ENDS else REST) - ball
    distance = float(np.linalg.norm(way))
    return way * min(FASTEST if time < CHASE_ENDS else BACK, 4.0 * distance) / max(distance, 1e-9)


def motion() -> Iterator[tuple[float, Any, Any, np.ndarray, np.ndarray, int]]:
    """The run: after each period time, built model, data, joint positions, place of the ball, contacts so far."""
    arm, robot, scene = ss.Arm.load("fr3"), ss.Robot.named("fr3"), [item for item, _ in things()]
    moving = ss.SceneObject("ball", "sphere", (RADIUS,), pose=pose_at(REST), motion="moving")
    built = build_model(robot, [*scene, moving], timestep=1e-3, floor_height=-0.01)
    data = mujoco.MjData(built.model)
    built.set_state(data, HOME, np.zeros(7))
    mocap = int(built.model.body_mocapid[built.object_bodies[-1]])
    solids = [
        ss.Cylinder(*item.size, item.pose, name=item.name)
        if item.kind == "cylinder"
        else ss.Box(item.size, item.pose, name=item.name)
        for item in scene
    ]
    controller = ss.Controller(arm, ss.ControllerSettings(synchronous=True))
    ball, contacts, queue = REST.copy(), 0, list(zip(CHANGES, goals(robot), strict=True))
    for k in range(round(SECONDS / 1e-3)):
        time = 1e-3 * k
        q, v = built.state(data)
        hand = robot.pose(q, "fr3_hand_tcp")[:3, 3]
        velocity = chase(ball, hand, time)
        if k % 20 == 0:  # a tracker at 50 Hz
            seen = ss.Obstacles([ball], radii=RADIUS, velocities=[velocity])
            controller.set_obstacles([*solids, seen])
        if queue and time >= queue[0][0]:
            controller.set_goal(queue.pop(0)[1])
        data.mocap_pos[mocap] = ball
        mujoco.mj_step1(built.model, data)
        command = controller.step(q, v, built.mass_matrix(data), built.bias(data))
        data.ctrl[built.actuators] = command.torque
        mujoco.mj_step2(built.model, data)
        owners = [
            {built.geom_owner[int(g)][0] for g in c.geom} for c in data.contact[: data.ncon] if c.dist < 0
        ]
        contacts += sum("link" in pair for pair in owners)
        ball = ball + 1e-3 * velocity
        yield time, built, data, q, ball, contacts


def colour(text: str) -> list[float]:
    return [int(text[k : k + 2], 16) / 255 for k in (1, 3, 5)] + [1.0]


def dress(built: Any) -> None:
    """Colours and light."""
    model = built.model
    paint = {item.name: text for item, text in things()} | {"ball": VERMILLION}
    for geom, (kind, name) in built.geom_owner.items():
        if kind == "object":
            model.geom_rgba[geom] = colour(paint[name])
    model.vis.global_.offwidth, model.vis.global_.offheight = SIZE
    floor = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_GEOM, "floor")
    model.geom_size[floor][:2] = 0.0  # without an end
    model.geom_rgba[floor] = FLOOR
    model.vis.headlight.ambient[:] = 0.45
    model.vis.headlight.diffuse[:] = 0.45
    model.vis.quality.shadowsize = 4096


def dots(scene: Any, places: list[np.ndarray], goal: np.ndarray) -> None:
    """The way of the hand behind it, and its goal."""
    for place, size, text, alpha in [
        *((place, 0.006, BLUE, 0.15 + 0.7 * k / max(len(places), 1)) for k, place in enumerate(places)),
        (goal, 0.02, GREEN, 0.9),
    ]:
        if scene.ngeom < scene.maxgeom:
            rgba = np.array([*colour(text)[:3], alpha], dtype=np.float32)
            sphere = mujoco.mjtGeom.mjGEOM_SPHERE
            mujoco.mjv_initGeom(
                scene.geoms[scene.ngeom], sphere, np.full(3, size), place, np.eye(3).ravel(), rgba
            )
            scene.ngeom += 1


def table() -> None:
    """Runs it, draws it, and says what was touched."""
    robot = ss.Robot.named("fr3")
    camera = mujoco.MjvCamera()
    camera.lookat[:], camera.distance, camera.azimuth, camera.elevation = (
        (0.38, -0.03, 0.5),
        2.05,
        125.0,
        -25.0,
    )
    frames, hands, path, balls = [], [], [], []
    renderer, every = None, round(1e3 / FRAMES_PER_SECOND)
    aims = [*map(np.array, PLACES), robot.pose(HOME, "fr3_hand_tcp")[:3, 3]]
    contacts = 0
    for k, (time, built, data, q, ball, touched) in enumerate(motion()):
        contacts = touched
        path.append(q)
        balls.append(ball)
        if k % 10 == 0:
            hands.append(robot.pose(q, "fr3_hand_tcp")[:3, 3])
        if k % every == 0:
            if renderer is None:
                dress(built)
                renderer = mujoco.Renderer(built.model, SIZE[1], SIZE[0])
            mujoco.mj_forward(built.model, data)
            renderer.update_scene(data, camera)
            now = max(n for n, at in enumerate(CHANGES) if time >= at)
            dots(renderer.scene, hands[-80::2], aims[now])
            frames.append(Image.fromarray(renderer.render().copy()))
    frames[0].save(
        TARGET,
        save_all=True,
        append_images=frames[1:],
        duration=1000 // FRAMES_PER_SECOND,
        loop=0,
        quality=62,
        method=6,
    )
    fixed = ss.ExactClearance(robot, [item for item, _ in things()]).minimum_over(np.array(path[::5]))
    moving = ss.ExactClearance(robot, [ss.SceneObject("ball", "sphere", (RADIUS,))])
    poses = np.hstack([np.array(balls[::5]), np.tile([1.0, 0, 0, 0], (len(balls[::5]), 1))])[:, None]
    nearest = moving.minimum_over(np.array(path[::5]), poses).clearance.distance
    print(f"{TARGET.name}: {TARGET.stat().st_size / 1e6:.2f} MB, {contacts} contacts in MuJoCo")
    print(
        f"least clearance: {1e3 * fixed.clearance.distance:.0f} mm to what stands, {1e3 * nearest:.0f} mm to the ball"
    )
    print(f"end: {np.abs(path[-1] - HOME).max():.3f} rad from the start")
