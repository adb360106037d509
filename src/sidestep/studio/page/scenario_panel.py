"""Scenarios: load a shipped one or a file, save what is there."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING, Any

import yaml

from sidestep.scenario import Scenario, shipped_scenarios
from sidestep.studio.export import not_kept, save_scenario, scenario_now
from sidestep.studio.page.note import add_note

if TYPE_CHECKING:
    import viser

    from sidestep.studio.page.view import View


THESIS = tuple(name.removeprefix("thesis-") for name in shipped_scenarios() if name.startswith("thesis-"))


class ScenarioPanel:
    """Loads scenarios, and saves the present state as one into the folder where the studio was started."""

    def __init__(self, server: viser.ViserServer, view: View, folder: Path) -> None:
        self._view, self._folder = view, folder
        gui = server.gui
        gui.add_button_group("thesis", THESIS).on_click(self._load_thesis)
        add_note(gui, "Scenarios of the thesis, by section, with the method they are written for.")
        self._shipped: Any = gui.add_dropdown("shipped", shipped_scenarios())
        gui.add_button("Load").on_click(self._load_shipped)
        self._upload: Any = gui.add_upload_button("Load a file …", mime_type=".yaml,.yml")
        self._upload.on_upload(self._load_upload)
        gui.add_divider()
        self._name: Any = gui.add_text("name", "my-scenario")
        gui.add_button("Save").on_click(self._save)
        gui.add_button("Download").on_click(self._download)
        add_note(gui, f"Arm, goal, obstacles and method as they are now; Save writes into {folder}.")

    def _load_thesis(self, event: Any) -> None:
        self._view.load(Scenario.load(f"thesis-{event.target.value}"))

    def _load_shipped(self, _: Any) -> None:
        self._view.load(Scenario.load(str(self._shipped.value)))

    def _load_upload(self, event: Any) -> None:
        file = event.target.value
        with self._view.telling(event.client):
            text = file.content.decode("utf-8", errors="replace")
            scenario = Scenario.from_text(text, file=file.name, folder=self._folder)
            self._view.load(scenario)

    def _save(self, event: Any) -> None:
        with self._view.telling(event.client):
            path = save_scenario(self._now(), self._folder)
            self._told("Saved", str(path), event.client)

    def _download(self, event: Any) -> None:
        with self._view.telling(event.client):
            scenario = self._now()
            text = yaml.safe_dump(scenario.to_document(), sort_keys=False, allow_unicode=True)
            event.client.send_file_download(f"{scenario.name}.yaml", text.encode(), save_immediately=True)
            self._told("Downloaded", f"{scenario.name}.yaml", event.client)

    def _told(self, what: str, where: str, client: Any) -> None:
        lost = "" if self._view.last is None else not_kept(self._view.last)
        colour = "orange" if lost else "green"
        client.add_notification(what, f"{where}. {lost}", color=colour, auto_close_seconds=8.0)

    def _now(self) -> Scenario:
        name = str(self._name.value)
        if not re.fullmatch(r"[A-Za-z0-9][A-Za-z0-9._-]*", name):
            raise ValueError(f"name is {name!r}; allowed: letters, digits, dot, dash and underscore")
        if self._view.last is None:
            raise ValueError("the loop does not run yet")
        return scenario_now(self._view.last, name=name)
