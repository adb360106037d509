"""The scene inside a notebook: a real Jupyter server, its page in a hidden browser, the cells of the documentation."""

from __future__ import annotations

import importlib.util
import io
import json
import os
import re
import socket
import subprocess
import sys
import urllib.request
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from sidestep.studio.headless import FLAGS, browser
from studio.looker import NO_CHROMIUM, PATIENCE, differ, documented_code, until

MISSING = [name for name in ("jupyterlab", "ipykernel") if importlib.util.find_spec(name) is None]
pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(bool(MISSING), reason=f"pip install {' '.join(MISSING)}"),
    NO_CHROMIUM,
]
BACK = "from sidestep.studio import messages as m\nstudio.send(m.Restart(until=0.0))"  # paused at the start
QUIET = (
    "--LabApp.news_url=None",
    "--LabApp.check_for_updates_class=jupyterlab.NeverCheckForUpdate",
)  # offline


def notebook(*cells: str) -> str:
    code = [
        {
            "cell_type": "code",
            "id": f"c{k}",
            "execution_count": None,
            "metadata": {},
            "outputs": [],
            "source": text,
        }
        for k, text in enumerate(cells)
    ]
    kernel = {"name": "python3", "display_name": "Python 3", "language": "python"}
    return json.dumps({"cells": code, "metadata": {"kernelspec": kernel}, "nbformat": 4, "nbformat_minor": 5})


@pytest.fixture
def jupyter(tmp_path: Path) -> Iterator[str]:
    """Address of a Jupyter server with the notebook scene.ipynb; it knows no settings of this machine."""
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    (tmp_path / "scene.ipynb").write_text(
        notebook(documented_code(), BACK, "studio.stop()"), encoding="utf-8"
    )
    own = {f"JUPYTER_{name}_DIR": str(tmp_path / name) for name in ("CONFIG", "RUNTIME", "DATA")}
    options = {"ip": "127.0.0.1", "port": port, "root_dir": tmp_path, "allow_root": True, "port_retries": 0}
    command = [sys.executable, "-m", "jupyterlab", "--no-browser", "--IdentityProvider.token="]
    command += [*QUIET, *(f"--ServerApp.{name}={value}" for name, value in options.items())]
    log = (tmp_path / "log").open("w")
    server = subprocess.Popen(command, env={**os.environ, **own}, stdout=log, stderr=log)
    address = f"http://127.0.0.1:{port}"

    def answers() -> bool:
        assert server.poll() is None, (tmp_path / "log").read_text()
        try:
            with urllib.request.urlopen(f"{address}/api", timeout=1.0):
                return True
        except OSError:
            return False

    try:
        until(answers, "the Jupyter server")
        yield address
    finally:
        server.terminate()  # and with it its kernels
        server.wait(timeout=20.0)
        log.close()


@pytest.fixture
def chromium(playwright: Any) -> Iterator[Any]:
    with browser(playwright, flags=FLAGS) as started:
        yield started


def test_the_scene_moves_inside_a_notebook(jupyter: str, chromium: Any) -> None:
    page = chromium.new_page(viewport={"width": 1280, "height": 1000})
    page.set_default_timeout(1e3 * PATIENCE)
    page.goto(f"{jupyter}/lab/tree/scene.ipynb")
    page.locator(".jp-Notebook .jp-Cell").nth(1).wait_for()
    cells = page.locator(".jp-Notebook .jp-Cell")

    def execute(index: int) -> None:
        page.get_by_text("| Idle").wait_for()  # a cell that is run before the kernel is there is lost
        cells.nth(index).locator(".cm-content").click()
        page.keyboard.press("Shift+Enter")
        cells.nth(index).locator(".jp-InputPrompt").get_by_text(f"[{index + 1}]:").wait_for()

    execute(0)
    frame = page.frame_locator(".jp-OutputArea iframe")
    words = frame.locator("#words")
    words.wait_for()

    def time() -> float:
        found = re.search(r"· ([0-9.]+) s ·", words.inner_text())
        return float(found[1]) if found else -1.0

    def picture() -> np.ndarray:
        shot = frame.locator("canvas").first.screenshot()
        return np.asarray(Image.open(io.BytesIO(shot)).convert("RGB"), dtype=int)

    until(lambda: time() > 0.0, "the loop inside the notebook")
    execute(1)
    until(lambda: time() == 0.0, "the start")
    before = picture()
    button = frame.get_by_role("button", name="Run", exact=True)
    button.focus()  # the frame is drawn smaller, which Playwright's own click does not know of
    button.press("Enter")
    folder = os.environ.get("SIDESTEP_PICTURES")
    if folder:
        page.screenshot(path=Path(folder) / "jupyter.png")
    until(lambda: time() > 3.0, "the motion")
    after = picture()
    if folder:
        page.screenshot(path=Path(folder) / "jupyter.png")
    assert differ(before, after).sum() > 2000  # [px] of an arm of one metre that turns
    assert before.shape[1] > 350  # [px] of scene between the panels
    assert page.locator(".jp-OutputArea [data-mime-type*='error']").count() == 0
    execute(2)
    page.close()
