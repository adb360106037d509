"""The method and its parameters, each with its unit, its range and what it trades."""

from __future__ import annotations

import threading
from typing import TYPE_CHECKING, Any

from sidestep.studio import messages as m
from sidestep.studio.export import python_snippet
from sidestep.studio.methods import METHODS, Method, Numbers, method_named
from sidestep.studio.page.note import add_note

if TYPE_CHECKING:
    import viser

    from sidestep.studio.page.view import View

SETTLE = 0.25  # [s] without a further change of a slider before the system is made anew


class TuningPanel:
    """Chooses among `METHODS` and sets their numbers while the loop runs."""

    def __init__(self, server: viser.ViserServer, view: View) -> None:
        self._view, self._server = view, server
        self._labels = {method.label: method.name for method in METHODS.values()}
        gui = server.gui
        self._choice: Any = gui.add_dropdown("method", tuple(self._labels))
        self._choice.on_update(self._chose)
        self._sentence = gui.add_markdown("")
        self._folder = gui.add_folder("Parameters")
        self._sliders: dict[str, Any] = {}
        self._notes: list[Any] = []
        self._shown: Method | None = None
        self._timer: threading.Timer | None = None
        gui.add_button("Recommended values").on_click(self._reset)
        gui.add_button("Export as Python").on_click(self._export)
        add_note(gui, "The system with these numbers, as code.")

    def show(self, snapshot: m.Snapshot) -> None:
        """Shows the method and the numbers that the loop has."""
        method = method_named(snapshot.method)
        if method is not self._shown:
            self._lay_out(method, snapshot.numbers[method.name])
            self._numbers = dict(snapshot.numbers[method.name])
        elif snapshot.numbers[method.name] != self._numbers:
            self._numbers = dict(snapshot.numbers[method.name])
            for name, value in self._numbers.items():
                slider = self._sliders[name]
                slider.min, slider.max = min(slider.min, value), max(slider.max, value)
                slider.value = value

    def _lay_out(self, method: Method, numbers: Numbers) -> None:
        self._shown = method
        self._choice.value = method.label
        self._sentence.content = method.sentence
        for part in (*self._sliders.values(), *self._notes):
            part.remove()
        self._sliders, self._notes = {}, []
        with self._folder:
            for parameter in method.parameters:
                unit = f" [{parameter.unit}]" if parameter.unit else ""
                value = numbers[parameter.name]  # that of a file may be out of the range
                slider = self._server.gui.add_slider(
                    f"{parameter.name.replace('_', ' ')}{unit}",
                    min=min(parameter.lower, value),
                    max=max(parameter.upper, value),
                    step=(parameter.upper - parameter.lower) / 1000.0,
                    initial_value=value,
                )
                slider.on_update(self._moved)
                self._sliders[parameter.name] = slider
                note = f"{parameter.sentence} Recommended: {parameter.default:g}."
                self._notes.append(add_note(self._server.gui, note))

    def _chose(self, event: Any) -> None:
        if event.client is not None:
            self._view.send(m.SetMethod(self._labels[self._choice.value]))

    def _moved(self, event: Any) -> None:
        if event.client is None:
            return
        if self._timer is not None:
            self._timer.cancel()
        self._timer = threading.Timer(SETTLE, self._send_numbers)
        self._timer.daemon = True
        self._timer.start()

    def _export(self, event: Any) -> None:
        last = self._view.last
        if last is None or event.client is None:
            return
        code = python_snippet(last)
        with event.client.gui.add_modal("As Python") as modal:
            event.client.gui.add_markdown(f"```python\n{code}```")
            download = event.client.gui.add_button("Download")
            close = event.client.gui.add_button("Close")
        download.on_click(
            lambda _: event.client.send_file_download("system.py", code.encode(), save_immediately=True)
        )
        close.on_click(lambda _: modal.close())

    def _send_numbers(self) -> None:
        if self._shown is not None:
            values = {name: float(slider.value) for name, slider in self._sliders.items()}
            self._view.send(m.SetNumbers(self._shown.name, values))

    def _reset(self, _: Any) -> None:
        if self._shown is not None:
            self._view.send(m.SetNumbers(self._shown.name, self._shown.defaults))
