"""One problem gives the same commands, bit for bit, by every way to run it."""

from __future__ import annotations

import os
import subprocess
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

import sidestep as ss
from sidestep import Scenario
from sidestep.bench.method import Method
from sidestep.bench.methods import build_runner
from sidestep.bench.motion import MotionSettings
from sidestep.bench.problems import ReachProblem
from sidestep.math.pose import from_roll_pitch_yaw, pose_at
from sidestep.scenario import run_scenario
from sidestep.scenario.assembly import assemble
from sidestep.shipped_arms import shipped_file
from sidestep.simulation import ControllerAdapter, Drive, KinematicRun, Simulation, SimulationRun
from sidestep.studio.adapter import ControllerAdapter as StudioAdapter
from sidestep.studio.export import scenario_now
from sidestep.studio.session import Session
from sidestep.studio.snippet import python_snippet
from sidestep.studio.systems import make_body

Array = npt.NDArray[np.float64]

PERIOD, STEPS, SEED = 0.002, 500, 3  # none is a default
DURATION = STEPS * PERIOD
START = np.array([-0.8, 0.2, 0.0, -2.0, 0.0, 2.2, 0.8])
GOAL = np.array([0.8, 0.3, 0.0, -1.9, 0.0, 2.2, 0.8])
CENTRES = np.array([[0.5, 0.02, 0.5], [0.56, 0.56, 1.14]])  # in the way, and coming at the forearm
RADII = np.array([0.08, 0.04])
VELOCITIES = np.array([[0.0, 0.0, 0.0], [-0.4, -0.4, -0.48]])
FILE = f"""\
format: 1
name: same
robot: {{name: fr3}}
method: controller
start: {{unit: rad, position: {START.tolist()}}}
goal: {{unit: rad, position: {GOAL.tolist()}}}
obstacles:
  - name: rests
    shape: {{type: sphere, radius: {RADII[0]}}}
    position: {CENTRES[0].tolist()}
  - name: comes
    shape: {{type: sphere, radius: {RADII[1]}}}
    position: {CENTRES[1].tolist()}
    velocity: {VELOCITIES[1].tolist()}
controller: {{seed: {SEED}}}
simulation: {{mode: MODE, period: {PERIOD}, duration: {DURATION}}}
"""


def scenario(mode: str, method: str = "controller") -> Scenario:
    return Scenario.from_text(FILE.replace("MODE", mode).replace("method: controller", f"method: {method}"))


def problem() -> ReachProblem:
    return ReachProblem("fr3", 0, SEED, START, GOAL, CENTRES, VELOCITIES, RADII, straight_line_blocked=True)


def controller(output: str) -> ss.Controller:
    made = ss.Controller(
        ss.Arm.load("fr3"), ss.ControllerSettings(synchronous=True, seed=SEED, output=output, period=PERIOD)
    )
    made.set_goal(GOAL)
    made.set_obstacles(ss.Obstacles(CENTRES, RADII, VELOCITIES), valid_for=np.inf)
    return made


@cache
def stepped(output: str) -> tuple[Array, Array]:
    """Acceleration and torque (STEPS, 7) through the Python API, by the arm's own masses."""
    one, q, v = controller(output), START, np.zeros(7)
    accelerations, torques, kinds = [], [], set()
    for _ in range(STEPS):
        command = one.step(q, v)
        accelerations.append(command.acceleration)
        torques.append(command.torque)
        kinds |= {(name, getattr(command, name)) for name in ("on_path", "avoiding", "status")}
        q, v = command.position, command.velocity
    # Every part acts: planner, look-ahead, limits.
    assert {("on_path", True), ("avoiding", True), ("status", ss.SafetyStatus.limited)} <= kinds
    return np.array(accelerations), np.array(torques)


def of_integrate() -> Array:
    return ss.integrate(controller("acceleration"), START, np.zeros(7), steps=STEPS).acceleration


def of_batch() -> Array:
    two = [controller("acceleration") for _ in range(2)]
    motions = ss.integrate_batch(two, np.tile(START, (2, 1)), np.zeros((2, 7)), steps=STEPS, threads=2)
    np.testing.assert_array_equal(motions[0].acceleration, motions[1].acceleration)
    return motions[1].acceleration


def of_scenario(method: str = "controller") -> Array:
    run = run_scenario(scenario("kinematic", method)).run
    assert isinstance(run, KinematicRun)
    return run.achieved


def of_bench(method: str = "controller") -> Array:
    return (
        build_runner(Method(method), ss.Robot.named("fr3"))
        .move(problem(), MotionSettings(period=PERIOD, duration=DURATION))
        .a
    )


def of_studio() -> Array:
    """The studio's mover, which in its physics asks for torque."""
    parts = assemble(scenario("kinematic"))
    assert isinstance(parts.mover, ss.Controller)
    mover = StudioAdapter(parts.robot, ss.Arm.load("fr3"), parts.mover.settings, "fr3_hand_tcp")
    mover.set_goal(None, GOAL, thorough=True)
    q, v, found = START, np.zeros(7), []
    for k in range(STEPS):
        seen = ss.Obstacles(CENTRES + PERIOD * k * VELOCITIES, RADII, VELOCITIES)
        mover.step(q, v, np.eye(7), np.zeros(7), seen)
        command = mover._controller.command
        found.append(command.acceleration)
        q, v = command.position, command.velocity
    return np.array(found)


def of_cpp(output: str) -> tuple[Array, Array]:
    """By the program of motion.cpp: SIDESTEP_CPP_MOTION is its path."""
    program = os.environ.get("SIDESTEP_CPP_MOTION")
    if program is None:
        pytest.skip("SIDESTEP_CPP_MOTION names no program of tests/front_end/motion.cpp")
    file = shipped_file("fr3")
    assert file is not None
    balls = np.column_stack([CENTRES, RADII, VELOCITIES])
    told = " ".join(float(value).hex() for value in (*START, *GOAL, *balls.ravel()))
    run = subprocess.run(
        [program, str(file), output, str(STEPS), str(PERIOD), str(SEED)],
        input=told,
        capture_output=True,
        text=True,
        check=True,
        timeout=60,
    )
    rows = np.array([[float.fromhex(word) for word in line.split()] for line in run.stdout.splitlines()])
    return rows[:, :7], rows[:, 7:]


WAYS: dict[str, Callable[[], Array]] = {
    "integrate": of_integrate,
    "integrate_batch": of_batch,
    "scenario": of_scenario,
    "bench": of_bench,
    "studio": of_studio,
    "c++": lambda: of_cpp("acceleration")[0],
}


@pytest.mark.parametrize("way", WAYS)
def test_accelerations_are_those_of_the_python_api(way: str) -> None:
    found = WAYS[way]()
    assert found.shape == (STEPS, 7)
    np.testing.assert_array_equal(found, stepped("acceleration")[0])


@pytest.mark.slow
def test_a_method_is_the_same_in_a_file_and_in_the_benchmark() -> None:
    """Without planner the arm moves otherwise, by both in the same way."""
    found = of_bench("barrier")
    np.testing.assert_array_equal(found, of_scenario("barrier"))
    assert not np.array_equal(found, stepped("acceleration")[0])


def test_torques_by_the_arms_own_masses_are_those_of_cpp() -> None:
    for found, expected in zip(of_cpp("torque"), stepped("torque"), strict=True):
        np.testing.assert_array_equal(found, expected)


@dataclass(frozen=True)
class Measured:
    """What a controller was told in physics, and the torques (STEPS, 7) it gave."""

    states: list[tuple[Array, Array, Array, Array]]  # q, v, mass matrix, bias
    torques: Array


class Watched(ControllerAdapter):
    """Notes what it is told."""

    def drive(self, time: float, *measured: Any) -> Drive:
        self.told.append(tuple(np.copy(value) for value in measured))
        return super().drive(time, *measured)

    told: list[Any]


@cache
def simulated() -> Measured:
    """Through `Simulation`, which the other ways have to repeat: they get the same states only by the same torques."""
    driver = Watched(controller("torque"), ss.Obstacles(CENTRES, RADII, VELOCITIES))
    driver.told = []
    simulation = Simulation(ss.Robot.named("fr3"), problem().objects, timestep=PERIOD, visuals=False)
    run = simulation.run(driver, START, GOAL, DURATION, arrival=None)
    assert len(run.contacts) == 0
    return Measured(driver.told, run.torque)


def torques_of(one: ss.Controller) -> Array:
    """What a controller gives at the states of `simulated`."""
    return np.array([one.step(*told).torque for told in simulated().states])


def torques_of_scenario() -> Array:
    run = run_scenario(scenario("torque")).run
    assert isinstance(run, SimulationRun)
    return run.torque


def torques_of_bench() -> Array:
    mover = build_runner(Method.controller, ss.Robot.named("fr3"))
    motion = mover.move(problem(), MotionSettings(period=PERIOD, duration=DURATION, torque=True))
    assert motion.torque is not None
    return motion.torque


def session() -> Session:
    return Session(scenario("torque"), prepare=make_body, synchronous=True)


def torques_of_studio() -> Array:
    one, found = session(), []
    for _ in range(STEPS):
        one.step()
        found.append(one._steps.torque)
    return np.array(found)


def torques_of_snippet() -> Array:
    """Of the Python that the studio shows, told what is seen, and to be synchronous."""
    variables: dict[str, Any] = {}
    exec(python_snippet(session().snapshot()), variables)
    variables["settings"].synchronous = True
    one = ss.Controller(variables["arm"], variables["settings"])
    one.set_goal(variables["goal"])
    one.set_obstacles(ss.Obstacles(CENTRES, RADII, VELOCITIES), valid_for=np.inf)
    return torques_of(one)


def torques_of_saved_file() -> Array:
    saved = scenario_now(session().snapshot(), name="saved")
    run = run_scenario(saved).run
    assert isinstance(run, SimulationRun)
    return run.torque


TORQUES: dict[str, Callable[[], Array]] = {
    "step": lambda: torques_of(controller("torque")),
    "scenario": torques_of_scenario,
    "bench": torques_of_bench,
    "studio": torques_of_studio,
    "snippet": torques_of_snippet,
    "saved file": torques_of_saved_file,
}


@pytest.mark.slow
@pytest.mark.parametrize("way", TORQUES)
def test_torques_in_physics_are_those_of_the_simulation(way: str) -> None:
    found = TORQUES[way]()
    assert found.shape == (STEPS, 7)
    np.testing.assert_array_equal(found, simulated().torques)


@pytest.mark.slow
def test_a_pose_goal_is_the_same_in_a_file_in_the_studio_and_in_python() -> None:
    place = "{frame: fr3_hand_tcp, position: [0.43, 0.44, 0.24], rotation_deg: [180, 10, 30]}"
    joints = f"{{unit: rad, position: {GOAL.tolist()}}}"
    text = FILE.replace(f"goal: {joints}", f"goal: {place}")
    assert place in text
    run = run_scenario(Scenario.from_text(text.replace("MODE", "torque"))).run
    assert isinstance(run, SimulationRun)
    posed = Session(Scenario.from_text(text.replace("MODE", "torque")), prepare=make_body, synchronous=True)
    found = []
    for _ in range(STEPS):
        posed.step()
        found.append(posed._steps.torque)
    np.testing.assert_array_equal(found, run.torque)

    one, robot = controller("acceleration"), ss.Robot.named("fr3")
    pose = pose_at([0.43, 0.44, 0.24], from_roll_pitch_yaw(np.deg2rad([180.0, 10.0, 30.0]).tolist()))
    one.set_goal(ss.PoseGoal(robot, "fr3_hand_tcp", pose))
    motion = ss.integrate(one, START, np.zeros(7), steps=STEPS)
    run = run_scenario(Scenario.from_text(text.replace("MODE", "kinematic"))).run
    np.testing.assert_array_equal(motion.acceleration, run.achieved)
