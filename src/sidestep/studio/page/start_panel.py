"""The first tab: scenes, goals in turn, the ball that follows the mouse, three sliders, robots of one's own."""

from __future__ import annotations

import atexit
import shutil
import tempfile
import threading
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from sidestep.studio import messages as m
from sidestep.studio.gallery import (
    GALLERY,
    MOUSE_BALL,
    MOUSE_BALL_PLACE,
    MOUSE_BALL_RADIUS,
    ends_of,
    with_following_ball,
)
from sidestep.studio.methods import method_named
from sidestep.studio.page.loop_link import LoopLink
from sidestep.studio.page.mouse import DROP, MouseBall
from sidestep.studio.page.note import add_note
from sidestep.studio.parameters import Numbers
from sidestep.studio.robot_file import scenario_of_upload
from sidestep.studio.scene_obstacle import ball
from sidestep.studio.three_sliders import SLIDERS

if TYPE_CHECKING:
    import viser


Array = npt.NDArray[np.float64]

SETTLE = 0.25  # [s] without a further change before the numbers are sent
SUFFIXES = ".urdf,.xacro,.xml,.mjcf,.zip"


class StartPanel:
    """What most people need; everything else is in the other tabs."""

    def __init__(self, server: viser.ViserServer, loop: LoopLink, replays: Callable[[], bool]) -> None:
        self._loop, self._replays = loop, replays
        gui = server.gui
        gui.add_button_group("scene", tuple(GALLERY)).on_click(self._load)
        self._turns: Any = gui.add_checkbox("goals in turn", False)
        self._turns.on_update(self._set_turns)
        self._follows: Any = gui.add_checkbox("ball follows the mouse", True)
        self._follows.on_update(self._set_follows)
        add_note(
            gui,
            "Move the mouse over the scene: the arm keeps off the ball. Drag to look around, or drag an obstacle.",
        )
        gui.add_divider()
        self._sliders: dict[str, Any] = {}
        for item in SLIDERS:
            slider = gui.add_slider(
                item.label, min=item.lower, max=item.upper, step=item.step, initial_value=item.usual
            )
            slider.on_update(self._moved)
            self._sliders[item.label] = slider
            add_note(gui, item.sentence)
        gui.add_divider()
        self._upload: Any = gui.add_upload_button(DROP, mime_type=SUFFIXES)
        self._upload.on_upload(self._load_robot)
        self._robot_state: Any = add_note(
            gui,
            "URDF, xacro or MJCF, or a .zip of one with its meshes; or drop the file on the page. It moves within "
            "seconds with a coarse body, and a finer one takes over while it moves.",
        )
        self._folder = Path(tempfile.mkdtemp(prefix="sidestep-studio-"))  # as long as the robots may be there
        atexit.register(shutil.rmtree, self._folder, ignore_errors=True)
        self._changed: set[str] = set()
        self._timer: threading.Timer | None = None
        self._numbers: Numbers = {}
        self._there = True  # whether the scene has the ball

    def add_mouse(self, server: viser.ViserServer) -> None:
        """The hidden field of the mouse, where it is called: outside of tabs, which are not always there."""
        self._mouse = MouseBall(server, self._loop.send, self._ball, self._follows_now)

    def show(self, snapshot: m.Snapshot) -> None:
        """Shows what the loop has."""
        if bool(snapshot.visited) != self._turns.value:
            self._turns.value = bool(snapshot.visited)
        there = MOUSE_BALL in (thing.name for thing in snapshot.things)
        if there != self._there:
            self._there = self._follows.value = there
        numbers = snapshot.numbers[snapshot.method]
        if numbers == self._numbers:
            return
        self._numbers = dict(numbers)
        for item in SLIDERS:
            slider = self._sliders[item.label]
            slider.disabled = not item.applies_to(numbers)
            if not slider.disabled and item.label not in self._changed:
                value = float(np.clip(item.of(numbers), item.lower, item.upper))
                if not np.isclose(slider.value, value):
                    slider.value = value

    def _follows_now(self) -> bool:
        return bool(self._follows.value) and not self._replays()

    def _ball(self) -> Array | None:
        last = self._loop.last
        names = [] if last is None else [thing.name for thing in last.things]
        if last is None or MOUSE_BALL not in names:
            return None
        place: Array = last.poses[names.index(MOUSE_BALL)][:3, 3]
        return place

    def _load(self, event: Any) -> None:
        with self._loop.telling(event.client):
            scene = GALLERY[event.target.value]
            self._loop.load(scene.load(), to_and_fro=scene.to_and_fro)

    def _set_turns(self, event: Any) -> None:
        last = self._loop.last
        if event.client is None or last is None:
            return
        goals = ends_of(last.scenario, self._loop.robot) if self._turns.value else ()
        with self._loop.telling(event.client):
            if self._turns.value and not goals:
                self._turns.value = False
                raise ValueError(
                    "this scenario has no start and goal between which the arm could go to and fro"
                )
            self._loop.send(m.VisitGoals(goals))

    def _set_follows(self, event: Any) -> None:
        if event.client is not None and self._follows.value and self._ball() is None:
            self._loop.send(m.AddObstacle(ball(MOUSE_BALL, np.array(MOUSE_BALL_PLACE), MOUSE_BALL_RADIUS)))

    def _moved(self, event: Any) -> None:
        if event.client is None:
            return
        self._changed |= {label for label, slider in self._sliders.items() if slider is event.target}
        if self._timer is not None:
            self._timer.cancel()
        self._timer = threading.Timer(SETTLE, self._send_numbers)
        self._timer.daemon = True
        self._timer.start()

    def _send_numbers(self) -> None:
        last, changed = self._loop.last, self._changed
        self._changed = set()
        if last is None:
            return
        method = method_named(last.method)
        numbers: Numbers = {}
        for item in SLIDERS:
            if item.label in changed:
                numbers |= item.numbers(float(self._sliders[item.label].value), method)
        if numbers:
            self._loop.send(m.SetNumbers(method.name, numbers))

    def _load_robot(self, event: Any) -> None:
        file = event.target.value
        with self._loop.telling(event.client):
            place = Path(tempfile.mkdtemp(dir=self._folder))
            scenario = scenario_of_upload(file.name, file.content, place)
            self._loop.load(with_following_ball(scenario), to_and_fro=True)
