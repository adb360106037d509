"""Of what the arm was run into by: whether it could have got out of the way."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sidestep import Obstacles, Robot, SceneObject
from sidestep.bench.motion import Motion, MotionSettings
from sidestep.bench.outcome import Judge, Outcome
from sidestep.bench.problem import poses_over

PERIOD = 0.005  # [s]


@dataclass(frozen=True, eq=False)
class Passing:
    """A planar arm that stays where it is while a ball of 5 cm passes at 0.5 m/s."""

    start: np.ndarray
    objects: tuple[SceneObject, ...]
    index: int = 0
    straight_line_blocked: bool = False
    changes: tuple[float, ...] = ()

    @property
    def goal(self) -> np.ndarray:
        return self.start

    def obstacles_at(self, time: float) -> Obstacles:
        raise AssertionError("nobody looks")


def judged(
    robot: Robot, through: list[float], *, safe: bool = True, motion: str = "moving", there: float = 0.0
) -> Outcome:
    """The arm lies along x; the ball comes along y, seen from `there` on, and is at `through` [m] after one second."""
    velocity = np.array([0.0, 0.5, 0.0])
    resting = motion == "fixed"
    place = np.array(through) - (0.0 if resting else 1.0) * velocity
    ball = SceneObject.ball(
        "ball",
        place,
        radius=0.05,
        motion=motion,
        velocity=np.zeros(3) if resting else velocity,
        present=(there, np.inf),
    )
    steps = round(2.0 / PERIOD)
    q = np.zeros((steps, robot.num_coordinates))
    poses = poses_over([ball], PERIOD * np.arange(steps))
    still = Motion(q, q, q, poses, None, 0, False, np.zeros(steps), safe=safe)
    settings = MotionSettings(period=PERIOD)
    return Judge(robot).judge(Passing(q[0], (ball,)), still, settings)


def test_an_arm_that_could_have_turned_away_had_a_way_out() -> None:
    outcome = judged(Robot.named("planar3"), [0.9, 0.0, 0.0])
    assert outcome.collision
    assert outcome.way_out is not None
    assert outcome.way_out.found
    assert outcome.way_out.sentence.startswith("there was a way out ")
    assert outcome.reasons()[0].endswith(outcome.way_out.sentence)


def test_nothing_gets_its_shoulder_out_of_the_way() -> None:
    outcome = judged(Robot.named("planar3"), [0.0, 0.0, 0.0])
    assert outcome.collision
    assert outcome.way_out is not None
    assert not outcome.way_out.found
    assert outcome.way_out.sentence.startswith("no way out: all of 2000 postures touch ball at ")


def test_only_collisions_of_safe_methods_with_what_moves_are_looked_into() -> None:
    robot = Robot.named("planar3")
    assert judged(robot, [0.9, 0.3, 0.0], motion="fixed").way_out is None  # no collision
    assert judged(robot, [0.9, 0.0, 0.0], motion="fixed").collision
    assert judged(robot, [0.9, 0.0, 0.0], motion="fixed").way_out is None
    assert judged(robot, [0.9, 0.0, 0.0], safe=False).way_out is None


def test_nobody_gets_out_of_the_way_of_what_is_not_there_yet() -> None:
    outcome = judged(Robot.named("planar3"), [0.9, 0.0, 0.0], there=0.95)  # then it is in the arm already
    assert outcome.collision
    assert outcome.way_out is not None
    assert outcome.way_out.sentence == "none of 100 motions from up to 0.0 s before gets out of the way"
