"""A page that plays a recording: arm, obstacles, status and why, with a slider over time."""

from __future__ import annotations

import html
import threading
import time as clock
from typing import Any

import numpy as np
import numpy.typing as npt
import trimesh

from sidestep.arm import Arm
from sidestep.body import Body
from sidestep.report.recorded_run import RecordedRun
from sidestep.robot import Robot
from sidestep.studio.guarded_page import GuardedPage
from sidestep.studio.page import colours
from sidestep.studio.page.arm import ArmView, BodyView, reach
from sidestep.studio.page.camera import Viewpoint
from sidestep.studio.page.scene import point_cameras, set_up_scene
from sidestep.studio.show.reading import with_links

Array = npt.NDArray[np.float64]

PORT = 8893  # beside those of the other pages
WIDTH = 400  # [px] of the panel
FRAME = 1.0 / 30.0  # [s] between two pictures
MOST_BALLS = 6000  # of obstacles that are drawn
FAR = 1e3  # [m] obstacles beyond are out of the scene: sources that are empty
LEAST_BALL = 0.004  # [m] radius of a ball that is still seen
LAST_EVENTS = 6  # lines of what happened


class RecordingView(GuardedPage):
    """The page: the recorded arm among the obstacles as they were; stop it with `stop`, or use it as a context.

    Args:
        run: of `load_recording` with `scenes=True`; without these no obstacles are shown.
        port: where to listen on this machine; 0: any that is free.

    Raises:
        ValueError: the recording has no step. OSError: the port is taken. ModuleNotFoundError: viser is not installed.
    """

    def __init__(self, run: RecordedRun, *, port: int = PORT) -> None:
        if len(run) == 0:
            raise ValueError(
                f"{', '.join(map(str, run.paths))}: no step was recorded, there is nothing to play"
            )
        super().__init__(port)
        self.run = run
        self._ball = trimesh.creation.icosphere(subdivisions=1)
        self._scene: Any = None
        self._obstacles: Any = None
        self._lock, self._stopping = threading.Lock(), threading.Event()
        try:
            self._robot = self._draw_arm(run)
            self._add_controls()
            self.show(0.0)
        except BaseException:
            self.server.stop()
            raise
        self._thread = threading.Thread(target=self._play, daemon=True)
        self._thread.start()

    @property
    def step(self) -> int:
        """The step that is shown."""
        return self._step

    def show(self, seconds: float) -> None:
        """Shows the moment so long after the first step [s]: the last step until then."""
        run = self.run
        moment = run.time[0] + seconds
        step = max(int(np.searchsorted(run.time, moment + 1e-9, side="right")) - 1, 0)
        with self._lock, self.server.atomic():
            self._step = step
            q = run.q[step]
            if np.isfinite(q).all():
                self._arm.show(q)
            self._body.colour({link: colours.shade(c) for link, c in self._clearances(moment).items()})
            self._show_obstacles(moment)
            self._words.content = moment_html(run, step)

    def wait(self) -> None:
        """Returns when the page is stopped."""
        while not self._stopping.wait(0.2):
            pass

    def stop(self) -> None:
        """Ends thread and server."""
        self._stopping.set()
        self._thread.join(timeout=2.0)
        self.server.stop()

    def _draw_arm(self, run: RecordedRun) -> Robot:
        set_up_scene(self.server)
        self.server.gui.configure_theme(control_width="large", show_logo=False, show_share_button=False)
        self.server.gui.main_panel.dock_right()
        self.server.gui.main_panel.set_width(WIDTH)
        arm = Arm(run.arm)
        robot = with_links(arm.robot)
        self._arm = ArmView(self.server, robot, {}, "/arm", frames=[frame.name for frame in robot.frames])
        self._body = BodyView(self.server, robot, Body.of_arm(arm), "/arm", visible=True)
        size = reach(robot)
        known = run.q[np.isfinite(run.q).all(axis=1)]
        shown = known[:: max(1, len(known) // 20)] if len(known) else robot.neutral[None]
        places = [robot.pose(q, frame.name)[:3, 3] for q in shown for frame in robot.frames]
        around = 0.1 * size * np.array([[1.0, 1.0, 1.0], [-1.0, -1.0, 0.0]])
        point_cameras(self.server, Viewpoint.of(np.concatenate([place + around for place in places])))
        return robot

    def _add_controls(self) -> None:
        gui = self.server.gui
        self._slider: Any = gui.add_slider(
            "time [s]", min=0.0, max=max(self.run.duration, 1e-3), step=1e-3, initial_value=0.0
        )
        self._slider.on_update(lambda event: self.show(float(self._slider.value)))
        self._playing: Any = gui.add_checkbox("play", False)
        self._speed: Any = gui.add_dropdown("speed", ("0.1", "0.25", "0.5", "1", "2", "5"), initial_value="1")
        self._words: Any = gui.add_html("")

    def _play(self) -> None:
        last = clock.monotonic()
        while not self._stopping.wait(FRAME):
            now = clock.monotonic()
            elapsed, last = now - last, now
            if self._playing.value:
                after = float(self._slider.value) + elapsed * float(self._speed.value)
                self._slider.value = 0.0 if after > self.run.duration else after  # which shows it

    def _clearances(self, moment: float) -> dict[str, float]:
        run = self.run
        if len(run.link_time) == 0:
            return {}
        k = max(0, int(np.searchsorted(run.link_time, moment, side="right")) - 1)
        values = zip(run.links[:-1], run.link_clearance[k, :-1], strict=True)
        return {link: float(value) if np.isfinite(value) else np.inf for link, value in values}

    def _show_obstacles(self, moment: float) -> None:
        run = self.run
        if not run.has_scenes:
            return
        k = max(0, int(np.searchsorted(run.link_time, moment, side="right")) - 1)
        points, radii = run.scene(k)
        place = points.__array_interface__["data"][0]  # moments without a change share one scene
        if place == self._scene:
            return
        self._scene = place
        near = np.flatnonzero(np.abs(points).max(axis=1, initial=0.0) < FAR)
        if len(near) > MOST_BALLS:  # any of them: every third would leave stripes
            near = np.sort(np.random.default_rng(0).choice(near, MOST_BALLS, replace=False))
        if self._obstacles is not None:
            self._obstacles.remove()
            self._obstacles = None
        if len(near):
            self._obstacles = self.server.scene.add_batched_meshes_simple(
                "/obstacles",
                self._ball.vertices.astype(np.float32),
                self._ball.faces.astype(np.uint32),
                batched_wxyzs=np.tile(np.array([1.0, 0.0, 0.0, 0.0], dtype=np.float32), (len(near), 1)),
                batched_positions=points[near],
                batched_scales=np.maximum(radii[near], LEAST_BALL),
                batched_colors=colours.batched(colours.rgb(colours.OBSTACLE)),
                lod="off",
                cast_shadow=False,
                receive_shadow=False,
            )


def moment_html(run: RecordedRun, step: int) -> str:
    """Time, activity, status with the reason, and what happened last."""
    from sidestep.report.recorded_figures import ACTIVITY_COLOURS, STATUS_COLOURS

    def mark(name: str, colour: str) -> str:
        shade = (
            colour if colour.startswith("#") else f"rgb({','.join([str(round(255 * float(colour)))] * 3)})"
        )
        return (
            f"<span style='display:inline-block;width:10px;height:10px;border:1px solid #888;"
            f"background:{shade}'></span> "
            f"<b>{name.replace('_', ' ')}</b>"
        )

    status, activity = str(run.status[step]), str(run.activity[step])
    rows = [
        f"t = {run.time[step]:.3f} s, step {step:,}",
        f"{mark(activity, ACTIVITY_COLOURS[activity])} &nbsp; {mark(status, STATUS_COLOURS[status])}",
        html.escape(run.explain(step)),
        "<b>What happened until now</b>",
    ]
    past = [event for event in run.events if event.step <= step][-LAST_EVENTS:]
    rows += [f"{event.time:.3f} s: {html.escape(event.words)}" for event in reversed(past)]
    style = "font-size:13px;line-height:1.4;padding:2px 10px;overflow-wrap:anywhere"
    return f"<div style='{style}'>{''.join(f'<div>{row}</div>' for row in rows)}</div>"
