"""The page as a whole: it takes snapshots and shows them, and sends what people do as commands."""

from __future__ import annotations

import contextlib
import html
import logging
import threading
import time as clock
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from sidestep.body import Body
from sidestep.distance.clearance import Clearance
from sidestep.extras import MissingExtraError
from sidestep.robot import Robot, tip_of
from sidestep.scenario import Scenario
from sidestep.scenario.assembly import coordinates, goal_posture, load_robot
from sidestep.studio import messages as m
from sidestep.studio.gallery import ends_of
from sidestep.studio.methods import method_named
from sidestep.studio.page import colours
from sidestep.studio.page.arm import ArmView, BodyView, link_meshes, reach
from sidestep.studio.page.camera import HIGH, UNDER_CORNER, Viewpoint, clear_view, extent
from sidestep.studio.page.compare_panel import ComparePanel
from sidestep.studio.page.goal import GIZMO_SIZE, GoalControl
from sidestep.studio.page.marks import Marks
from sidestep.studio.page.obstacle_panel import ObstaclePanel
from sidestep.studio.page.obstacles import ObstacleViews
from sidestep.studio.page.plots import Plots
from sidestep.studio.page.recorder import Recorder
from sidestep.studio.page.scenario_panel import ScenarioPanel
from sidestep.studio.page.scene import point_cameras, set_up_scene
from sidestep.studio.page.start_panel import StartPanel
from sidestep.studio.page.surface import Surface
from sidestep.studio.page.tuning import TuningPanel
from sidestep.studio.page.why import Why
from sidestep.studio.page.words import begun, in_box, stamped
from sidestep.studio.scene_obstacle import SceneObstacle, thing_of, things_of
from sidestep.studio.systems import Recipe, make_body, numbers_of, recipe_of

if TYPE_CHECKING:
    import trimesh
    import viser

WORDS_EVERY = 0.15  # [s] nobody reads faster
NEAR = 2.0  # of the arm's reach: what is farther off need not be in the window as it opens
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
        self._server, self._send_to_loop = server, send
        self._lock = threading.RLock()
        self._clearances: tuple[Clearance, ...] = ()
        self._measured = np.nan  # [s] simulated time of the clearances
        self.shown = (np.nan, np.nan)  # [s] simulated times of state and clearances on the page
        self._stamp, self._text = 0, in_box("preparing …")
        self.least_clearance = np.inf
        self.last: m.Snapshot | None = None
        self.epoch = 0  # grows when clearances that were asked for before no longer count
        self._replayed = False
        self._told, self._reported = 0.0, ""
        set_up_scene(server)
        gui = server.gui
        gui.configure_theme(control_width="medium", show_logo=False, show_share_button=False)
        panel = gui.add_panel()
        with panel.add_tab("Now"):
            self._words: Any = gui.add_html(stamped(self._text, 0))
            self.plots = Plots(server)
        panel.dock_left()
        panel.set_width(PLOT_WIDTH)
        gui.main_panel.dock_right()
        gui.main_panel.set_width(MAIN_WIDTH)
        self._run = gui.add_button_group("Loop", ("Run", "Pause", "Restart"))
        self._run.on_click(self._on_loop)
        tabs = gui.add_tab_group()
        with tabs.add_tab("Start"):
            self.start_panel = StartPanel(server, self)
        self._goal_tab = tabs.add_tab("Goal")
        with tabs.add_tab("Obstacles"):
            self.obstacle_panel = ObstaclePanel(server, self)
        with tabs.add_tab("Compare"):
            self.compare = ComparePanel(server, self)
        with tabs.add_tab("Advanced"):
            inner = gui.add_tab_group()
        with inner.add_tab("Method") as method_tab:
            self.tuning = TuningPanel(server, self, method_tab)
        with inner.add_tab("Show"):
            self._add_switches()
        with inner.add_tab("Scenario"):
            ScenarioPanel(server, self, Path.cwd())
            gui.add_divider()
            self.recorder = Recorder(server, self)
        self.start_panel.add_mouse(server)
        self.obstacles = ObstacleViews(server, self.send, self.obstacle_panel.select)
        self.surface = Surface(server, self._lock, self.report)
        self._body_now: Body | None = None
        self._choice = scenario.robot
        self._set_robot(scenario, robot)

    def send(self, command: m.Command) -> None:
        """Hands a command to the loop, and to the other one of a comparison."""
        self._send_to_loop(command)
        self.compare.send(command)

    def load(self, scenario: Scenario, *, to_and_fro: bool = False) -> None:
        """Another scenario for loop and page, with the method that it is written for; `to_and_fro` between its ends."""
        goals = ends_of(scenario, load_robot(scenario)) if to_and_fro else ()
        self.send(m.Load(scenario, numbers_of(scenario)[0], goals))

    @contextlib.contextmanager
    def telling(self, client: Any) -> Iterator[None]:
        """Shows what is refused inside to the person who asked for it."""
        try:
            yield
        except (ValueError, OSError, MissingExtraError) as error:
            client.add_notification("Not possible", str(error), color="red", auto_close_seconds=8.0)

    def show(self, snapshot: m.Snapshot) -> m.Row:
        """Shows the state of the loop, or in place of it a moment of the recording; returns which."""
        with self._lock, self._server.atomic():
            self._take(snapshot)
            index = self.recorder.current()
            if (index is not None) != self._replayed:
                self._set_replayed(index is not None)
            row = live_row(snapshot) if index is None else self.recorder.rows[index]
            self.obstacles.set_things(row.things)
            self.obstacles.show(row.things, row.poses)
            self.arm.show(row.q)
            clearances = {item.link: item.distance for item in self._clearances}
            lit = snapshot.reason.link if index is None and self._why_shown.value else ""
            self.arm.colour(clearances, lit=lit)
            if self._body is not None:
                self._body.colour(self.arm.shades)
            self.marks.show_nearest(self._clearances, visible=self._nearest.value)
            self.marks.show_metric(row.q, row.metric, visible=self._metric.value)
            self.tuning.show(snapshot)
            self.start_panel.show(snapshot)
            self.compare.show(snapshot, self.least_clearance)
            self.recorder.show(snapshot.recording)
            self.obstacle_panel.follow(snapshot)
            now = clock.monotonic()
            self.why.show(row.q, snapshot.reason, visible=self._why_shown.value and index is None)
            if index is None:
                self.marks.show_trail(row.q, row.time, visible=self._trail.value)
                self.goal.show(snapshot.goal, snapshot.goal_pose, snapshot.posture)
                self.goal.ghost.hide_where_at(row.q)
                self.surface.show(snapshot, self.robot, self._body_now, self._pair(), self._viewpoint)
                added = self.plots.add(snapshot, self._clearances[0].distance if self._clearances else np.inf)
                if snapshot.recording and added is not None:
                    self.recorder.plotted.append(added)
                self.plots.draw(now)
                self._show_words(now, snapshot)
            else:
                way = [past.q for past in self.recorder.rows[: index + 1]]
                self.marks.show_way(way, visible=self._trail.value)
                self.plots.draw_past(now, self.recorder.plotted, row.time)
                self._show_replay_words(now, row)
            self.shown = row.time, self._measured
            return row

    def _take(self, snapshot: m.Snapshot) -> None:
        """Another robot, body or choice of obstacles."""
        before = self.last
        if snapshot.scenario.robot != self._choice:
            self.recorder.leave_arm()
            self._remove_robot()
            self._choice = snapshot.scenario.robot
            self._set_robot(snapshot.scenario, load_robot(snapshot.scenario))
        self.last = snapshot
        numbers = snapshot.numbers[snapshot.method]
        recipe = recipe_of(method_named(snapshot.method), numbers, snapshot.scenario, draft=snapshot.draft)
        if self._body is None or recipe != self._recipe:
            self._load_body(recipe)
        if before is None or snapshot.edition != before.edition:
            self._forget_clearances()
            self.obstacle_panel.set_names(tuple(thing.name for thing in snapshot.things))
        if before is not None and begins_anew(before, snapshot):
            self.least_clearance = np.inf
            self.marks.clear_trail()
            self.surface.clear_trail()

    def _set_replayed(self, replayed: bool) -> None:
        """Whether the scene shows the recording: what belongs to the live state alone is hidden then."""
        self._replayed = replayed
        self._forget_clearances()
        self._show_goal()
        if replayed:
            self.surface.clear()
        else:
            self.plots.draw(clock.monotonic(), at_once=True, anew=True)

    def _show_goal(self) -> None:
        self.goal.set_visible(self._ghost.value and not self._replayed)

    def _forget_clearances(self) -> None:
        """What was measured is of other obstacles, or of another time."""
        self.epoch += 1
        self._clearances, self._measured = (), np.nan

    def stamp(self) -> int:
        """Sends what is not sent yet, and a number after it: a browser that has the number has all of it."""
        with self._lock:
            self.plots.draw(clock.monotonic(), at_once=True)
            self._told = 0.0
            self._stamp += 1
            self._say(self._text)
            return self._stamp

    def take_clearances(self, found: tuple[Clearance, ...], time: float, epoch: int) -> None:
        """What the exact meshes say of a time [s], nearest first, and the `epoch` in which it was asked for."""
        with self._lock:
            if epoch != self.epoch:
                return
            self._clearances, self._measured = found, time
            if found and not self._replayed:
                self.least_clearance = min(self.least_clearance, found[0].distance)

    def take_rows(self, rows: list[m.Row]) -> None:
        """Rows of a recording."""
        with self._lock:
            self.recorder.take(rows)

    def tell(self, note: m.Preparing | m.Failed) -> None:
        """Shows what the loop has to say beside its state."""
        with self._lock:
            if isinstance(note, m.Preparing):
                self._say(in_box(f"preparing: {html.escape(note.note)} …"))
                return
            if isinstance(note.refused, m.AddObstacle):
                self.obstacle_panel.refused(note.refused.thing.name)
            if isinstance(note.refused, m.SetNumbers):
                self.tuning.refused()
            if note.fatal:
                self._say(in_box(f"The loop ended: {html.escape(note.message)}"))
        for client in self._server.get_clients().values():
            client.add_notification("Not possible", note.message, color="red", auto_close_seconds=8.0)

    def report(self, what: str, error: Exception) -> None:
        """Logs what went wrong, with where, and says it on the page; the same not twice in a row."""
        text = f"{what}: {type(error).__name__}: {error}"
        if text != self._reported:
            self._reported = text
            logging.getLogger(__name__).error(text, exc_info=error)
            self.tell(m.Failed(text))

    def stop(self) -> None:
        """Ends what runs beside the page."""
        self.compare.stop()
        self.surface.stop()

    def _show_words(self, now: float, snapshot: m.Snapshot) -> None:
        touch = (
            f"touches: {html.escape(', '.join(snapshot.contacts))}"
            if snapshot.contacts
            else "touches nothing"
        )
        status = [f"status: {snapshot.status}"] if snapshot.status else []
        speed = f"{snapshot.timing.real_time:.2f} × real time" if snapshot.running else "paused"
        least = f" (least so far {1e3 * self.least_clearance:.0f} mm)"
        state = f"{touch} · {snapshot.time:.1f} s · {speed}"
        coarse = (
            [f"coarse body; the fine one is made: {html.escape(snapshot.refining)}"] if snapshot.draft else []
        )
        facts = [*self._nearest_facts(snapshot.things, least), state, *status, *coarse]
        self._tell(now, begun(snapshot.words), facts, snapshot.events)

    def _show_replay_words(self, now: float, row: m.Row) -> None:
        self._tell(
            now, f"Replay of {row.time:.2f} s", [*self._nearest_facts(row.things), "the loop is paused"]
        )

    def _nearest_facts(self, things: tuple[SceneObstacle, ...], more: str = "") -> list[str]:
        if not self._clearances:
            return []
        first = self._clearances[0]
        pair = f"{html.escape(first.link)} – {html.escape(thing_of(first.obstacle, things))}"
        return [f"exact meshes: {pair} {1e3 * first.distance:.0f} mm{more}"]

    def _tell(
        self, now: float, words: str, facts: list[str], events: tuple[tuple[float, str], ...] = ()
    ) -> None:
        if now - self._told >= WORDS_EVERY:
            self._told = now
            self._say(in_box(f"{html.escape(words)}.", "<br>".join(facts), events))

    def _say(self, text: str) -> None:
        self._text, content = text, stamped(text, self._stamp)
        if content != self._words.content:
            self._words.content = content

    def _look_at(self, scenario: Scenario, meshes: dict[str, trimesh.Trimesh]) -> None:
        """What the window shows, arm, goal and obstacles, and from where they are seen best."""
        robot = self.robot
        start = coordinates(scenario.start, robot, "start")
        ends = start, goal_posture(scenario, robot, start).q
        solids = [thing.triangles for thing in things_of(scenario)]
        arrows = robot.pose(ends[1], self.tip)[:3, 3] + GIZMO_SIZE * reach(robot) * np.vstack(
            [np.eye(3), -np.eye(3)]
        )
        self._places = np.vstack([extent(robot, meshes, ends, solids, NEAR * reach(robot)), arrows])
        frames = np.array([robot.pose(q, frame.name)[:3, 3] for q in ends for frame in robot.frames])
        self._view = clear_view(frames, solids)
        self._point_cameras()

    def _point_cameras(self) -> None:
        """Points all windows, those to come as well, at the scene; the curved space has the upper left."""
        high = UNDER_CORNER if self._curved.value else HIGH
        self._viewpoint = Viewpoint.of(self._places, self._view, high)
        point_cameras(self._server, self._viewpoint)

    def _add_switches(self) -> None:
        gui = self._server.gui
        self._ghost = gui.add_checkbox("goal", True)
        self._why_shown = gui.add_checkbox("path, pull and what binds", True)
        self._body_shown = gui.add_checkbox("body", False)
        self._nearest = gui.add_checkbox("nearest line", True)
        self._trail = gui.add_checkbox("trail", True)
        self._metric = gui.add_checkbox("metric", False)
        self._curved = gui.add_checkbox("curved space", False)
        self._curved.on_update(lambda _: self._point_cameras())
        self._first: Any = gui.add_dropdown("over", ("-",))
        self._second: Any = gui.add_dropdown("and", ("-",))
        gui.add_html(colours.legend_html())
        self._ghost.on_update(lambda _: self._show_goal())
        self._body_shown.on_update(lambda _: self._set_body_visible())

    def _set_robot(self, scenario: Scenario, robot: Robot) -> None:
        self.robot, self.tip = robot, tip_of(robot)
        meshes = link_meshes(robot)
        self._look_at(scenario, meshes)
        names = tuple(robot.coordinate_names)
        self._first.options = self._second.options = names
        self._first.value, self._second.value = names[0], names[min(1, len(names) - 1)]
        self.arm = ArmView(self._server, robot, meshes, "/arm")
        self.marks = Marks(self._server, robot, self.tip)
        self.why = Why(self._server, robot, self.tip)
        self._body: BodyView | None = None
        with self._goal_tab:
            self.goal = GoalControl(self._server, robot, meshes, self.tip, self.send)
        self._show_goal()

    def _remove_robot(self) -> None:
        self.compare.stop()
        self.surface.clear()
        for part in (self._body, self.arm, self.marks, self.why, self.goal):
            if part is not None:
                part.remove()

    def _load_body(self, recipe: Recipe) -> None:
        """The body that a method needs; the loop has made it, so it comes from the cache."""
        if self._body is not None:
            self._body.remove()
        self._recipe, self._body_now = recipe, make_body(self.robot, recipe)
        self._body = BodyView(
            self._server, self.robot, self._body_now, "/arm", visible=self._body_shown.value
        )

    def _pair(self) -> tuple[int, int] | None:
        """The two joints over which the curved space is shown, None when it is not."""
        names = list(self.robot.coordinate_names)
        pair = self._first.value, self._second.value
        coarse = self.last is not None and self.last.draft
        if not self._curved.value or coarse or not set(pair) <= set(names):
            return None
        return names.index(pair[0]), names.index(pair[1])

    def _set_body_visible(self) -> None:
        if self._body is not None:
            self._body.set_visible(self._body_shown.value)

    def _on_loop(self, event: Any) -> None:
        match event.target.value:
            case "Run":
                self.send(m.SetRunning(True))
            case "Pause":
                self.send(m.SetRunning(False))
            case _:
                self.send(m.Restart())


def begins_anew(before: m.Snapshot, now: m.Snapshot) -> bool:
    """Whether the motion of the state before has ended with a restart, or another scenario."""
    still_begins = before.time == 0.0 and now.edition != before.edition
    return now.time < before.time or now.scenario != before.scenario or still_begins


def live_row(snapshot: m.Snapshot) -> m.Row:
    """The state of the loop as a moment."""
    return m.Row(snapshot.time, snapshot.q, snapshot.things, snapshot.poses, snapshot.metric)
