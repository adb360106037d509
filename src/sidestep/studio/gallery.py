"""Scenes to begin with: kinds of MotionBenchMaker in layouts of our own, and the thesis's."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from sidestep.robot import Robot
from sidestep.scenario import Scenario
from sidestep.scenario.assembly import coordinates
from sidestep.scenario.scenario import JointState, Obstacle
from sidestep.shapes import Sphere

Array = npt.NDArray[np.float64]

FILES = Path(__file__).parent / "scenes"
MOUSE_BALL = "mouse ball"  # the obstacle that follows the mouse
MOUSE_BALL_RADIUS = 0.06  # [m]
MOUSE_BALL_PLACE = (0.75, 0.45, 0.75)  # [m] beside the way of the arm, in sight
BEFORE_A_WALL = (0.30, -0.60, 0.80)  # [m] the same where shelves or a cupboard would hide it


@dataclass(frozen=True)
class GalleryScene:
    """A scene of the gallery: a shipped scenario or a file, and whether the arm goes to and fro in it beside a ball."""

    label: str
    scenario: str | Path
    to_and_fro: bool = True
    ball: tuple[float, float, float] = MOUSE_BALL_PLACE

    def load(self) -> Scenario:
        """The scenario, with the ball that follows the mouse where the arm goes to and fro."""
        scenario = Scenario.load(self.scenario)
        return with_mouse_ball(scenario, self.ball) if self.to_and_fro else scenario


GALLERY: dict[str, GalleryScene] = {
    scene.label: scene
    for scene in (
        GalleryScene("Table", "table"),
        GalleryScene("Bookshelf", "bookshelf", ball=BEFORE_A_WALL),
        GalleryScene("Cage", "cage"),
        GalleryScene("Boxes", "box"),
        GalleryScene("Kitchen", "kitchen", ball=BEFORE_A_WALL),
        GalleryScene("Two arms", FILES / "two-arms.yaml"),
        GalleryScene("Thesis 6.2.3", "thesis-6.2.3", to_and_fro=False),
    )
}
OPENING = "Table"


def with_mouse_ball(scenario: Scenario, place: tuple[float, float, float] = MOUSE_BALL_PLACE) -> Scenario:
    """The scenario and one ball more, at a place [m]."""
    ball = Obstacle(Sphere(MOUSE_BALL_RADIUS), place, name=MOUSE_BALL, points="ball")
    return dataclasses.replace(scenario, obstacles=(*scenario.obstacles, ball))


def with_following_ball(scenario: Scenario) -> Scenario:
    """The scenario, with its first obstacle as the ball that follows the mouse."""
    first, *others = scenario.obstacles
    return dataclasses.replace(scenario, obstacles=(dataclasses.replace(first, name=MOUSE_BALL), *others))


def ends_of(scenario: Scenario, robot: Robot) -> tuple[Array, ...]:
    """Goal and start (nv,), between which an arm can go to and fro; none where the goal is a pose without posture."""
    end = scenario.goal if isinstance(scenario.goal, JointState) else scenario.goal.posture
    if end is None:
        return ()
    start, goal = coordinates(scenario.start, robot, "start"), coordinates(end, robot, "goal")
    return () if np.allclose(start, goal) else (goal, start)
