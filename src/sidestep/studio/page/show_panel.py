"""The tab that says what is shown beside the arm."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from sidestep.studio.page import colours

if TYPE_CHECKING:
    import viser


class ShowPanel:
    """Switches of what is drawn; each is read where it is drawn."""

    def __init__(self, server: viser.ViserServer) -> None:
        gui = server.gui
        self.goal = gui.add_checkbox("goal", True)
        self.why = gui.add_checkbox("path, attraction and what binds", True)
        self.body = gui.add_checkbox("body", False)
        self.nearest = gui.add_checkbox("nearest line", True)
        self.trail = gui.add_checkbox("trail", True)
        self.metric = gui.add_checkbox("metric", False)
        self.curved = gui.add_checkbox("curved space", False)
        self._first: Any = gui.add_dropdown("over", ("-",))
        self._second: Any = gui.add_dropdown("and", ("-",))
        gui.add_html(colours.legend_html())

    def on_change(
        self, *, goal: Callable[[], None], body: Callable[[], None], curved: Callable[[], None]
    ) -> None:
        """What to do at once when one of these is switched; the others are read at the next state."""
        self.goal.on_update(lambda _: goal())
        self.body.on_update(lambda _: body())
        self.curved.on_update(lambda _: curved())

    def set_joints(self, names: tuple[str, ...]) -> None:
        """The joints over which the curved space can be shown."""
        self._first.options = self._second.options = names
        self._first.value, self._second.value = names[0], names[min(1, len(names) - 1)]

    def pair(self, names: tuple[str, ...], *, draft: bool) -> tuple[int, int] | None:
        """The two joints over which the curved space is shown, None when it is not; of a draft it never is."""
        pair = self._first.value, self._second.value
        if not self.curved.value or draft or not set(pair) <= set(names):
            return None
        return names.index(pair[0]), names.index(pair[1])
