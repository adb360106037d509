"""The command line: exit codes, what goes to stdout and stderr, and the figures."""

import json
import math
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import jsonschema
import pytest
import typer
from rich.console import Console

from sidestep import cli
from sidestep.cli.bench_output import figures_table
from sidestep.cli.run_command import parse_switch

Invoke = Callable[..., int]

SCENARIO = """\
format: 1
name: small
robot: {name: planar2}
start: {unit: rad, position: [0, 0.5]}
goal: {unit: rad, position: [1, 0.5]}
body: {components: 1}
simulation: {mode: kinematic, period: 0.005, duration: 12.0}
"""


@pytest.fixture
def invoke(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Invoke:
    monkeypatch.setenv("SIDESTEP_CACHE_DIR", str(tmp_path / "bodies"))
    monkeypatch.chdir(tmp_path)
    (tmp_path / "small.yaml").write_text(SCENARIO)

    def call(*arguments: str) -> int:
        monkeypatch.setattr(sys, "argv", ["sidestep", *arguments])
        with pytest.raises(SystemExit) as caught:
            cli.main()
        return int(caught.value.code or 0)

    return call


def test_a_run_prints_only_json_on_stdout(invoke: Invoke, capsys: pytest.CaptureFixture[str]) -> None:
    assert invoke("run", "small.yaml", "--json", "-", "--no-report") == 0
    captured = capsys.readouterr()
    document = json.loads(captured.out)
    assert document["reached"] is True
    # closed form of the free motion (see tests/scenario/test_runner.py); two periods for a first-order scheme
    assert document["time_to_goal_s"] == pytest.approx(-2.0 * math.log(1.0 - math.sqrt(0.95)), abs=0.01)
    assert document["position_error_rad"] < 0.05
    for key in ("contacts", "min_clearance_m", "max_tracking_error", "max_torque_ratio"):
        assert document[key] is None  # no physics, no obstacle
    assert "reaches the goal after 7.4 s" in captured.err.replace("\n", " ")
    assert not list(Path().glob("sidestep-report*"))


def test_torque_mode_gives_every_figure(invoke: Invoke, capsys: pytest.CaptureFixture[str]) -> None:
    obstacle = "obstacles: [{shape: {type: sphere, radius: 0.1}, position: [-0.8, 0, 0]}]\n"
    Path("small.yaml").write_text(SCENARIO + obstacle)
    assert invoke("run", "small.yaml", "--mode", "torque", "--json", "figures.json", "--no-report", "-q") == 0
    assert capsys.readouterr().out == ""
    document = json.loads(Path("figures.json").read_text())
    assert (document["mode"], document["contacts"], document["success"]) == ("torque", 0, True)
    # the base end of link 1 (0.08 m wide) is nearest: 0.8 m less the radius, less at most its half diagonal
    assert 0.6 < document["min_clearance_m"] <= 0.7
    assert document["max_tracking_error"] < 1e-6  # tolerance of the torque program
    assert 0.0 < document["max_torque_ratio"] < 1.0


def test_a_failed_run_exits_with_1_and_still_reports(
    invoke: Invoke, capsys: pytest.CaptureFixture[str]
) -> None:
    assert invoke("run", "small.yaml", "--duration", "0.5", "--out", "folder") == 1
    assert "does not reach" in capsys.readouterr().out.replace("\n", " ")
    assert json.loads(Path("folder/result.json").read_text())["success"] is False
    assert Path("folder/index.html").is_file()


def test_the_switch_can_be_overridden(invoke: Invoke) -> None:
    assert (
        invoke("run", "small.yaml", "--switch", "geodesic_only", "-q", "--no-report", "--json", "f.json") == 1
    )
    document = json.loads(Path("f.json").read_text())
    assert document["switch"] == "geodesic_only"
    assert document["position_error_rad"] == pytest.approx(1.0, abs=1e-9)  # at rest it stays where it is


def test_a_switch_with_numbers_can_be_given(invoke: Invoke) -> None:
    invoke(
        "run",
        "small.yaml",
        "--switch",
        "sigmoid:0.5:10",
        "-q",
        "--no-report",
        "--json",
        "f.json",
        "--duration",
        "0.1",
    )
    assert json.loads(Path("f.json").read_text())["switch"] == "sigmoid"
    switch = parse_switch("sigmoid:0.5:10")
    assert (switch.type, switch.threshold, switch.slope) == ("sigmoid", 0.5, 10.0)


@pytest.mark.parametrize(
    "text", ["sigmoid", "sigmoid:0.5", "binary:x", "binary:nan", "sigmoid:1:-1", "distance:1"]
)
def test_a_wrong_switch_is_refused_with_the_allowed_forms(text: str) -> None:
    with pytest.raises(typer.BadParameter, match=rf"'{text}' is not one of: none, .*binary:THRESHOLD"):
        parse_switch(text)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (("unit: rad", "unit: grad"), "error: bad.yaml: start.unit is 'grad'; allowed: deg, rad\n"),
        (("planar2", "planar7"), "error: small: robot: no robot is named 'planar7'"),
        (("[1, 0.5]", "[4, 0.5]"), "error: small: goal.position: joint 'joint1' is 4.0 rad, allowed: [-3.14"),
        (
            ("[1, 0.5]", "[.nan, 0.5]"),
            "error: bad.yaml: goal.position[0] is nan; it must be a finite number\n",
        ),
    ],
)
def test_bad_input_is_one_line_and_exit_code_2(
    invoke: Invoke, capsys: pytest.CaptureFixture[str], change: tuple[str, str], message: str
) -> None:
    Path("bad.yaml").write_text(SCENARIO.replace(*change))
    assert invoke("run", "bad.yaml", "--no-report", "-q") == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    assert message in captured.err
    assert captured.err.count("\n") == 1


def test_a_goal_in_degrees_is_said_to_look_like_degrees(
    invoke: Invoke, capsys: pytest.CaptureFixture[str]
) -> None:
    Path("bad.yaml").write_text(SCENARIO.replace("[1, 0.5]", "[90, 0.5]"))
    assert invoke("run", "bad.yaml", "--no-report", "-q") == 2
    assert capsys.readouterr().err.endswith("; 90 looks like degrees; radians are expected\n")
    from sidestep.robot import planar_arm

    Path("arm.urdf").write_text(planar_arm(2).replace('type="revolute"', 'type="continuous"'))
    text = SCENARIO.replace("name: planar2", "urdf: arm.urdf").replace("[1, 0.5]", "[90, 0.5]")
    Path("bad.yaml").write_text(text)
    with pytest.warns(
        RuntimeWarning, match=r"goal\.position; 90 looks like degrees; radians .*: write unit: deg"
    ):
        invoke("run", "bad.yaml", "--no-report", "-q", "--duration", "0.01")


TOO_MANY_BALLS = (
    "the excess asks for more than 300000 balls; a larger excess needs fewer; is the shape in metres?"
)


@pytest.mark.parametrize(
    ("method", "shape", "message"),
    [
        (
            "custom",
            "size: [0.1, 0.1, 0.1]}, spacing: 1.0e-9",
            "spacing of 1e-09 m on 0.06 m^2 asks for about 6e+16 points, allowed",
        ),
        (
            "custom",
            "size: [0.1, 0.1, 0.1]}, spacing: 1.0e-200",
            "asks for about inf points, allowed are 1000000",
        ),
        (
            "custom",
            "size: [1.0e+9, 1.0e-12, 1.0e-12]}",
            "asks for about 3.3e+10 points, allowed are 1000000",
        ),
        ("barrier", "size: [0.1, 0.1, 0.1]}, excess: 1.0e-9", TOO_MANY_BALLS),
        ("barrier", "size: [0.1, 0.1, 0.1]}, excess: 1.0e-200", TOO_MANY_BALLS),
        ("barrier", "size: [1.0e+9, 1.0e-12, 1.0e-12]}", TOO_MANY_BALLS),
    ],
)
def test_a_shape_that_would_take_billions_of_points_is_refused(
    invoke: Invoke, capsys: pytest.CaptureFixture[str], shape: str, message: str, method: str
) -> None:
    points = ", points: surface" if method == "custom" else ""
    obstacle = f"{{shape: {{type: box, {shape}{points}, position: [9, 0, 0]}}"
    Path("bad.yaml").write_text(f"{SCENARIO}method: {method}\nobstacles: [{obstacle}]\n")
    assert invoke("run", "bad.yaml", "--no-report", "-q") == 2
    error = capsys.readouterr().err
    assert error.startswith("error: small: obstacles[0]: ")
    assert message in error
    assert error.count("\n") == 1


def test_other_bad_input(invoke: Invoke, capsys: pytest.CaptureFixture[str]) -> None:
    assert invoke("run", "nothing") == 2
    assert (
        "no such file; shipped scenarios are bookshelf, box, cage, kitchen, planar-"
        in capsys.readouterr().err
    )
    assert invoke("run", "small.yaml", "--mode", "magic") == 2
    capsys.readouterr()
    Path("file").write_text("")
    assert invoke("run", "small.yaml", "--out", "file") == 2
    assert capsys.readouterr().err.startswith("error: ")
    for arguments in (
        ["fit"],
        ["fit", "planar2", "--urdf", "x"],
        ["fit", "planar2", "-k", "0"],
        ["fit", "nobody"],
    ):
        assert invoke(*arguments) == 2
        error = capsys.readouterr().err
        assert error.startswith("error: ")
        assert error.count("\n") == 1


def test_fit_writes_a_body_a_table_and_plots(invoke: Invoke, capsys: pytest.CaptureFixture[str]) -> None:
    assert invoke("fit", "planar2", "-k", "2", "--out", "b.json", "--plots", "plots", "--json", "-") == 0
    document = json.loads(capsys.readouterr().out)
    assert document["num_components"] == 4
    assert [row["link"] for row in document["links"]] == ["link1", "link2"]
    from sidestep import Body, Robot

    assert Body.load("b.json", Robot.named("planar2")).num_components == 4
    assert list(Path("plots").glob("*.png"))


def test_lists(invoke: Invoke, capsys: pytest.CaptureFixture[str]) -> None:
    assert invoke("robots", "--json", "-") == 0
    names = [entry["name"] for entry in json.loads(capsys.readouterr().out)]
    assert {"fr3", "fr3_arm", "planar2"} <= set(names)
    assert invoke("robots") == 0
    assert "fr3_arm" in capsys.readouterr().out
    assert invoke("scenarios") == 0
    assert "thesis-6.2.3" in capsys.readouterr().out
    assert invoke("schema") == 0
    schema = json.loads(capsys.readouterr().out)
    assert invoke("scenarios", "--json", "-") == 0
    for document in json.loads(capsys.readouterr().out):
        jsonschema.validate(document, schema)


def test_version_and_cmake_folder(invoke: Invoke, capsys: pytest.CaptureFixture[str]) -> None:
    from sidestep import __version__

    assert invoke("--version") == 0
    assert capsys.readouterr().out == f"{__version__}\n"
    assert invoke("--cmake-dir") == 0
    assert (Path(capsys.readouterr().out.strip()) / "sidestepConfig.cmake").is_file()


@pytest.mark.parametrize("command", [[], ["run"], ["demo"], ["fit"], ["robots"], ["scenarios"], ["schema"]])
def test_every_command_has_help(
    invoke: Invoke, capsys: pytest.CaptureFixture[str], command: list[str]
) -> None:
    assert invoke(*command, "--help") == 0
    assert len(capsys.readouterr().out.splitlines()) > 4


def test_help_imports_nothing_heavy() -> None:
    code = (
        "import sys; sys.argv = ['sidestep', '--help']\n"
        "from sidestep.cli import main\n"
        "try: main()\n"
        "except SystemExit: pass\n"
        "heavy = {'numpy', 'pinocchio', 'mujoco', 'trimesh', 'sklearn', 'matplotlib', 'scipy', 'coal'}\n"
        "print('heavy:', sorted(heavy & set(sys.modules)))"
    )
    begin = time.perf_counter()
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.endswith("heavy: []\n")
    assert time.perf_counter() - begin < 5.0  # [s] takes 0.2 s; ten times that when the machine is busy


@pytest.mark.slow
def test_a_run_without_report_imports_neither_matplotlib_nor_jsonschema() -> None:
    code = (
        "import sys\n"
        "sys.argv = ['sidestep', 'run', 'planar-one-obstacle', '--method', 'barrier', '--no-report', '-q']\n"
        "from sidestep.cli import main\n"
        "try: main()\n"
        "except SystemExit as exit: assert exit.code == 0\n"
        "print('heavy:', sorted({'matplotlib', 'jsonschema', 'sklearn'} & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.endswith("heavy: []\n")


@pytest.mark.parametrize(
    "command",
    [["run", "small.yaml"], ["demo"], ["fit", "planar2"], ["bench", "reach"], ["reproduce"], ["robots"]],
)
def test_a_file_that_cannot_be_written_is_found_out_before_the_run(
    invoke: Invoke, capsys: pytest.CaptureFixture[str], command: list[str]
) -> None:
    assert invoke(*command, "--json", "nowhere/f.json") == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    assert "there is no folder nowhere" in captured.err


def test_the_studio_writes_no_figures(invoke: Invoke, capsys: pytest.CaptureFixture[str]) -> None:
    assert invoke("demo", "--studio", "--json", "-") == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    assert "--json goes with --no-studio" in captured.err


def test_a_diverging_run_is_one_line_and_exit_code_1(
    invoke: Invoke, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def diverge(*_: object, **__: object) -> None:
        raise RuntimeError("the integration diverged near 1.0 s")

    monkeypatch.setattr("sidestep.cli.run_command.run_and_show", diverge)
    assert invoke("run", "small.yaml", "-q", "--no-report") == 1
    assert capsys.readouterr().err == "failed: the integration diverged near 1.0 s\n"


def test_tables_print_the_units_of_their_columns() -> None:
    console = Console(width=80)
    with console.capture() as captured:
        console.print(figures_table("one step [us]", "clearance [mm]"))
    assert "one step [us]" in captured.get()
    assert "clearance [mm]" in captured.get()


def test_reach_prints_the_unit_of_a_step(invoke: Invoke, capsys: pytest.CaptureFixture[str]) -> None:
    assert (
        invoke("bench", "reach", "--robot", "planar2", "--obstacles", "0", "--problems", "1", "--jobs", "1")
        == 0
    )
    assert "step [us]" in capsys.readouterr().out


def test_a_method_of_ones_own_moves_an_arm_of_ones_own(
    invoke: Invoke, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    """As docs/how-to/comparing.md says, with the file of that page and a robot file of the examples."""
    root = Path(__file__).parents[1]
    page = (root / "docs" / "how-to" / "comparing.md").read_text(encoding="utf-8")
    (tmp_path / "my_method.py").write_text(page.split("```python\n")[1].split("```")[0], encoding="utf-8")
    of_files = ("--robot", str(root / "examples" / "planar3.urdf"), "--method", "my_method.py")
    few = ("--problems", "3", "--obstacles", "2", "--duration", "4", "--jobs", "1", "--quiet")
    code = invoke("bench", "reach", *of_files, *few, "--export", "p.json", "--json", "-")
    document = json.loads(capsys.readouterr().out)
    assert (Path(document["robot"]).name, document["method"]) == ("planar3.urdf", "my_method.py")
    assert (document["problems"], document["success"], document["collision"]) == (3, 2, 1)
    assert code == 1  # something was touched
    assert invoke("bench", "reach", *of_files, *few, "--problems-file", "p.json", "--json", "-") == code
    assert json.loads(capsys.readouterr().out)["success"] == document["success"]
    assert invoke("bench", "reach", *of_files, *few, "--poses") == 2
    said = capsys.readouterr().err.replace("\n", " ")
    assert "my_method.py: a method of your own gives accelerations, without --torque and --poses" in said
