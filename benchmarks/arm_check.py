"""What benchmarks/arms.py asks of one file, each in a process that may crash or hang.

`check` loads it and compares its kinematics; `prepare` prepares it and runs problems.
"""

from __future__ import annotations

import inspect
import os
import re
import time
import warnings
import xml.etree.ElementTree as ElementTree
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

import sidestep as ss
from sidestep.robot.mjcf import is_mjcf
from sidestep.robot.source import read_description

Array = npt.NDArray[np.float64]

STATES = 5  # random configurations at which frames are compared
ARM_JOINTS = 4  # of a chain from the base to a tip that counts as an arm

STILL = "not an arm: no moving joint"

# What errors say, and the cause under which they are counted; the first that fits.
CAUSES = (
    (STILL, r"no movable joint left|no body that moves by a hinge"),
    ("mesh file broken or empty", r"which is (?:empty|truncated)|which holds no triangles"),
    ("mesh file is a Git LFS pointer", r"Git LFS pointer"),
    ("missing file of an MJCF", r"is refused by MuJoCo: .*opening file"),
    ("refused by MuJoCo itself", r"is refused by MuJoCo"),
    ("xacro macros only", r"calls none"),
    ("xacro: package not found", r"\$\(find "),
    ("xacro: argument not given", r"Undefined substitution argument|XacroException.*arg"),
    ("xacro: another failure", r"xacro expansion failed"),
    ("missing mesh", r"refers to .*which does not exist"),
    ("not well-formed XML", r"not well-formed XML|is not .* text \(byte"),
    ("several root links", r"several root links"),
    ("another root element", r"the root element is"),
    ("no link", r"has no link"),
    ("loop of joints, or a link with two parents", r"hang on a loop|at most one parent"),
    ("link or joint that does not exist", r"does not exist"),
    ("joint type unknown", r"has type "),
    ("no <limit>", r"has no <limit>"),
    ("no number where one is needed", r"must be .*number"),
    ("defined twice", r"defined twice"),
)


def cause_of(error: BaseException) -> str:
    """Under what an error is counted."""
    message = str(error)
    for cause, pattern in CAUSES:
        if re.search(pattern, message, re.DOTALL):
            return cause
    return f"other: {type(error).__name__}"


def told(error: BaseException) -> str:
    """What an error says, without the folders of this machine that were searched."""
    return re.sub(r"; searched in: [^;\n]*", "", str(error))


def check(path: Path) -> dict[str, Any]:
    """Whether a file loads, what it is, and how far its frames are from those of MuJoCo or Pinocchio."""
    mjcf = is_mjcf(path)
    row: dict[str, Any] = {"format": "MJCF" if mjcf else "xacro" if path.suffix == ".xacro" else "URDF"}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            robot = ss.Robot.from_urdf(path)
        except Exception as error:  # whatever comes is the finding
            cause = cause_of(error)
            if path.suffix == ".xacro" and cause in ("no link", "link or joint that does not exist"):
                cause = "xacro: a part that another file includes"
            return {**row, "loads": False, "cause": cause, "message": told(error)}
        chains, longest = chains_of(robot)
        row |= {
            "loads": True,
            "robot": robot.name,
            "first_joint": robot.coordinate_names[0],
            "joints": robot.num_coordinates,
            "chains": chains,
            "longest": longest,
            "geometry": any(link.geometries for link in robot.links),
            "fingerprint": robot.fingerprint,
            "reference": "MuJoCo" if mjcf else "Pinocchio",
        }
        try:
            difference = mujoco_difference if mjcf else pinocchio_difference
            row["kinematics_error"] = difference(path, robot)
        except Exception as error:
            row["not_compared"] = f"{type(error).__name__}: {error}"
    return row


def chains_of(robot: ss.Robot) -> tuple[int, int]:
    """How many chains of at least `ARM_JOINTS` joints leave the base, fingers not counted apart; the longest."""
    depths: list[int] = []
    arms = 0
    for joint in robot.joints:
        own = robot.coordinate_names[joint.coordinate] == joint.name  # and mimics none
        depths.append((depths[joint.parent] if joint.parent >= 0 else 0) + own)
        arms += own and depths[-1] == ARM_JOINTS
    return arms, max(depths)


def pinocchio_difference(path: Path, robot: ss.Robot) -> float:
    """The largest difference [m | 1] of the pose of any link from Pinocchio's, which reads the file itself."""
    import pinocchio as pin

    try:
        if path.suffix == ".xacro" or b"<xacro:" in path.read_bytes():
            raise ValueError("Pinocchio reads no xacro")
        model = pin.buildModelFromUrdf(str(path))
    except ValueError:
        model = pin.buildModelFromXML(skeleton(path))
    data, rng, worst = model.createData(), np.random.default_rng(0), 0.0
    indices = {frame.name: model.getFrameId(frame.name, pin.FrameType.BODY) for frame in robot.frames}
    for _ in range(STATES):
        q = robot.random_configuration(rng)
        full = pin.neutral(model)
        values = {j.name: j.multiplier * q[j.coordinate] + j.offset for j in robot.joints}
        for name, value in (values | robot.held).items():
            joint = model.joints[model.getJointId(name)]
            if joint.nq == 2:  # Pinocchio stores a continuous joint as (cos, sin)
                full[joint.idx_q : joint.idx_q + 2] = np.cos(value), np.sin(value)
            else:
                full[joint.idx_q] = value
        pin.framesForwardKinematics(model, data, full)
        for name, index in indices.items():
            expected = data.oMf[index].homogeneous
            worst = max(worst, float(np.abs(robot.pose(q, name) - expected).max()))
    return worst


def skeleton(path: Path) -> str:
    """The links and joints of a description, for Pinocchio where it refuses what has nothing to do with kinematics."""
    root = read_description(path, package_dirs=(), xacro_arguments=None).root
    bare = ElementTree.Element("robot", name="skeleton")
    for link in root.findall("link"):
        ElementTree.SubElement(bare, "link", name=link.get("name", ""))
    for joint in root.findall("joint"):
        copy = ElementTree.SubElement(bare, "joint", name=joint.get("name", ""), type=joint.get("type", ""))
        if joint.get("type") in ("revolute", "prismatic"):
            ElementTree.SubElement(copy, "limit", lower="-1", upper="1", effort="1", velocity="1")
        for part in ("origin", "parent", "child", "axis"):
            for element in joint.findall(part):
                words = {key: value.replace(", ", " ") for key, value in element.attrib.items()}
                ElementTree.SubElement(copy, part, words)
    return ElementTree.tostring(bare, encoding="unicode")


def mujoco_difference(path: Path, robot: ss.Robot) -> float:
    """The largest difference [m | 1] of the pose of any body or site from MuJoCo's."""
    import mujoco

    from sidestep.robot.mjcf_joints import name_of

    if path.suffix == ".xml":
        spec = mujoco.MjSpec.from_file(str(path))
    else:  # MuJoCo reads a file by its suffix
        spec = mujoco.MjSpec.from_string(path.read_text(encoding="utf-8"))
        spec.modelfiledir = str(path.parent)
    spec.compiler.fusestatic = False  # bodies keep their names
    model = spec.compile()
    data, rng, worst = mujoco.MjData(model), np.random.default_rng(0), 0.0
    joints = {name_of(model, "joint", k): int(model.jnt_qposadr[k]) for k in range(model.njnt)}
    bodies = {name_of(model, "body", k): k for k in range(model.nbody)}
    sites = {model.site(k).name: k for k in range(model.nsite)}
    for _ in range(STATES):
        q = robot.random_configuration(rng)
        data.qpos[:] = model.qpos0
        for k in range(model.neq):  # joints that an equality holds
            if int(model.eq_type[k]) == int(mujoco.mjtEq.mjEQ_JOINT) and model.eq_obj2id[k] < 0:
                data.qpos[model.jnt_qposadr[model.eq_obj1id[k]]] += model.eq_data[k][0]
        for name, value in robot.held.items():
            data.qpos[joints[name]] = value
        for joint in robot.joints:
            data.qpos[joints[joint.name]] = joint.multiplier * q[joint.coordinate] + joint.offset
        mujoco.mj_kinematics(model, data)
        for frame in robot.frames:
            X = robot.pose(q, frame.name)
            if frame.name in bodies:
                position, rotation = data.xpos[bodies[frame.name]], data.xmat[bodies[frame.name]]
            elif frame.name in sites:
                position, rotation = data.site_xpos[sites[frame.name]], data.site_xmat[sites[frame.name]]
            else:  # between the joints of one body
                continue
            worst = max(worst, float(np.abs(X[:3, 3] - position).max()))
            worst = max(worst, float(np.abs(X[:3, :3] - rotation.reshape(3, 3)).max()))
    return worst


def prepare(path: Path, cache: Path, problems: int) -> dict[str, Any]:
    """Seconds until an arm is prepared with an empty cache, and what came of problems of `sidestep bench reach`."""
    draft = {"draft": True} if "draft" in inspect.signature(ss.Arm.load).parameters else {}
    os.environ["SIDESTEP_CACHE_DIR"] = str(cache)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        start = time.perf_counter()
        try:
            arm = ss.Arm.load(path, **draft)
        except Exception as error:
            return {"not_prepared": f"{type(error).__name__}: {error}"}
        row: dict[str, Any] = {"prepare_s": round(time.perf_counter() - start, 2), "draft": bool(draft)}
        if problems:
            try:
                row["reach"] = reach(arm, path, problems)
            except Exception as error:
                row["reach_failed"] = f"{type(error).__name__}: {error}"
    return row


def reach(arm: ss.Arm, path: Path, count: int) -> dict[str, Any]:
    """Counts over the first problems of seed 0."""
    from sidestep.bench.motion import ControllerRunner, MotionSettings
    from sidestep.bench.outcome import Judge
    from sidestep.bench.problems import ProblemGenerator, ProblemSettings
    from sidestep.distance import SelfCollision

    robot, settings = arm.robot, MotionSettings()
    assert isinstance(robot, ss.Robot)  # it comes from a description
    own = SelfCollision(robot)
    generator = ProblemGenerator(ProblemSettings(robot=str(path)), robot=robot, self_collision=own)
    judge, runner = Judge(robot, self_collision=own), ControllerRunner(robot, arm)
    outcomes = []
    for index in range(count):
        problem = generator.problem(index)
        outcomes.append(judge.judge(problem, runner.move(problem, settings), settings))
    return {
        "problems": count,
        "success": sum(item.success for item in outcomes),
        "contacts": sum(item.collision or item.self_collision for item in outcomes),
        "limit_violations": sum(bool(item.limits) for item in outcomes),
        "limits_broken": sorted({name for item in outcomes for name in item.limits}),
        "under_way": sum(item.under_way for item in outcomes),
    }
