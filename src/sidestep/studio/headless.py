"""Pictures of the page, taken in a hidden browser: for documents and for machines without a display."""

from __future__ import annotations

import ctypes
import io
import os
import shutil
import sys
import time as clock
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from fractions import Fraction
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from PIL import Image

from sidestep.scenario import Scenario
from sidestep.studio.studio import Studio

if TYPE_CHECKING:
    from playwright.sync_api import Page

NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
FLAGS = (  # WebGL without a graphics card; a container has no sandbox of its own to offer
    "--no-sandbox",
    "--use-gl=angle",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--ignore-gpu-blocklist",
)
FAST = "--disable-gpu-compositing"  # each picture in half the time; JupyterLab does not run cells with it
LOAD_TIME = 90.0  # [s] at most until the page shows the scene
BODY_TIME = 1800.0  # [s] at most until the body is made, the first time
PICTURE_TIME = 180.0  # [s] at most for one picture: without a graphics card each takes seconds
POLITE = 10  # niceness of a browser that draws without a graphics card beside the loop
DROP_CAPABILITY, RAISE_PRIORITY = 24, 23  # PR_CAPBSET_DROP and CAP_SYS_NICE of Linux
MOMENT = 5e-3  # [s] longer than a control period, in whose middle a pause may fall
FRAME = 0.25  # [s] of simulated time between two pictures of an animation
CLOSE_NOTICE = """for (const notice of document.querySelectorAll('[role=alert]'))
  if (notice.innerText.includes('Software WebGL')) {
    notice.style.display = 'none'; notice.querySelector('button')?.click()
  }"""  # of viser; it would fade out slowly
FEW_FRAMES = """const waiting = new Map(), draw = window.requestAnimationFrame.bind(window);
const now = key => {
  const [timer, done] = waiting.get(key) ?? [];
  if (waiting.delete(key)) { clearTimeout(timer); draw(done); }
};
let last = 0;
window.requestAnimationFrame = done => {
  waiting.set(++last, [setTimeout(now, 250, last), done]);
  return last;
};
window.cancelAnimationFrame = key => { clearTimeout(waiting.get(key)?.[0]); waiting.delete(key); };
window.drawn = () => new Promise(done => { [...waiting.keys()].forEach(now); draw(done); });
"""  # four a second, others when asked for by `drawn`
ANIMATIONS = (".gif", ".webp")
ANIMATION_WIDTH = 800  # [px]
CODECS = {".mp4": ("libx264", {"crf": "18"}), ".webm": ("libvpx-vp9", {"crf": "24", "b": "0"})}  # of videos


@dataclass(frozen=True)
class Window:
    """Size of the hidden window [px]."""

    width: int = 1280
    height: int = 800

    @classmethod
    def from_text(cls, text: str) -> Window:
        """From WIDTHxHEIGHT; raises ValueError that says what is allowed."""
        width, _, height = text.partition("x")
        if not (width.isdigit() and height.isdigit() and int(width) >= 640 and int(height) >= 480):
            raise ValueError(f"--size is {text!r}; allowed: WIDTHxHEIGHT in pixels, at least 640x480")
        return cls(int(width), int(height))


def find_chromium() -> str | None:
    """The path of a Chromium: SIDESTEP_CHROMIUM, or the first of the usual names; None where there is none."""
    chosen = os.environ.get("SIDESTEP_CHROMIUM")
    if chosen:
        return chosen if Path(chosen).is_file() else None
    return next((path for path in map(shutil.which, NAMES) if path), None)


def check_browser() -> str:
    """The path of a Chromium; raises FileNotFoundError where there is none, MissingExtraError without Playwright."""
    import_module("playwright")
    path = find_chromium()
    if path is None:
        raise FileNotFoundError(
            f"--headless needs Chromium; none of {', '.join(NAMES)} is on the PATH "
            "(apt-get install chromium, or set SIDESTEP_CHROMIUM)"
        )
    return path


@contextmanager
def driver() -> Iterator[Any]:
    """What starts browsers, of which a thread can have one: Playwright; raises what `check_browser` raises."""
    check_browser()
    from playwright.sync_api import sync_playwright

    stay_polite()
    with sync_playwright() as playwright:
        yield playwright


@contextmanager
def browser(playwright: Any, *, flags: tuple[str, ...] = (*FLAGS, FAST)) -> Iterator[Any]:
    """A hidden Chromium, as Playwright's `Browser`."""
    chromium = playwright.chromium.launch(executable_path=check_browser(), args=list(flags))
    try:
        yield chromium
    finally:
        chromium.close()


def stay_polite() -> None:
    """Keeps browsers that this thread starts as root from putting themselves before the loop, in order to draw."""
    if sys.platform == "linux" and os.geteuid() == 0:
        ctypes.CDLL(None).prctl(DROP_CAPABILITY, RAISE_PRIORITY, 0, 0, 0)


def new_page(chromium: Any, window: Window) -> Page:
    """An empty window, which draws no more than it needs: the loop and others want the processor as well."""
    page: Page = chromium.new_page(viewport={"width": window.width, "height": window.height})
    page.add_init_script(FEW_FRAMES)
    return page


def go_to(page: Page, address: str) -> None:
    """Loads the page and waits for the scene."""
    page.goto(address, timeout=1e3 * LOAD_TIME)
    page.wait_for_selector("canvas", timeout=1e3 * LOAD_TIME)
    page.wait_for_selector("#words", timeout=1e3 * LOAD_TIME)


def take_pictures(
    scenario: Scenario,
    *,
    to_and_fro: bool = False,
    method: str,
    ellipsoids: int | None,
    duration: float,
    screenshot: Path | None,
    video: Path | None,
    window: Window,
) -> None:
    """Runs a scenario from its start and writes what the page shows: a picture of the end, and an animation.

    Raises:
        ValueError: neither a picture nor an animation is asked for, or its suffix is another.
        FileNotFoundError: no Chromium. MissingExtraError: no Playwright. RuntimeError: the loop failed.
    """
    from sidestep.studio import messages as m

    check_files(screenshot, video)
    check_browser()
    with Studio(scenario, to_and_fro=to_and_fro, method=method, port=0, ellipsoids=ellipsoids) as studio:
        studio.wait_ready(BODY_TIME)
        studio.send(m.Restart(until=0.0))  # a moving scene would leave little time to load the page
        if hasattr(os, "nice"):
            os.nice(POLITE)  # of the browser that is begun now; the loop runs already
        with driver() as playwright, browser(playwright) as chromium:
            page = new_page(chromium, window)
            go_to(page, studio.address)
            film(studio, page, duration=duration, screenshot=screenshot, video=video)


def film(studio: Studio, page: Page, *, duration: float, screenshot: Path | None, video: Path | None) -> None:
    """The same of a studio that runs already, as one page shows it."""
    from sidestep.studio import messages as m

    studio.send(m.Restart(until=0.0))
    frames: list[Image.Image] = []
    for time in np.arange(0.0, duration if video is not None else 0.0, FRAME):
        run_until(studio, float(time))
        frames.append(Image.open(io.BytesIO(picture(studio, page))).convert("RGB"))
    run_until(studio, duration)
    if screenshot is not None:
        screenshot.write_bytes(picture(studio, page))
    if video is not None:
        save_animation(frames, video)


def run_until(studio: Studio, time: float) -> None:
    """Lets the loop run to a simulated time [s] and pauses it there; the page shows state and clearances of that time.

    Raises:
        RuntimeError: the loop ends before. TimeoutError: it takes longer than `PICTURE_TIME`.
    """
    from sidestep.studio import messages as m

    end = clock.monotonic() + PICTURE_TIME
    studio.send(m.SetRunning(time > 0.0, until=time))
    while not np.allclose(studio.view.shown, time, rtol=0.0, atol=MOMENT):
        if studio.error:
            raise RuntimeError(studio.error)
        if clock.monotonic() > end:
            raise TimeoutError(f"the loop has not come to {time:.2f} s within {PICTURE_TIME:.0f} s")
        clock.sleep(0.01)


def picture(studio: Studio, page: Page) -> bytes:
    """What a page of `new_page` shows, as PNG, once it has drawn what it was last sent."""
    stamp = studio.view.stamp()
    page.wait_for_selector(f"#words[data-stamp='{stamp}']", timeout=1e3 * PICTURE_TIME)
    page.evaluate(f"{CLOSE_NOTICE}; drawn().then(drawn).then(drawn)")
    return bytes(page.screenshot(timeout=1e3 * PICTURE_TIME))


def check_files(screenshot: Path | None, video: Path | None) -> None:
    """Raises ValueError when there is nothing to write, or no folder for it, or in another format than those known;
    MissingExtraError when what writes the format is not installed."""
    if screenshot is None and video is None:
        raise ValueError("--headless needs --screenshot FILE or --video FILE")
    if screenshot is not None and screenshot.suffix.lower() != ".png":
        raise ValueError(f"--screenshot is {screenshot}; allowed: .png")
    if video is not None and video.suffix.lower() not in (*ANIMATIONS, *CODECS):
        raise ValueError(f"--video is {video}; allowed: {', '.join((*ANIMATIONS, *CODECS))}")
    for option, file in (("--screenshot", screenshot), ("--video", video)):
        if file is not None and not file.resolve().parent.is_dir():
            raise ValueError(f"{option} is {file}; there is no folder {file.parent}")
    if video is not None and video.suffix.lower() in CODECS:
        import_module("av")


def save_animation(frames: list[Image.Image], path: Path) -> None:
    """Writes pictures as an animation or a video, `FRAME` apart."""
    if path.suffix.lower() in CODECS:
        save_video(frames, path)
        return
    width = min(ANIMATION_WIDTH, frames[0].width)
    height = round(frames[0].height * width / frames[0].width)
    small = [frame.resize((width, height), Image.Resampling.LANCZOS) for frame in frames]
    if path.suffix.lower() == ".gif":
        palette = small[len(small) // 2].quantize(
            method=Image.Quantize.MAXCOVERAGE
        )  # keeps small things' colours
        small = [frame.quantize(palette=palette, dither=Image.Dither.NONE) for frame in small]
    small[0].save(path, save_all=True, append_images=small[1:], duration=round(1e3 * FRAME), loop=0)


def save_video(frames: list[Image.Image], path: Path) -> None:
    """Writes pictures as a video, `FRAME` apart, at full size."""
    import av

    codec, options = CODECS[path.suffix.lower()]
    with av.open(str(path), "w") as container:
        stream: Any = container.add_stream(codec, rate=Fraction(1.0 / FRAME), options=options)
        stream.width, stream.height = (size - size % 2 for size in frames[0].size)  # as the codecs ask for
        stream.pix_fmt = "yuv420p"
        for frame in frames:
            whole = frame.crop((0, 0, stream.width, stream.height))
            container.mux(stream.encode(av.VideoFrame.from_ndarray(np.asarray(whole), format="rgb24")))
        container.mux(stream.encode())
