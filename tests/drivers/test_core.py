"""What every driver gives: states and descriptions, and the ideal robot."""

from __future__ import annotations

import numpy as np
import pytest

import sidestep as ss
from sidestep.drivers import Ideal, RobotDescription, RobotState


def test_what_a_robot_does_not_say_is_unknown() -> None:
    state = RobotState([0.1, 0.2], [0.0, 0.3])
    assert np.isnan(state.time)
    assert state.lost_cycles == 0
    for unknown in (state.torque, state.told_position, state.told_velocity, state.told_acceleration):
        assert unknown.shape == (2,)
        assert np.isnan(unknown).all()
    said = RobotState([0.1], [0.2], time=3.0, torque=[4.0], told_acceleration=[5.0], lost_cycles=6)
    assert (said.q[0], said.v[0], said.time, said.torque[0]) == (0.1, 0.2, 3.0, 4.0)
    assert (said.told_acceleration[0], said.lost_cycles) == (5.0, 6)
    with pytest.raises(ValueError, match=r"v has shape \(2,\), expected \(1,\)"):
        RobotState([0.1], [0.0, 0.0])


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"period": 0.0}, "period of robot 'robot' is 0.000000, must be greater than 0 and at most 1"),
        ({"outputs": []}, "robot 'robot' takes no output"),
        ({"outputs": ["force"]}, "outputs"),
    ],
)
def test_a_description_that_cannot_be_is_named(change: dict[str, object], words: str) -> None:
    with pytest.raises(ValueError, match=words):
        RobotDescription("robot", **({"period": 0.001, "outputs": ["torque"]} | change))


@pytest.mark.parametrize("output", ["torque", "acceleration", "velocity", "position"])
def test_the_ideal_robot_tracks_every_output(output: str) -> None:
    arm = ss.Arm.load("fr3")
    controller = ss.Controller(arm, ss.ControllerSettings(output=output, synchronous=True))
    controller.set_obstacles(ss.Obstacles.none())
    controller.set_goal(arm.neutral + 0.3)
    driver = Ideal(arm, arm.neutral + 0.05, real_time=False)
    assert driver.description.outputs == ["torque", "acceleration", "velocity", "position"]
    assert driver.description.joints == list(arm.robot.coordinate_names)
    seen: list[np.ndarray] = []
    report = ss.run(controller, driver, until=None, duration=3.0)
    assert report.end.name == "duration"
    ss.run(controller, driver, until=lambda state: not seen.append(state.q))
    assert np.abs(seen[0] - arm.neutral - 0.3).max() < 0.01
    with pytest.raises(ValueError, match="q has 7 numbers"):
        Ideal(arm, np.full(7, np.nan))
    with pytest.raises(ValueError, match="v has 7 numbers"):
        Ideal(arm, arm.neutral, v=np.full(7, np.inf))
