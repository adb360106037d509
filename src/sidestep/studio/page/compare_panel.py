"""Another method beside the one that moves the arm: a ghost, and both with time and clearance."""

from __future__ import annotations

import html
from typing import TYPE_CHECKING, Any

import numpy as np

from sidestep.studio import messages as m
from sidestep.studio.comparison import Comparison, Tally
from sidestep.studio.methods import METHODS
from sidestep.studio.page import colours
from sidestep.studio.page.arm import ArmView, link_meshes
from sidestep.studio.page.loop_link import LoopLink
from sidestep.studio.page.note import add_note

if TYPE_CHECKING:
    import viser


NOTE = (
    "Both start again, go to the same goal and see the same obstacles: the method that is chosen under Advanced as the "
    "solid arm, this one as a ghost. Drag an obstacle, and both meet it. Loading a scene ends it."
)


class ComparePanel:
    """Starts and ends a comparison, and shows how it stands."""

    def __init__(self, server: viser.ViserServer, loop: LoopLink) -> None:
        self._server, self._loop = server, loop
        self._labels = {method.label: method.name for method in METHODS.values()}
        gui = server.gui
        usual = METHODS["reactive"].label
        self._choice: Any = gui.add_dropdown("compare with", tuple(self._labels), initial_value=usual)
        gui.add_button("Compare").on_click(self._begin)
        gui.add_button("End").on_click(lambda _: self.stop())
        add_note(gui, NOTE)
        self._table: Any = gui.add_html("")
        self._comparison: Comparison | None = None
        self._ghost: ArmView | None = None

    @property
    def running(self) -> Comparison | None:
        """The comparison that runs."""
        return self._comparison

    def send(self, command: m.Command) -> None:
        """What the loop is told, the other one is told as well."""
        if isinstance(command, m.Load):
            self.stop()
        elif self._comparison is not None:
            self._comparison.send(command)

    def show(self, snapshot: m.Snapshot, clearance: float) -> None:
        """Shows the other method's arm, and the figures of both."""
        comparison = self._comparison
        if comparison is None:
            return
        other = comparison.look(snapshot, clearance)
        if other is not None and self._ghost is not None:
            self._ghost.show(other.q)
        if comparison.error:
            content = f'<div style="{BOX}">It ended: {html.escape(comparison.error)}</div>'
        else:
            content = table(METHODS[snapshot.method].label, METHODS[comparison.method].label, comparison)
        if content != self._table.content:
            self._table.content = content

    def stop(self) -> None:
        """Ends the comparison, if there is one."""
        comparison, self._comparison = self._comparison, None
        if comparison is not None:
            comparison.stop()
        if self._ghost is not None:
            self._ghost.remove()
            self._ghost = None
        self._table.content = ""

    def _begin(self, event: Any) -> None:
        with self._loop.telling(event.client):
            last = self._loop.last
            if last is None:
                raise ValueError("the loop does not run yet")
            method = self._labels[str(self._choice.value)]
            if method == last.method:
                raise ValueError("this method moves the arm already; choose another one")
            self.stop()
            self._table.content = f'<div style="{BOX}">preparing …</div>'
            loop = self._loop
            loop.send(m.VisitGoals(()))
            comparison = Comparison(last, method, loop.robot, loop.report)
            self._ghost = ArmView(
                self._server, loop.robot, link_meshes(loop.robot), "/other", ghost=colours.OTHER
            )
            self._comparison = comparison
            if last.goal is not None:
                loop.send(m.SetJointGoal(last.goal))
            loop.send(m.Restart())


BOX = "font-size:13px;line-height:1.4;padding:2px 10px"


def table(own: str, other: str, comparison: Comparison) -> str:
    """Both methods with time, clearance and contact."""
    rows = "".join(
        f'<tr><td style="padding:3px 8px 3px 0"><span style="color:{colour}">■</span> {html.escape(name)}</td>'
        f'<td style="padding:3px 8px">{_time(tally)}</td><td style="padding:3px 0">{_clearance(tally)}</td></tr>'
        for name, tally, colour in (
            (own, comparison.own, colours.LINK),
            (other, comparison.other, colours.OTHER),
        )
    )
    return (
        f'<div id="comparison" style="{BOX}"><table><tr style="opacity:0.7"><td>method</td>'
        f'<td style="padding:0 8px">time to goal</td><td>least clearance</td></tr>{rows}</table></div>'
    )


def _time(tally: Tally) -> str:
    return f"on the way, {tally.time:.1f} s" if tally.arrived is None else f"<b>{tally.arrived:.1f} s</b>"


def _clearance(tally: Tally) -> str:
    if tally.touched:
        return "<b>touched</b>"
    return "–" if not np.isfinite(tally.clearance) else f"{1e3 * tally.clearance:.0f} mm"
