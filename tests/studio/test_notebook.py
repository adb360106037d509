"""The scene inside a notebook: the cell of the documentation, run as a notebook's kernel runs it, shown in a browser.

test_jupyter.py does the same in JupyterLab, which takes long to install.
"""

from __future__ import annotations

import asyncio
import re
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import pytest

from sidestep.studio.headless import Window, new_page
from studio.looker import NO_CHROMIUM, PATIENCE, documented_code, last, until

pytestmark = [NO_CHROMIUM, pytest.mark.slow]


def run_cell(code: str, folder: Path) -> tuple[dict[str, Any], str]:
    """The variables after a cell, and the HTML that it shows, by what IPython's kernel runs cells with.

    As there, an event loop is running meanwhile; its thread is one that Playwright has none in.
    """
    from IPython.core.interactiveshell import InteractiveShell
    from traitlets.config import Config

    async def run() -> tuple[dict[str, Any], str]:
        shell = InteractiveShell.instance(config=Config(HistoryManager={"enabled": False}))
        try:
            result = await shell.run_cell_async(code, transformed_cell=shell.transform_cell(code))
            result.raise_error()
            shown, _ = shell.displayhook.compute_format_data(result.result)
            return dict(shell.user_ns), str(shown["text/html"])
        finally:
            InteractiveShell.clear_instance()

    with pytest.MonkeyPatch.context() as patch, ThreadPoolExecutor(1) as pool:
        patch.setenv("IPYTHONDIR", str(folder))
        return pool.submit(lambda: asyncio.run(run())).result(PATIENCE)


def test_the_documented_cell_shows_the_scene_that_moves(chromium: Any, tmp_path: Path) -> None:
    variables, html = run_cell(documented_code(), tmp_path)
    studio = variables["studio"]
    studio.server.scene.configure_default_lights(cast_shadow=False)  # half the time of a frame
    page = new_page(chromium, Window(760, 480))
    page.set_default_timeout(1e3 * PATIENCE)
    try:
        page.set_content(f'<div class="jp-OutputArea-output">{html}</div>', wait_until="commit")
        assert page.locator("iframe").get_attribute("src") == studio.address
        frame = page.frame_locator("iframe")
        words = frame.locator("#words")

        def time() -> float:
            found = re.search(r"· ([0-9.]+) s ·", words.inner_text())
            return float(found[1]) if found else -1.0

        until(lambda: time() > 0.0, "the loop inside the notebook")
        assert frame.locator("canvas").first.bounding_box()["width"] > 250  # [px] of scene between the panels
        before = time()
        until(lambda: time() > before, "the motion")
        button = frame.get_by_role("button", name="Pause", exact=True)
        button.focus()
        button.press("Enter")
        until(lambda: "paused" in words.inner_text(), "the press of a button in the frame")
        assert not last(studio).running
    finally:
        page.close()
        studio.stop()
