"""The thesis's room has one door: it uses the rest of Sidestep, which does not know it."""

import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import sidestep
from sidestep import _core

ROOT = Path(__file__).parents[2]

# Begins programs that find Sidestep in a folder, whatever finds it otherwise.
FROM_FOLDER = """
import sys

sys.meta_path[:] = [finder for finder in sys.meta_path if not type(finder).__name__.startswith("ScikitBuild")]
sys.path.insert(0, sys.argv.pop(1))
import sidestep

assert sidestep.__file__.startswith(sys.path[0])
"""


@pytest.fixture(scope="module")
def without_thesis(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A copy of the package without the folder."""
    folder = tmp_path_factory.mktemp("without")
    ignored = shutil.ignore_patterns("thesis", "__pycache__")
    shutil.copytree(Path(sidestep.__file__).parent, folder / "sidestep", ignore=ignored)
    shutil.copy(_core.__file__, folder / "sidestep")
    return folder


def run(folder: Path, code: str, *arguments: str) -> subprocess.CompletedProcess[str]:
    program = [sys.executable, "-c", FROM_FOLDER + code, str(folder), *arguments]
    return subprocess.run(program, capture_output=True, text=True, check=False, cwd=folder)


COMMAND = "from sidestep.cli import main\nmain()"


def test_nothing_of_the_core_includes_the_thesis() -> None:
    files = [path for folder in ("include", "src") for path in (ROOT / "cpp" / folder).rglob("*.*")]
    outside = [path for path in files if "thesis" not in path.relative_to(ROOT / "cpp").parts]
    assert len(outside) > 100
    assert len(files) - len(outside) > 10
    assert [path for path in outside if "thesis/" in path.read_text("utf-8")] == []


def test_the_demo_runs_without_the_thesis(without_thesis: Path) -> None:
    done = run(without_thesis, COMMAND, "demo", "--no-studio", "--json", "-", "--quiet")
    assert done.returncode == 0, done.stderr
    assert '"success": true' in done.stdout


def test_what_needs_the_thesis_says_so(without_thesis: Path) -> None:
    done = run(without_thesis, COMMAND, "run", "thesis-6.2.3", "--no-report")
    assert done.returncode == 2
    assert "method is custom, which needs the room sidestep.thesis; it is not installed" in done.stderr
    done = run(
        without_thesis,
        COMMAND,
        "bench",
        "reach",
        "--method",
        "thesis",
        "--problems",
        "1",
        "--robot",
        "planar2",
    )
    assert done.returncode == 2
    assert "method 'thesis' needs the room sidestep.thesis; it is not installed" in done.stderr
    assert "reproduce" not in run(without_thesis, COMMAND, "--help").stdout


def test_the_studio_has_the_controller_alone_without_the_thesis(without_thesis: Path) -> None:
    done = run(without_thesis, "from sidestep.studio.methods import METHODS\nprint(*METHODS)")
    assert done.stdout.split() == ["controller", "barrier", "reactive"], done.stderr


def test_a_module_that_is_there_and_lacks_something_is_no_missing_plug_in(without_thesis: Path) -> None:
    code = """
from importlib import metadata
from sidestep import plugins

entry = metadata.EntryPoint("reproduce", "sidestep.broken:f", "sidestep.commands")
plugins.entry_points = lambda group: [entry]
print(plugins.plugins("sidestep.commands"))
open(sidestep.__file__.replace("__init__", "broken"), "w").write("import nowhere_at_all")
plugins.plugins("sidestep.commands")
"""
    done = run(without_thesis, code)
    assert done.stdout == "{}\n"
    assert "No module named 'nowhere_at_all'" in done.stderr


def test_one_binding_file_includes_the_thesis() -> None:
    files = [path for path in (ROOT / "bindings").iterdir() if "thesis/" in path.read_text("utf-8")]
    assert [path.name for path in files] == ["thesis.cpp"]
