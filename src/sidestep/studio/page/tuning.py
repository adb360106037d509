"""The method and its parameters, each with its unit, its range and what it trades."""

from __future__ import annotations

import threading
from collections.abc import Collection
from typing import TYPE_CHECKING, Any

from sidestep.studio import messages as m
from sidestep.studio.methods import METHODS, method_named
from sidestep.studio.page.loop_link import LoopLink
from sidestep.studio.page.note import add_note
from sidestep.studio.parameters import Method, Numbers, Parameter
from sidestep.studio.snippet import python_snippet

if TYPE_CHECKING:
    import viser


SETTLE = 0.25  # [s] without a further change before the system is made anew
STEPS = 1000  # of a slider
AS_IT_TAKES = "as many as it takes"  # None, of numbers of ellipsoids


class TuningPanel:
    """Chooses among `METHODS` and sets their numbers while the loop runs, in a tab of the page."""

    def __init__(self, server: viser.ViserServer, loop: LoopLink, tab: Any) -> None:
        self._loop, self._server, self._tab = loop, server, tab
        self._labels = {method.label: method.name for method in METHODS.values()}
        gui = server.gui
        self._choice: Any = gui.add_dropdown("method", tuple(self._labels))
        self._choice.on_update(self._chose)
        self._sentence = gui.add_markdown("")
        self._folders: list[Any] = []
        self._controls: dict[str, Any] = {}
        self._shown: Method | None = None
        self._units: frozenset[str] = frozenset()  # of the joints
        self._numbers: Numbers = {}
        self._changed: Numbers = {}  # and not sent yet
        self._timer: threading.Timer | None = None
        gui.add_button("Export as Python").on_click(self._export)
        gui.add_button("Recommended values").on_click(self._reset)
        add_note(
            gui,
            "Sets every number below, except those of the body, which takes time to make. Each method keeps its own "
            "numbers.",
        )
        gui.add_divider()

    def show(self, snapshot: m.Snapshot) -> None:
        """Shows the method and the numbers that the loop has."""
        method, numbers = method_named(snapshot.method), snapshot.numbers[snapshot.method]
        units = frozenset(self._loop.robot.coordinate_units)
        if method is not self._shown or units != self._units:
            self._units = units
            self._lay_out(method, numbers)
        elif numbers != self._numbers:
            for parameter in method.parameters:
                if numbers[parameter.name] != self._numbers.get(parameter.name):
                    show_value(self._controls[parameter.name], parameter, numbers[parameter.name])
        self._numbers = dict(numbers)

    def refused(self) -> None:
        """Numbers that were sent are not taken: those of the loop are shown again."""
        self._numbers = {}

    def _lay_out(self, method: Method, numbers: Numbers) -> None:
        self._shown, self._changed = method, {}
        self._choice.value = method.label
        self._sentence.content = method.sentence
        for folder in self._folders:
            folder.remove()
        self._folders, self._controls = [], {}
        body_last = sorted(method.parameters, key=lambda parameter: parameter.body)
        titles = dict.fromkeys(parameter.folder for parameter in body_last)
        with self._tab:
            for title in titles:
                folder = self._server.gui.add_folder(title, expand_by_default=not self._folders)
                self._folders.append(folder)
                with folder:
                    for parameter in method.parameters:
                        if parameter.folder == title:
                            self._add(parameter, numbers[parameter.name])

    def _add(self, parameter: Parameter, value: Any) -> None:
        control = add_control(self._server.gui, parameter, value, joints=self._units)
        control.on_update(lambda event: self._moved(event, parameter))
        self._controls[parameter.name] = control
        usual = label_of(parameter.default) if parameter.options else f"{parameter.default:g}"
        add_note(self._server.gui, f"{parameter.sentence} Recommended: {usual}.")

    def _chose(self, event: Any) -> None:
        if event.client is not None:
            self._loop.send(m.SetMethod(self._labels[self._choice.value]))

    def _moved(self, event: Any, parameter: Parameter) -> None:
        if event.client is None:
            return
        self._changed[parameter.name] = value_of(event.target, parameter)
        if self._timer is not None:
            self._timer.cancel()
        self._timer = threading.Timer(SETTLE, self._send_numbers)
        self._timer.daemon = True
        self._timer.start()

    def _export(self, event: Any) -> None:
        last = self._loop.last
        if last is None or event.client is None:
            return
        code = python_snippet(last)
        with event.client.gui.add_modal("As Python") as modal:
            event.client.gui.add_markdown(f"```python\n{code}```")
            download = event.client.gui.add_button("Download")
            close = event.client.gui.add_button("Close")
        download.on_click(
            lambda _: event.client.send_file_download("controller.py", code.encode(), save_immediately=True)
        )
        close.on_click(lambda _: modal.close())

    def _send_numbers(self) -> None:
        changed, self._changed = self._changed, {}
        if self._shown is not None and changed:
            self._loop.send(m.SetNumbers(self._shown.name, changed))

    def _reset(self, _: Any) -> None:
        if self._shown is not None:
            usual = {p.name: p.default for p in self._shown.parameters if not p.body}
            self._loop.send(m.SetNumbers(self._shown.name, usual))


def unit_for(unit: str, joints: Collection[str]) -> str:
    """The unit of a number for joints with these units: "rad/s" is "m/s" of sliding joints."""
    if "rad" not in unit:
        return unit
    return " | ".join(unit.replace("rad", joint) for joint in ("rad", "m") if joint in joints)


def add_control(gui: Any, parameter: Parameter, value: Any, *, joints: Collection[str] = ("rad",)) -> Any:
    """A slider or a list for a parameter; what a file says may be out of its range, or not in the list.

    `joints` are the units of the robot's joints.
    """
    label = parameter.field.replace("_", " ")
    if parameter.options:
        options = tuple(dict.fromkeys(label_of(option) for option in (*parameter.options, value)))
        return gui.add_dropdown(label, options, initial_value=label_of(value))
    lower, upper = parameter.slider
    unit = f" [{unit_for(parameter.unit, joints)}]" if parameter.unit else ""
    step = 1 if parameter.whole else (upper - lower) / STEPS
    return gui.add_slider(
        f"{label}{unit}", min=min(lower, value), max=max(upper, value), step=step, initial_value=value
    )


def show_value(control: Any, parameter: Parameter, value: Any) -> None:
    """Moves a control of `add_control` to a value."""
    if parameter.options:
        if label_of(value) not in control.options:
            control.options = (*control.options, label_of(value))
        control.value = label_of(value)
        return
    control.min, control.max = min(control.min, value), max(control.max, value)
    control.value = value


def value_of(control: Any, parameter: Parameter) -> Any:
    """The value that a control of `add_control` shows."""
    if parameter.options:
        known = {label_of(option): option for option in parameter.options}
        text = str(control.value)
        return known[text] if text in known else int(text) if text.isdigit() else text
    return parameter.kept(round(control.value) if parameter.whole else control.value)


def label_of(option: Any) -> str:
    """An option of a list as text."""
    if isinstance(option, bool):
        return "on" if option else "off"
    return AS_IT_TAKES if option is None else str(option)
