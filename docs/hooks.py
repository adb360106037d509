"""What MkDocs does for this site beside turning Markdown into pages.

It generates a page for each part of the Python package from its public names. It turns links to files beside `docs`
into plain text, since the site does not hold them. It adds the C++ pages of Doxygen where Doxygen is installed, and the
recorded runs of record_runs.py where they are in build/runs.
"""

from __future__ import annotations

import importlib
import logging
import re
import runpy
import shutil
import subprocess
from pathlib import Path
from typing import Any

from mkdocs.structure.files import File, Files

DOCS = Path(__file__).parent
ROOT = DOCS.parent
RUNS = ROOT / "build" / "runs"  # of record_runs.py
TO_BE_MADE = "[Recorded runs: how to make them](how-to/studio.md#pages-of-recorded-runs)"  # in index.md
RUNS_HEADING = "<h1>Recorded runs</h1>"  # in runs/index.html
MAKE = runpy.run_path(str(DOCS / "make_reference.py"))
log = logging.getLogger("mkdocs.hooks.sidestep")
outside = re.compile(r"\[([^\]]+)\]\(((?:\.\./)+[^)#]+)(?:#[^)]*)?\)")
row = re.compile(r"^\| `(\w+)` \|", re.MULTILINE)
heading = re.compile(r"^## `([\w.]+)`$", re.MULTILINE)


def entry(module: str, name: str) -> str:
    """What mkdocstrings describes; the docstring of settings has all their fields."""
    lines = f"::: {module}.{name}"
    return lines + "\n    options: {members: false}" if name.endswith("Settings") else lines


def on_files(files: Files, config: Any) -> Files:
    """Adds a page for each part of the Python package, and one that the navigation shows for each."""
    pages = []
    for module, names in MAKE["public_names"]().items():
        entries = "\n\n".join(entry(module, name) for name in names)
        source = f"reference/python/{module.rpartition('.')[2]}.md"
        opening = (importlib.import_module(module).__doc__ or "").strip().split("\n\n")[0]
        text = f"# `{module}`\n\n{opening}\n\n{entries}\n"
        files.append(File.generated(config, source, content=text))
        pages.append({module: source})
    return files


def on_config(config: Any) -> Any:
    """Puts the generated pages into the navigation, behind the list of names."""
    pages = [{name: f"reference/python/{name.rpartition('.')[2]}.md"} for name in MAKE["public_names"]()]
    for part in config.nav:
        for number, page in enumerate(part.get("Reference", ())):
            if page == "reference/python.md":
                part["Reference"][number] = {"Python": [{"All names": page}, *pages]}
    return config


def on_page_markdown(markdown: str, page: Any, **_: Any) -> str:
    """Links of the list of names to their descriptions; links out of `docs` as text, if their files are there."""
    source = Path(page.file.src_uri)
    if source == Path("reference/python.md"):
        parts = heading.split(markdown)
        for number in range(1, len(parts), 2):
            parts[number + 1] = row.sub(rf"| [`\1`][{parts[number]}.\1] |", parts[number + 1])
            parts[number] = f"## `{parts[number]}`"
        markdown = "".join(parts)

    if source == Path("index.md") and (RUNS / "index.html").is_file():
        markdown = markdown.replace(TO_BE_MADE, '<a href="runs/index.html">Recorded runs</a>')
    if source == Path("reference/cpp.md") and shutil.which("doxygen") is None:
        left_out = "This copy of the site was made without Doxygen, so it has no pages of classes."
        markdown = re.sub(r"<p>By Doxygen:.*?</p>", left_out, markdown, flags=re.DOTALL)

    def as_text(link: re.Match[str]) -> str:
        target = (DOCS / source.parent / link[2]).resolve()
        if DOCS in target.parents:
            return link[0]
        if not target.exists():
            log.warning("%s links to %s, which does not exist", source, link[2])
        name = target.relative_to(ROOT).as_posix()
        return f"{link[1]} (`{name}`)" if name not in link[1] else link[1]

    return outside.sub(as_text, markdown)


def with_way_back(index: str) -> str:
    """The list of recorded runs with a link to the first page of the site, which it has only as part of the site."""
    if RUNS_HEADING not in index:
        log.warning("runs/index.html has no %s to put the link to the site before", RUNS_HEADING)
    return index.replace(RUNS_HEADING, f'<p><a href="../index.html">Sidestep</a></p>{RUNS_HEADING}')


def on_post_build(config: Any) -> None:
    """Copies the recorded runs, where they were made; writes the C++ pages by Doxygen, where it is installed."""
    if (RUNS / "index.html").is_file():
        runs = Path(config.site_dir) / "runs"
        shutil.copytree(RUNS, runs, dirs_exist_ok=True)
        index = runs / "index.html"
        index.write_text(with_way_back(index.read_text(encoding="utf-8")), encoding="utf-8")
    else:
        log.info("The site has no recorded runs (python docs/record_runs.py build/runs)")
    target = Path(config.site_dir) / "reference" / "cpp"
    if shutil.which("doxygen") is None:
        log.info("Doxygen is not installed: the site has no C++ pages (apt-get install doxygen)")
        return
    target.mkdir(parents=True, exist_ok=True)
    text = (DOCS / "Doxyfile").read_text(encoding="utf-8") + f"\nOUTPUT_DIRECTORY = {target}\n"
    found = subprocess.run(["doxygen", "-"], input=text, cwd=ROOT, capture_output=True, text=True)
    for line in found.stderr.splitlines():
        log.warning("doxygen: %s", line)
    if found.returncode != 0:
        log.warning("doxygen ended with %d", found.returncode)
    for link in re.findall(r'href="(cpp/[^"#]+)', (target.parent / "cpp.html").read_text(encoding="utf-8")):
        if not (target.parent / link).is_file():
            log.warning("reference/cpp.md links to %s, which Doxygen does not write", link)
