"""Scenarios: load a shipped one or a file, save what is there."""

from __future__ import annotations

import atexit
import re
import shutil
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sidestep.scenario import Scenario, shipped_scenarios
from sidestep.studio.export import (
    not_kept,
    packed_scenario,
    save_scenario,
    scenario_now,
    unpacked_scenario,
)
from sidestep.studio.page.loop_link import LoopLink
from sidestep.studio.page.note import add_note

if TYPE_CHECKING:
    import viser


THESIS = tuple(name.removeprefix("thesis-") for name in shipped_scenarios() if name.startswith("thesis-"))


class ScenarioPanel:
    """Loads scenarios, and saves the present state as one into the folder where the studio was started."""

    def __init__(self, server: viser.ViserServer, loop: LoopLink, folder: Path) -> None:
        self._loop, self._folder = loop, folder
        gui = server.gui
        gui.add_button_group("thesis", THESIS).on_click(self._load_thesis)
        add_note(gui, "Scenarios of the thesis, by section, with the method they are written for.")
        self._shipped: Any = gui.add_dropdown("shipped", shipped_scenarios())
        gui.add_button("Load").on_click(self._load_shipped)
        self._upload: Any = gui.add_upload_button("Load a file …", mime_type=".yaml,.yml,.zip")
        self._upload.on_upload(self._load_upload)
        gui.add_divider()
        self._name: Any = gui.add_text("name", "my-scenario")
        gui.add_button("Save").on_click(self._save)
        gui.add_button("Download").on_click(self._download)
        add_note(
            gui,
            f"Arm, goal, obstacles and method as they are now. Save writes into {folder}; a download is complete by "
            "itself: a .zip where it has point clouds or meshes.",
        )
        self._uploads = Path(
            tempfile.mkdtemp(prefix="sidestep-studio-")
        )  # as long as their obstacles may be there
        atexit.register(shutil.rmtree, self._uploads, ignore_errors=True)

    def _load_thesis(self, event: Any) -> None:
        self._loop.load(Scenario.load(f"thesis-{event.target.value}"))

    def _load_shipped(self, _: Any) -> None:
        self._loop.load(Scenario.load(str(self._shipped.value)))

    def _load_upload(self, event: Any) -> None:
        file = event.target.value
        with self._loop.telling(event.client):
            place = Path(tempfile.mkdtemp(dir=self._uploads))
            self._loop.load(unpacked_scenario(file.name, file.content, self._folder, place))

    def _save(self, event: Any) -> None:
        with self._loop.telling(event.client):
            scenario = self._now()
            try:
                path = save_scenario(scenario, self._folder)
            except FileExistsError as error:
                self._ask(scenario, str(error), event.client)
            else:
                self._told("Saved", str(path), event.client)

    def _ask(self, scenario: Scenario, problem: str, client: Any) -> None:
        """Asks whether what is there is to be replaced."""
        with client.gui.add_modal("Replace it?") as modal:
            client.gui.add_markdown(f"{problem}.")
            replace, keep = client.gui.add_button("Replace"), client.gui.add_button("Keep it")

        def answer(_: Any) -> None:
            modal.close()
            with self._loop.telling(client):
                path = save_scenario(scenario, self._folder, replace=True)
                self._told("Saved", str(path), client)

        replace.on_click(answer)
        keep.on_click(lambda _: modal.close())

    def _download(self, event: Any) -> None:
        with self._loop.telling(event.client):
            name, content = packed_scenario(self._now())
            event.client.send_file_download(name, content, save_immediately=True)
            self._told("Downloaded", name, event.client)

    def _told(self, what: str, where: str, client: Any) -> None:
        lost = "" if self._loop.last is None else not_kept(self._loop.last)
        colour = "orange" if lost else "green"
        client.add_notification(what, f"{where}. {lost}", color=colour, auto_close_seconds=8.0)

    def _now(self) -> Scenario:
        name = str(self._name.value)
        if not re.fullmatch(r"[A-Za-z0-9][A-Za-z0-9._-]*", name):
            raise ValueError(f"name is {name!r}; allowed: letters, digits, dot, dash and underscore")
        if self._loop.last is None:
            raise ValueError("the loop does not run yet")
        return scenario_now(self._loop.last, name=name)
