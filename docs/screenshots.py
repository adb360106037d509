"""Pictures of the site's pages at 1280 x 800 in a hidden browser: python docs/screenshots.py [PAGE ...]

Needs Chromium, `pip install 'sidestep[headless,docs]'`, and the site: `mkdocs build --strict`. Takes every page, or
those named: PAGE is a path in docs without suffix, such as how-to/tuning. Pictures go to build/screenshots. Exit code 1
where a page asks the network for something, lacks a picture, or is wider than the window.
"""

from __future__ import annotations

import argparse
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sidestep.studio.headless import browser, driver

if TYPE_CHECKING:
    from playwright.sync_api import Page

ROOT = Path(__file__).parents[1]
SITE, TARGET = ROOT / "build" / "site", ROOT / "build" / "screenshots"
PATIENCE = 120_000.0  # [ms] for one page, on a machine under load
WINDOW = {"width": 1280, "height": 800}
BROKEN = "() => [...document.images].filter(i => i.complete && i.naturalWidth === 0).map(i => i.src)"
TOO_WIDE = "() => document.documentElement.scrollWidth > window.innerWidth"


def pages(chosen: list[str]) -> list[Path]:
    """The pages to look at; raises FileNotFoundError where there is none."""
    found = [SITE / f"{name}.html" for name in chosen] or [
        path
        for path in sorted(SITE.rglob("*.html"))
        if not path.relative_to(SITE).as_posix().startswith(("reference/cpp/", "runs/"))
    ]
    missing = [path for path in found if not path.is_file()]
    if missing or not found:
        raise FileNotFoundError(f"there is no page {missing[0] if missing else SITE}: mkdocs build --strict")
    return found


class Quiet(SimpleHTTPRequestHandler):
    """Serves files without a word."""

    def log_message(self, format: str, *args: object) -> None:
        pass


@contextmanager
def served() -> Iterator[str]:
    """The address of the site, on this machine alone."""
    server = ThreadingHTTPServer(("127.0.0.1", 0), partial(Quiet, directory=str(SITE)))
    threading.Thread(target=server.serve_forever, daemon=True).start()
    yield f"http://127.0.0.1:{server.server_port}/"
    server.shutdown()


def states(chromium: Any, page: Page, address: str) -> None:
    """Pictures of what a page can be: with results of a search, dark, and narrow."""
    page.goto(f"{address}index.html", wait_until="load")
    page.fill("input.md-search__input", "obstacle")
    page.wait_for_selector(".md-search-result__link", timeout=30_000)  # [ms] the index is loaded first
    page.screenshot(path=TARGET / "state-search.png")
    dark = chromium.new_page(viewport=WINDOW, color_scheme="dark")
    dark.goto(f"{address}concepts/planner.html", wait_until="load")
    dark.screenshot(path=TARGET / "state-dark.png")
    page.set_viewport_size({"width": 420, "height": 800})
    page.goto(f"{address}start/tour.html", wait_until="load")
    page.screenshot(path=TARGET / "state-narrow.png")


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("pages", nargs="*", metavar="PAGE", help="a path in docs without suffix [all]")
    chosen = parser.parse_args().pages
    faults = 0
    with served() as address, driver() as playwright, browser(playwright) as chromium:
        page = chromium.new_page(viewport=WINDOW)
        asked: list[str] = []
        page.on("request", lambda request: asked.append(request.url))
        for path in pages(chosen):
            asked.clear()
            page.goto(address + path.relative_to(SITE).as_posix(), wait_until="load", timeout=PATIENCE)
            page.wait_for_timeout(300)  # [ms] what fades in
            name = path.relative_to(SITE).with_suffix(".png")
            (TARGET / name).parent.mkdir(parents=True, exist_ok=True)
            page.screenshot(path=TARGET / name)
            outside = [url for url in asked if not url.startswith((address, "data:", "blob:"))]
            wrong = [f"asks for {url}" for url in outside]
            wrong += [f"lacks {url}" for url in page.evaluate(BROKEN)]
            wrong += ["is wider than the window"] if page.evaluate(TOO_WIDE) else []
            faults += len(wrong)
            print(name.with_suffix("").as_posix(), *wrong, sep="\n    ")
        if not chosen:
            states(chromium, page, address)
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
