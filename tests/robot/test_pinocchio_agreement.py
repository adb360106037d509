"""Kinematics and dynamics against Pinocchio's own URDF parser, which shares no code with ours."""

import xml.etree.ElementTree as ElementTree
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
import xacro

import sidestep as ss
from sidestep.robot import Robot
from sidestep.robot.catalogue import RECIPES, recipe

NUM_STATES = 100
# Poses, Jacobians and forces here are below 1e3 in SI units, so rounding over ten joints stays below 1e-11;
# anything that is modelled differently shows at 1e-5 or more.
TOLERANCE = 1e-9

EVERY_JOINT = Path(__file__).parent / "every_joint.urdf"
BASE_POSE = np.array(pin.SE3(pin.rpy.rpyToMatrix(0.4, -0.3, 1.1), np.array([0.5, -0.6, 0.7])).homogeneous)


@dataclass
class Oracle:
    """Pinocchio's model of a URDF text, driven by the coordinates of a Robot.

    `follow` has joints without a coordinate of that name: joint -> (coordinate or None, multiplier, offset).
    """

    model: pin.Model
    coordinate_names: list[str]
    follow: dict[str, tuple[str | None, float, float]] = field(default_factory=dict)
    base_pose: np.ndarray = field(default_factory=lambda: np.eye(4))

    def __post_init__(self) -> None:
        self.data = self.model.createData()
        self.model.gravity.linear = self.base_pose[:3, :3].T @ self.model.gravity.linear
        self.selection = np.zeros((self.model.nv, len(self.coordinate_names)))
        self.offset = np.zeros(self.model.nv)
        for index, joint in enumerate(self.model.names[1:], start=1):
            source, multiplier, offset = self.follow.get(joint, (joint, 1.0, 0.0))
            row = self.model.joints[index].idx_v
            self.offset[row] = offset
            if source is not None:
                self.selection[row, self.coordinate_names.index(source)] = multiplier

    def configuration(self, q: np.ndarray) -> np.ndarray:
        angles = self.selection @ q + self.offset
        full = np.zeros(self.model.nq)
        for joint in list(self.model.joints)[1:]:
            angle = angles[joint.idx_v]
            if joint.nq == 2:  # Pinocchio stores a continuous joint as (cos, sin)
                full[joint.idx_q : joint.idx_q + 2] = np.cos(angle), np.sin(angle)
            else:
                full[joint.idx_q] = angle
        return full

    def kinematics(
        self, q: np.ndarray, v: np.ndarray, link: str
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Pose, Jacobian and classical acceleration at zero joint acceleration."""
        frame = self.model.getFrameId(link, pin.FrameType.BODY)
        aligned = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
        full, zero = self.configuration(q), np.zeros(self.model.nv)
        pin.forwardKinematics(self.model, self.data, full, self.selection @ v, zero)
        pin.computeJointJacobians(self.model, self.data, full)
        pin.updateFramePlacements(self.model, self.data)
        rotate = np.kron(np.eye(2), self.base_pose[:3, :3])
        pose = self.base_pose @ self.data.oMf[frame].homogeneous
        jacobian = rotate @ pin.getFrameJacobian(self.model, self.data, frame, aligned) @ self.selection
        acceleration = pin.getFrameClassicalAcceleration(self.model, self.data, frame, aligned).vector
        return pose, jacobian, rotate @ acceleration

    def dynamics(self, q: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        full = self.configuration(q)
        upper = np.triu(pin.crba(self.model, self.data, full))
        mass = upper + np.triu(upper, 1).T
        force = pin.rnea(self.model, self.data, full, self.selection @ v, np.zeros(self.model.nv))
        return self.selection.T @ mass @ self.selection, self.selection.T @ force


def named_oracle(name: str, robot: Robot) -> Oracle:
    item = recipe(name)
    source = item.source()
    text = source if isinstance(source, str) else xacro.process_file(str(source), mappings={}).toxml()
    if name == "fr3_arm":  # the oracle loses the hand by deleting its elements
        root = ElementTree.fromstring(text)
        for element in list(root):
            if "hand" in element.get("name", "") or "finger" in element.get("name", ""):
                root.remove(element)
        text = ElementTree.tostring(root, encoding="unicode")
    model = pin.buildModelFromXML(text.encode().decode("ascii", "ignore"))
    locked = {
        "fr3": {"fr3_finger_joint1": 0.04, "fr3_finger_joint2": 0.04},
        "panda": {"panda_finger_joint1": 0.04, "panda_finger_joint2": 0.04},
        "z1": {"jointGripper": 0.0},
    }.get(name, {})
    return Oracle(
        model, robot.coordinate_names, {joint: (None, 0.0, value) for joint, value in locked.items()}
    )


def every_joint() -> tuple[Robot, Oracle]:
    robot = Robot.from_urdf(EVERY_JOINT, base_pose=BASE_POSE, locked={"held": 0.6})
    follow = {
        "wrist": ("elbow", -0.7, 0.2),
        "finger": ("elbow", -0.035, 0.02),
        "held": (None, 0.0, 0.6),
        "follower": (None, 0.0, 1.1),
    }
    model = pin.buildModelFromUrdf(str(EVERY_JOINT))
    return robot, Oracle(model, robot.coordinate_names, follow, BASE_POSE)


@pytest.fixture(scope="module", params=[item.name for item in RECIPES] + ["every_joint"])
def pair(request: pytest.FixtureRequest) -> tuple[Robot, Oracle]:
    if request.param == "every_joint":
        return every_joint()
    robot = Robot.named(request.param)
    return robot, named_oracle(request.param, robot)


def states(robot: Robot) -> list[tuple[np.ndarray, np.ndarray]]:
    rng = np.random.default_rng(0)
    speed = robot.limits.velocity
    return [(robot.random_configuration(rng), rng.uniform(-speed, speed)) for _ in range(NUM_STATES)]


@pytest.mark.slow
def test_poses_jacobians_and_bias_accelerations(pair: tuple[Robot, Oracle]) -> None:
    robot, oracle = pair
    for q, v in states(robot):
        for link in robot.links:
            pose, jacobian, acceleration = oracle.kinematics(q, v, link.name)
            np.testing.assert_allclose(robot.pose(q, link.name), pose, rtol=0, atol=TOLERANCE)
            np.testing.assert_allclose(robot.jacobian(q, link.name), jacobian, rtol=0, atol=TOLERANCE)
            bias = robot.bias_acceleration(q, v, link.name)
            np.testing.assert_allclose(bias, acceleration, rtol=0, atol=TOLERANCE)


def test_mass_matrix_and_bias_force(pair: tuple[Robot, Oracle]) -> None:
    robot, oracle = pair
    for q, v in states(robot):
        mass, force = oracle.dynamics(q, v)
        np.testing.assert_allclose(robot.mass_matrix(q), mass, rtol=0, atol=TOLERANCE)
        np.testing.assert_allclose(robot.bias(q, v), force, rtol=0, atol=TOLERANCE)


def test_frames_and_limits(pair: tuple[Robot, Oracle]) -> None:
    robot, oracle = pair
    bodies = {frame.name for frame in oracle.model.frames if frame.type == pin.FrameType.BODY}
    assert {link.name for link in robot.links} == bodies
    assert [frame.name for frame in robot.frames] == [link.name for link in robot.links]
    for i, name in enumerate(robot.coordinate_names):
        joint = oracle.model.joints[oracle.model.getJointId(name)]
        if joint.nq == 1:
            assert robot.limits.lower[i] == oracle.model.lowerPositionLimit[joint.idx_q]
            assert robot.limits.upper[i] == oracle.model.upperPositionLimit[joint.idx_q]
        if robot.name != "iiwa":  # whose placeholders the catalogue replaces
            assert robot.limits.velocity[i] == oracle.model.velocityLimit[joint.idx_v]
            assert robot.limits.effort[i] == oracle.model.effortLimit[joint.idx_v]


@pytest.mark.parametrize("name", ["fr3_arm", "ur5"])
def test_torque_without_gravity_lacks_the_gravity_of_pinocchio(name: str) -> None:
    """At velocities too, where the bias has more than gravity."""
    arm = ss.Arm.load(name)
    oracle = named_oracle(name, Robot.named(name))
    for q, v in states(arm.robot)[:20]:
        settings = ss.ControllerSettings(synchronous=True, planner=None, look_ahead=None, output="torque")
        command = ss.Controller(arm, settings).step(q, 0.1 * v)
        expected = pin.computeGeneralizedGravity(oracle.model, oracle.data, oracle.configuration(q))
        np.testing.assert_allclose(
            command.torque - command.torque_without_gravity, oracle.selection.T @ expected, atol=TOLERANCE
        )
