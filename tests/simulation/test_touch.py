"""An arm that touches what nobody told it of, in MuJoCo: it stops, says so, waits, and goes on by `restart`."""

from dataclasses import replace

import numpy as np
import pytest

import sidestep as ss
from sidestep.bench.encounters import PERIOD, load_with_meshes, run_encounter
from sidestep.bench.faults import _torque_plant, fault_encounter
from sidestep.bench.moving import EncounterMaker
from sidestep.controller import ContactSettings
from sidestep.distance import SceneObject
from sidestep.obstacles import Box, pose_at
from sidestep.robot import Robot
from sidestep.simulation.model import build_model

Array = np.ndarray
mujoco = pytest.importorskip("mujoco")
ANGLE = 0.5  # of the wall beside the hand [rad]
STILL = 0.01  # [rad/s] of an arm that waits


@pytest.fixture(scope="module")
def arm() -> tuple[ss.Arm, Robot]:
    return load_with_meshes("fr3")


class Wall:
    """An FR3 under torque that is swung about its base against a wall, of which the controller knows nothing."""

    def __init__(self, arm: tuple[ss.Arm, Robot], **settings: object) -> None:
        robot = arm[1]
        hand = robot.pose(robot.neutral, robot.links[-1].name)[:3, 3]
        cos, sin = np.cos(ANGLE), np.sin(ANGLE)
        pose = pose_at([cos * hand[0] - sin * hand[1], sin * hand[0] + cos * hand[1], hand[2]])
        pose[:2, :2] = [[cos, -sin], [sin, cos]]
        wall = SceneObject.from_shape("wall", Box((0.5, 0.02, 0.8), pose))
        self._built = build_model(robot, (wall,), timestep=PERIOD, visuals=False)
        self._data = mujoco.MjData(self._built.model)
        start = robot.neutral.copy()
        start[0] -= 0.1
        self._built.set_state(self._data, start, np.zeros_like(start))
        mujoco.mj_forward(self._built.model, self._data)
        self.controller = ss.Controller(
            arm[0], ss.ControllerSettings(output="torque", synchronous=True, **settings)
        )
        self.controller.set_obstacles(ss.Obstacles.none())
        self.speed = 0.0  # that is asked of the base [rad/s]
        self.states: list[Array] = []
        self.forces: list[float] = []
        self.touched: list[bool] = []

    def step(self) -> ss.Command:
        q, v = self._built.state(self._data)
        self.controller.set_velocity(np.array([self.speed] + [0.0] * 6))
        command = self.controller.step(q, v)
        self._data.ctrl[self._built.actuators] = command.torque
        mujoco.mj_step(self._built.model, self._data)
        wrench, force = np.zeros(6), 0.0
        for contact in range(self._data.ncon):
            mujoco.mj_contactForce(self._built.model, self._data, contact, wrench)
            force += wrench[0]
        self.states.append(np.array([q, v]))
        self.forces.append(force)
        self.touched.append("nothing explains" in self.controller.explain())
        return command

    def run(self, seconds: float) -> None:
        for _ in range(round(seconds / PERIOD)):
            self.step()

    def hit(self, speed: float, seconds: float) -> int:
        """Moves at that speed [rad/s] and goes on for a time after the first contact; its step."""
        self.speed = speed
        while not self.forces or self.forces[-1] == 0.0:
            self.step()
            assert len(self.forces) < 6000
        first = len(self.forces)
        self.run(seconds)
        return first


@pytest.mark.parametrize(("speed", "within"), [(0.3, 0.07), (0.6, 0.03), (1.0, 0.03)])
def test_an_arm_that_hits_a_wall_stops_and_waits_softly(
    arm: tuple[ss.Arm, Robot], speed: float, within: float
) -> None:
    wall = Wall(arm)
    first = wall.hit(speed, 1.2)
    touch = wall.touched.index(True)
    assert first <= touch < first + round(within / PERIOD)
    assert all(wall.touched[touch:])
    command = wall.step()
    assert (command.status, command.activity) == (ss.SafetyStatus.stopping, ss.Activity.waiting)
    assert "the arm touched something, or a load is not told" in wall.controller.explain()
    # Measured 63 to 72 N, 37 to 50 N, and 21 to 26 N; without the stop it pushes on with 200 N.
    force = np.array(wall.forces)
    assert force[first + 100 : first + 200].max() < 110.0
    assert force[first + 200 : first + 500].max() < 65.0
    assert force[first + 1000 :].max() < 30.0
    assert np.abs(wall.states[-1][1]).max() < STILL


def test_without_the_stop_it_pushes_on(arm: tuple[ss.Arm, Robot]) -> None:
    wall = Wall(arm, contact=ContactSettings(share=np.inf))
    first = wall.hit(0.6, 1.2)
    assert not any(wall.touched)
    assert max(wall.forces[first + 200 :]) > 150.0  # against at most 65 N above


def test_it_waits_until_it_is_told_to_go_on(arm: tuple[ss.Arm, Robot]) -> None:
    wall = Wall(arm)
    wall.hit(0.6, 1.0)
    where = wall.states[-1][0]
    wall.speed = -0.3
    wall.run(0.5)  # neither another velocity nor a goal
    wall.controller.set_goal(where - 0.1)
    wall.run(0.2)
    assert wall.touched[-1]
    assert np.abs(wall.states[-1][0] - where).max() < 0.02
    wall.controller.restart()
    wall.run(0.5)
    assert not wall.touched[-1]
    assert wall.states[-1][0][0] < where[0] - 0.08  # 0.3 rad/s for half a second, less the beginning
    assert wall.forces[-1] == 0.0


@pytest.mark.parametrize("case", ["payload2kg", "friction", "gravity5deg", "armature", "noise", "late3ms"])
def test_errors_of_model_and_measurement_are_no_touch(arm: tuple[ss.Arm, Robot], case: str) -> None:
    encounter = replace(fault_encounter(EncounterMaker(*arm), case, 0, seed=0), steps=3000)
    course = run_encounter(
        arm[0], encounter, output="torque", plant=_torque_plant(arm[1], encounter.start, case)
    )
    assert "stopping" not in course.statuses


def test_an_arm_that_is_made_to_be_pushed_does_not_stop(arm: tuple[ss.Arm, Robot]) -> None:
    wall = Wall(arm, tracking={"stiffness": 2.0})
    wall.hit(0.6, 0.5)
    assert not any(wall.touched)


def test_bounds_are_refused(arm: tuple[ss.Arm, Robot]) -> None:
    for name, value in (("share", 0.0), ("time", -1.0)):
        with pytest.raises(ValueError, match=f"contact.{name}"):
            ss.Controller(arm[0], ss.ControllerSettings(contact={name: value}))
