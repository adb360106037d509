"""The page as a whole: it takes snapshots and shows them, and sends what people do as commands."""

from __future__ import annotations

import html
import threading
import time as clock
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from sidestep.distance.clearance import Clearance
from sidestep.robot import Robot
from sidestep.scenario import Scenario
from sidestep.scenario.assembly import load_robot
from sidestep.studio import messages as m
from sidestep.studio.methods import method_named
from sidestep.studio.page.arm import ArmView, BodyView, link_meshes
from sidestep.studio.page.camera_panel import CameraPanel
from sidestep.studio.page.cameras import Cameras
from sidestep.studio.page.clearances import Clearances
from sidestep.studio.page.compare_panel import ComparePanel
from sidestep.studio.page.goal import GoalControl
from sidestep.studio.page.loop_link import LoopLink
from sidestep.studio.page.marks import Marks
from sidestep.studio.page.now_words import NowWords
from sidestep.studio.page.obstacle_panel import ObstaclePanel
from sidestep.studio.page.obstacles import ObstacleViews
from sidestep.studio.page.plots import Plots
from sidestep.studio.page.recorder import Recorder
from sidestep.studio.page.scenario_panel import ScenarioPanel
from sidestep.studio.page.scene import set_up_scene
from sidestep.studio.page.show_panel import ShowPanel
from sidestep.studio.page.sight_view import SightView
from sidestep.studio.page.start_panel import StartPanel
from sidestep.studio.page.surface import Surface
from sidestep.studio.page.tuning import TuningPanel
from sidestep.studio.page.why import Why
from sidestep.studio.systems import Recipe, make_body, recipe_of

if TYPE_CHECKING:
    import viser

MAIN_WIDTH, PLOT_WIDTH = 365, 290  # [px]


class View:
    """Scene and controls of one studio, the same for every browser that looks."""

    def __init__(
        self,
        server: viser.ViserServer,
        scenario: Scenario,
        robot: Robot,
        send: Callable[[m.Command], None],
    ) -> None:
        self._server = server
        self._lock = threading.RLock()
        self.loop = LoopLink(server, send, robot)
        self.clearances = Clearances()
        self.shown = (np.nan, np.nan)  # [s] times of state and clearances on the page
        self._replayed = False
        set_up_scene(server)
        gui = server.gui
        gui.configure_theme(control_width="medium", show_logo=False, show_share_button=False)
        panel = gui.add_panel()
        with panel.add_tab("Now"):
            self.words = NowWords(server)
            self.plots = Plots(server)
        panel.dock_left()
        panel.set_width(PLOT_WIDTH)
        gui.main_panel.dock_right()
        gui.main_panel.set_width(MAIN_WIDTH)
        gui.add_button_group("Loop", ("Run", "Pause", "Restart")).on_click(self._on_loop)
        self._add_tabs()
        self.loop.send_also_to(self.compare.send)
        self.start_panel.add_mouse(server)
        self.obstacles = ObstacleViews(server, self.loop.send, self.obstacle_panel.select)
        self.surface = Surface(server, self._lock, self.loop.report)
        self.sight = SightView(server)
        self._set_robot(scenario, robot)

    def _add_tabs(self) -> None:
        server, gui = self._server, self._server.gui
        tabs = gui.add_tab_group()
        with tabs.add_tab("Start"):
            self.start_panel = StartPanel(server, self.loop, lambda: self.recorder.replaying)
        self._goal_tab = tabs.add_tab("Goal")
        with tabs.add_tab("Obstacles"):
            self.obstacle_panel = ObstaclePanel(server, self.loop, lambda: self.goal)
        with tabs.add_tab("Camera"):
            self.camera_panel = CameraPanel(server, self.loop)
        with tabs.add_tab("Compare"):
            self.compare = ComparePanel(server, self.loop)
        with tabs.add_tab("Advanced"):
            inner = gui.add_tab_group()
        with inner.add_tab("Method") as method_tab:
            self.tuning = TuningPanel(server, self.loop, method_tab)
        with inner.add_tab("Show"):
            self.switches = ShowPanel(server)
            self.switches.on_change(
                goal=self._show_goal, body=self._set_body_visible, curved=self._point_cameras
            )
        with inner.add_tab("Scenario"):
            ScenarioPanel(server, self.loop, Path.cwd())
            gui.add_divider()
            self.recorder = Recorder(server, self.loop)

    def show(self, snapshot: m.Snapshot) -> m.Row:
        """Shows the state of the loop, or in place of it a moment of the recording; returns which."""
        with self._lock, self._server.atomic():
            self._take(snapshot)
            index = self.recorder.current()
            if (index is not None) != self._replayed:
                self._set_replayed(index is not None)
            row = live_row(snapshot) if index is None else self.recorder.rows[index]
            self._show_row(row, snapshot, live=index is None)
            self.tuning.show(snapshot)
            self.start_panel.show(snapshot)
            self.compare.show(snapshot, self.clearances.least)
            self.camera_panel.show(snapshot)
            self.sight.show(snapshot.camera, visible=index is None)
            self.recorder.show(snapshot.recording)
            self.obstacle_panel.follow(snapshot)
            now = clock.monotonic()
            if index is None:
                self._show_live(now, snapshot, row)
            else:
                way = [past.q for past in self.recorder.rows[: index + 1]]
                self.marks.show_way(way, visible=self.switches.trail.value)
                self.plots.draw_past(now, self.recorder.plotted, row.time)
                self.words.show_replay(now, row, self.clearances, attached=snapshot.attached)
            self.shown = row.time, self.clearances.time
            return row

    def _show_row(self, row: m.Row, snapshot: m.Snapshot, *, live: bool) -> None:
        """What a moment has, of the loop or of the recording."""
        found, why = self.clearances.found, self.switches.why.value and live
        self.obstacles.set_things(row.things)
        self.obstacles.show(row.things, row.poses)
        self.arm.show(row.q)
        self.arm.colour({item.link: item.distance for item in found}, lit=snapshot.reason.link if why else "")
        if self.body is not None:
            self.body.colour(self.arm.shades)
        self.marks.show_nearest(found, visible=self.switches.nearest.value)
        self.marks.show_metric(row.q, row.metric, visible=self.switches.metric.value)
        self.why.show(row.q, snapshot.reason, visible=why)

    def _show_live(self, now: float, snapshot: m.Snapshot, row: m.Row) -> None:
        """What the state of the loop alone has. now: of the machine's clock [s]."""
        robot = self.loop.robot
        self.marks.show_trail(row.q, row.time, visible=self.switches.trail.value)
        self.goal.show(snapshot.goal, snapshot.goal_pose, snapshot.posture)
        self.goal.ghost.hide_where_at(row.q)
        pair = self.switches.pair(tuple(robot.coordinate_names), draft=snapshot.draft)
        body = None if self.body is None else self.body.body
        self.surface.show(snapshot, robot, body, pair, self._cameras.viewpoint)
        added = self.plots.add(snapshot, self.clearances.nearest)
        if snapshot.recording and added is not None:
            self.recorder.plotted.append(added)
        self.plots.draw(now)
        self.words.show(now, snapshot, self.clearances)

    def _take(self, snapshot: m.Snapshot) -> None:
        """Another robot, body or choice of obstacles."""
        before = self.loop.last
        if snapshot.scenario.robot != self._choice:
            self.recorder.leave_arm()
            self._remove_robot()
            self._set_robot(snapshot.scenario, load_robot(snapshot.scenario))
        self.loop.last = snapshot
        numbers = snapshot.numbers[snapshot.method]
        recipe = recipe_of(method_named(snapshot.method), numbers, snapshot.scenario, draft=snapshot.draft)
        if self.body is None or recipe != self._recipe:
            self._load_body(recipe)
        if before is None or snapshot.edition != before.edition:
            self.clearances.forget()
            self.obstacle_panel.set_names(tuple(thing.name for thing in snapshot.things))
        if before is not None and begins_anew(before, snapshot):
            self.clearances.least = np.inf
            self.marks.clear_trail()
            self.surface.clear_trail()

    def _set_replayed(self, replayed: bool) -> None:
        """Whether the scene shows the recording: what belongs to the live state alone is hidden then."""
        self._replayed = replayed
        self.clearances.forget()
        self._show_goal()
        if replayed:
            self.surface.clear()
        else:
            self.plots.draw(clock.monotonic(), at_once=True, anew=True)

    def _show_goal(self) -> None:
        self.goal.set_visible(self.switches.goal.value and not self._replayed)

    def stamp(self) -> int:
        """Sends what is not sent yet, and a number after it: a browser that has the number has all of it."""
        with self._lock:
            self.plots.draw(clock.monotonic(), at_once=True)
            return self.words.stamp()

    def take_clearances(self, found: tuple[Clearance, ...], time: float, epoch: int) -> None:
        """What the exact meshes say of a time [s], nearest first, and the `epoch` in which it was asked for."""
        with self._lock:
            self.clearances.take(found, time, epoch, live=not self._replayed)

    def take_rows(self, rows: list[m.Row]) -> None:
        """Rows of a recording."""
        with self._lock:
            self.recorder.take(rows)

    def tell(self, note: m.Preparing | m.Failed) -> None:
        """Shows what the loop has to say beside its state."""
        with self._lock:
            if isinstance(note, m.Preparing):
                self.words.say(f"preparing: {html.escape(note.note)} …")
                return
            if isinstance(note.refused, m.AddObstacle):
                self.obstacle_panel.refused(note.refused.thing.name)
            if isinstance(note.refused, m.SetNumbers):
                self.tuning.refused()
            if note.fatal:
                self.words.say(f"The loop ended: {html.escape(note.message)}")
        self.loop.refused(note.message)

    def stop(self) -> None:
        """Ends what runs beside the page."""
        self.compare.stop()
        self.surface.stop()

    def _point_cameras(self) -> None:
        self._cameras.point(beside_surface=self.switches.curved.value)

    def _set_robot(self, scenario: Scenario, robot: Robot) -> None:
        self._choice, self.loop.robot = scenario.robot, robot
        meshes, tip = link_meshes(robot), self.loop.tip
        self._cameras = Cameras(self._server, scenario, robot, meshes)
        self._point_cameras()
        self.switches.set_joints(tuple(robot.coordinate_names))
        self.arm = ArmView(self._server, robot, meshes, "/arm")
        self.marks = Marks(self._server, robot, tip)
        self.why = Why(self._server, robot, tip)
        self.body: BodyView | None = None
        with self._goal_tab:
            self.goal = GoalControl(self._server, robot, meshes, tip, self.loop.send)
        self._show_goal()

    def _remove_robot(self) -> None:
        self.compare.stop()
        self.surface.clear()
        for part in (self.body, self.arm, self.marks, self.why, self.goal):
            if part is not None:
                part.remove()

    def _load_body(self, recipe: Recipe) -> None:
        """The body that a method needs; the loop has made it, so it comes from the cache."""
        if self.body is not None:
            self.body.remove()
        robot = self.loop.robot
        self._recipe = recipe
        self.body = BodyView(
            self._server, robot, make_body(robot, recipe), "/arm", visible=self.switches.body.value
        )

    def _set_body_visible(self) -> None:
        if self.body is not None:
            self.body.set_visible(self.switches.body.value)

    def _on_loop(self, event: Any) -> None:
        match event.target.value:
            case "Run":
                self.loop.send(m.SetRunning(True))
            case "Pause":
                self.loop.send(m.SetRunning(False))
            case _:
                self.loop.send(m.Restart())


def begins_anew(before: m.Snapshot, now: m.Snapshot) -> bool:
    """Whether the motion of the state before has ended with a restart, or another scenario."""
    still_begins = before.time == 0.0 and now.edition != before.edition
    return now.time < before.time or now.scenario != before.scenario or still_begins


def live_row(snapshot: m.Snapshot) -> m.Row:
    """The state of the loop as a moment."""
    return m.Row(snapshot.time, snapshot.q, snapshot.things, snapshot.poses, snapshot.metric)
