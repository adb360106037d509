"""Importing loads little and leaves silently; what is not installed is asked for in one line."""

from __future__ import annotations

import ast
import json
import re
import subprocess
import sys
from importlib.util import resolve_name
from pathlib import Path

import pytest

import sidestep
from sidestep.extras import MODULES
from support.missing_packages import OPTIONAL, PROJECT, run

INSTALLED_ALWAYS = {"lazy_loader", "numpy", "sidestep"}  # of what a controller loads

CONTROL = """
import numpy as np
import sidestep as ss

arm = ss.Arm.load(sys.argv[1])
controller = ss.Controller(arm)
controller.set_goal(arm.neutral + 0.3)
controller.set_obstacles(ss.Obstacles([[0.2, 0.9, 0.0]], radii=0.05))
q, v = arm.neutral, np.zeros(arm.num_coordinates)
for _ in range(20):
    command = controller.step(q, v)
    q, v = command.position, command.velocity
assert np.isfinite(command.torque).all() and controller.explain()
"""


def last_line(done: subprocess.CompletedProcess[str]) -> str:
    return done.stderr.strip().splitlines()[-1]


@pytest.fixture(scope="module")
def arm_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("arms") / "planar3.arm"
    sidestep.Arm.load("planar3").save(path)
    return path


def imported(path: Path, package: str) -> set[str]:
    """What a module or stub of a package says it imports, wherever it does."""
    names: set[str] = set()
    for node in ast.walk(ast.parse(path.read_text("utf-8"))):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            module = resolve_name("." * node.level + (node.module or ""), package)
            names |= {module} | {f"{module}.{alias.name}" for alias in node.names}
    return names


@pytest.mark.parametrize("front_end", ["bench", "studio", "cli"])
def test_only_the_command_line_and_the_thesis_import_a_front_end(front_end: str) -> None:
    package = Path(sidestep.__file__).parent
    files = {
        path.relative_to(package): path for path in package.rglob("*.py*") if path.suffix in {".py", ".pyi"}
    }
    outside = {
        name: path
        for name, path in files.items()
        if name.parts[0] not in {front_end, "cli", "__main__.py", "thesis"}
    }
    assert len(outside) > 100
    room = f"sidestep.{front_end}"
    users = [
        str(name)
        for name, path in outside.items()
        if any(
            f"{module}.".startswith(f"{room}.")
            for module in imported(path, ".".join(("sidestep", *name.parent.parts)))
        )
    ]
    assert users == []


def test_nothing_is_leaked_at_exit() -> None:
    # nanobind reports leaked instances on stderr when the interpreter ends, for example a default argument that is an
    # instance of a bound class.
    code = (
        "import sidestep\nfor name in sidestep.__all__: getattr(sidestep, name)\nprint(sidestep.__version__)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.count(".") == 2
    assert done.stderr == ""


def test_the_version_is_that_of_the_project_file() -> None:
    assert sidestep.__version__ == PROJECT["version"]


def test_changelog_citation_and_recipe_are_of_this_version() -> None:
    root = Path(__file__).parents[1]
    changes, citation = (
        (root / name).read_text(encoding="utf-8") for name in ("CHANGELOG.md", "CITATION.cff")
    )
    newest = re.search(r"^## (\S+) \((\d{4}-\d\d-\d\d)\)$", changes, re.MULTILINE)
    assert newest is not None
    assert newest[1] == PROJECT["version"]
    assert f"\nversion: {newest[1]}\ndate-released: {newest[2]}\n" in citation
    assert f"\n  version: {newest[1]}\n" in (root / "recipe/recipe.yaml").read_text(encoding="utf-8")


@pytest.mark.parametrize("shipped", [False, True])
def test_a_running_controller_loads_numpy_and_the_core(arm_file: Path, shipped: bool) -> None:
    code = """
import json
from pathlib import Path
before = set(sys.modules)
if sys.argv[3] == "True":  # as if the arm came with Sidestep
    import sidestep.arm.arm
    path = Path(sys.argv[1])
    sidestep.arm.arm.SHIPPED, sys.argv[1] = path.parent, path.stem
exec(sys.argv[2])
print(json.dumps(sorted({name.partition(".")[0] for name in set(sys.modules) - before})))
"""
    done = run(code, arm_file, CONTROL, str(shipped))
    assert done.stderr == ""
    loaded = {name for name in json.loads(done.stdout) if name not in sys.stdlib_module_names}
    assert {name for name in loaded if not name.startswith("_")} == INSTALLED_ALWAYS


def test_a_controller_runs_with_what_is_always_installed(arm_file: Path) -> None:
    done = run("hide(*sys.argv[2].split(','))" + CONTROL, arm_file, ",".join(OPTIONAL))
    assert (done.returncode, done.stderr) == (0, "")


def test_solids_are_obstacles_with_what_is_always_installed(arm_file: Path) -> None:
    code = """
from sidestep.obstacles import Box, Capsule, Cylinder, Plane, Sphere, obstacles_from_shapes
solids = [Box((0.2, 0.1, 0.3)), Capsule(0.1, 0.2), Cylinder(0.1, 0.2), Plane((0, 0, 0), (0, 0, 1)), Sphere(0.1)]
for solid in solids:
    for spacing in (None, 0.05):
        print(len(obstacles_from_shapes([solid], spacing=spacing).points) > 0)
"""
    done = run("hide(*sys.argv[2].split(','))" + code, arm_file, ",".join(OPTIONAL))
    assert (done.stderr, done.stdout.split()) == ("", ["True"] * 10)


def test_the_readme_runs_with_what_is_always_installed() -> None:
    hello = Path(__file__).parents[1] / ".ci" / "hello.py"
    code = "\nimport runpy\nhide(*sys.argv[1].split(','))\nrunpy.run_path(sys.argv[2])"
    done = run(code, ",".join(OPTIONAL), hello)
    assert done.stderr == ""
    assert done.stdout.endswith("arrived ok arrived\n")


def test_few_packages_are_installed_always() -> None:
    names = {re.split(r"[^\w-]", requirement)[0] for requirement in PROJECT["dependencies"]}
    assert names == {"lazy-loader", "numpy", "platformdirs", "rich", "scipy", "typer"}


def test_the_extras_hold_what_the_errors_say() -> None:
    """Each module that is looked for comes with a requirement of its extra, or of one that this extra holds."""
    distribution = {
        "PIL": "pillow",
        "collada": "pycollada",
        "jsonschema_rs": "jsonschema-rs",
        "pinocchio": "pin",
    }
    distribution |= {"sklearn": "scikit-learn", "yaml": "pyyaml", "zenoh": "eclipse-zenoh"}
    distribution |= dict.fromkeys(("dashboard_client", "rtde_control", "rtde_receive"), "ur-rtde")
    inside = {"websockets"}  # of viser's own requirements

    def requirements(extra: str) -> set[str]:
        found = set()
        for requirement in PROJECT["optional-dependencies"][extra]:
            nested = re.fullmatch(r"sidestep\[(.+)\]", requirement)
            held = nested[1].split(",") if nested else []
            found |= set.union({re.split(r"[^\w-]", requirement)[0]}, *map(requirements, held))
        return found

    for extra, modules in MODULES.items():
        asked = {distribution.get(module, module) for module in modules} - inside
        assert asked <= requirements(extra)
    assert (
        requirements("prepare")
        < requirements("simulation")
        < requirements("studio")
        < requirements("headless")
    )
    assert requirements("studio") < requirements("demo")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("hidden", "code", "extra"),
    [
        (
            "casadi",
            "from sidestep.bench.scenes import SceneSettings, run_scenes; "
            "run_scenes(SceneSettings(robot='planar3', jerk_time_ratio=True), [None])",
            "bench",
        ),
        ("trimesh", "import sidestep as ss; ss.Robot.named('planar3').collision_mesh('link1')", "prepare"),
        (
            "coal",
            "from sidestep import Arm, robot; Arm.load(robot.planar_arm(4), cache=False)",
            "prepare",
        ),
        ("coal", "from sidestep.distance import SelfCollision", "prepare"),
        ("trimesh", "import sidestep as ss; ss.MeshShape(sys.executable).balls()", "prepare"),
        ("trimesh", "import sidestep as ss; ss.Sphere(0.1).mesh()", "prepare"),
        (
            "sklearn",
            "import sidestep as ss; ss.Body.fit(ss.Robot.named('planar3'), components=1, cache=False)",
            "thesis",
        ),
        ("mujoco", "import sidestep as ss; ss.Simulation", "simulation"),
        ("mujoco", "import sidestep.simulation.model", "simulation"),
        ("yaml", "import sidestep as ss; ss.Scenario.load('thesis-6.2.3')", "simulation"),
        ("trimesh", "import sidestep as ss; ss.run_scenario", "simulation"),
        ("matplotlib", "from sidestep.report import write_report", "simulation"),
        ("trimesh", "import sidestep.studio.simulated_scene", "studio"),
        (
            "viser",
            "from sidestep.studio.server import guarded_server; guarded_server('127.0.0.1', 0, None)",
            "studio",
        ),
        (
            "rosbags",
            "from sidestep.perception import BagRecording; BagRecording(sys.prefix)",
            "camera",
        ),
        ("PIL", "from sidestep.perception import read_depth_png; read_depth_png(b'')", "camera"),
        ("pyrealsense2", "from sidestep.perception import RealSense; RealSense('front')", "realsense"),
        ("dashboard_client", "from sidestep.drivers import UR; UR('127.0.0.1')", "ur"),
        ("pylibfranka", "from sidestep.drivers import Franka; Franka('robot')", "franka"),
        ("playwright", "from sidestep.studio import headless; headless.check_browser()", "headless"),
        (
            "av",
            "from pathlib import Path; from sidestep.studio import headless; "
            "headless.check_files(None, Path('film.mp4'))",
            "headless",
        ),
        ("pinocchio", "import sidestep as ss; ss.Robot.named('planar3').pinocchio", "bench"),
    ],
)
def test_what_is_missing_is_asked_for_in_one_line(hidden: str, code: str, extra: str) -> None:
    done = run(f"hide({hidden!r})\n{code}")
    assert re.fullmatch(
        rf"sidestep\.extras\.MissingExtraError: sidestep\.[\w.]+ needs the package '{hidden}', which is not installed: "
        rf"pip install 'sidestep\[{extra}\]'",
        last_line(done),
    ), done.stderr


def test_every_module_and_public_name_asks_for_its_extra() -> None:
    """With nothing but what is always installed each module imports, or says what to install."""
    code = """
hide(*sys.argv[1].split(","))
import importlib, pkgutil, sidestep
from sidestep.extras import MissingExtraError

for module in pkgutil.walk_packages(sidestep.__path__, "sidestep.", onerror=lambda name: None):
    if module.name.rpartition(".")[2] in ("__main__", "fabrics_alone", "jax_peers"):
        continue  # programs; the last two run by interpreters that need not have Sidestep
    try:
        importlib.import_module(module.name)
    except MissingExtraError as error:
        assert "pip install 'sidestep[" in str(error)
    else:
        print(module.name)
for name in sidestep.__all__:
    try:
        getattr(sidestep, name)
    except MissingExtraError:
        continue
    print(name)
"""
    done = run(code, ",".join(OPTIONAL))
    assert done.stderr == ""
    at_hand = set(done.stdout.split())
    assert {
        "sidestep.arm.arm",
        "sidestep.cli",
        "sidestep.robot.model",
        "Arm",
        "Controller",
        "Obstacles",
    } <= at_hand
    assert {"PoseGoal", "Robot", "run", "robots"} <= at_hand


@pytest.mark.parametrize(
    "arguments", [("--help",), ("robots",), ("run", "--help"), ("bench", "--help"), ("--version",)]
)
def test_the_command_line_works_with_what_is_always_installed(arguments: tuple[str, ...]) -> None:
    code = "hide(*sys.argv[1].split(','))\nfrom sidestep.cli import main\nsys.argv[1:] = sys.argv[2:]\nmain()"
    done = run(code, ",".join(OPTIONAL), *arguments)
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout != ""


def test_replays_and_served_arms_need_only_what_is_always_installed(tmp_path: Path) -> None:
    code = """
hide(*sys.argv[1].split(','))
import sidestep as ss
from sidestep.cli import main
arm = ss.Arm.load("planar3")
controller = ss.Controller(arm, ss.ControllerSettings(output="position", synchronous=True))
controller.set_obstacles(ss.Obstacles.none())
controller.set_goal(arm.neutral + 0.01)
ss.run(controller, ss.drivers.Ideal(arm, real_time=False), record="run.mcap")
sys.argv[1:] = sys.argv[2:]
main()
"""
    replayed = run(code, ",".join(OPTIONAL), "replay", "run.mcap", folder=tmp_path)
    assert (replayed.returncode, replayed.stderr) == (0, "")
    assert "equal" in replayed.stdout
    served = run(code, ",".join(OPTIONAL), "serve", "planar3", "--driver", "tea", folder=tmp_path)
    assert served.returncode == 2
    assert "driver is 'tea'; there are franka, ideal, mujoco" in served.stderr


@pytest.mark.parametrize(
    "command", [("run", "thesis-6.2.3"), ("studio",), ("scenarios",), ("bench", "reach")]
)
def test_a_command_asks_for_its_extra(command: tuple[str, ...]) -> None:
    code = "hide(*sys.argv[1].split(','))\nfrom sidestep.cli import main\nsys.argv[1:] = sys.argv[2:]\nmain()"
    done = run(code, ",".join(OPTIONAL), *command)
    assert done.returncode == 2
    (line,) = done.stderr.splitlines()
    extra = "studio" if command == ("studio",) else "simulation"
    assert line.startswith("error: sidestep.")
    assert line.endswith(f": pip install 'sidestep[{extra}]'")


def test_imports_of_others_are_left_alone() -> None:
    """They may try an import and go on without, or only look whether something is there."""
    code = """
hide("mujoco")
import importlib.util, sidestep
assert importlib.util.find_spec("mujoco") is None
try:
    import mujoco
except ModuleNotFoundError as error:
    assert type(error) is ModuleNotFoundError and str(error) == "No module named 'mujoco'"
    print("as ever")
"""
    done = run(code)
    assert (done.stdout, done.stderr) == ("as ever\n", "")
