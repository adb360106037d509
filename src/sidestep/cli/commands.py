"""The command line. Heavy modules are imported by the commands that need them, so that --help is quick."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import typer

from sidestep._core import __version__
from sidestep.cli import (
    bench_command,
    camera_command,
    fit_command,
    list_commands,
    prepare_command,
    replay_command,
    report_command,
    run_command,
    serve_command,
    show_command,
    simulate_command,
    studio_command,
)
from sidestep.extras import MissingExtraError
from sidestep.plugins import plugins

app = typer.Typer(
    name="sidestep",
    help="Reactive whole-arm obstacle avoidance for any manipulator with a URDF or MJCF.",
    no_args_is_help=True,
    add_completion=False,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)
app.command("demo")(run_command.demo)
app.command("run")(run_command.run)
app.command("serve")(serve_command.serve)
app.command("show")(show_command.show)
app.command("studio")(studio_command.studio)
app.command("scenarios")(list_commands.scenarios)
app.command("schema")(list_commands.schema)
app.command("robots")(list_commands.robots)
app.command("fit")(fit_command.fit)
app.command("prepare")(prepare_command.prepare)
app.command("simulate")(simulate_command.simulate)
app.command("replay")(replay_command.replay)
app.command("report")(report_command.report)
for name, command in plugins("sidestep.commands").items():
    app.command(name)(command)
app.add_typer(camera_command.app, name="camera")
app.add_typer(bench_command.app, name="bench")


def main() -> None:
    """Entry point: exit code 0 on success, 1 when a run fails, 2 on bad input (one line on stderr)."""
    try:
        app()
    except (ValueError, OSError, MissingExtraError) as error:
        print(f"error: {error}", file=sys.stderr)
        sys.exit(2)
    except RuntimeError as error:  # the physics or the integration diverged
        print(f"failed: {error}", file=sys.stderr)
        sys.exit(1)


def cmake_dir() -> Path:
    """The folder with sidestepConfig.cmake in the installed package.

    Raises:
        FileNotFoundError: the installation lacks it.
    """
    import sidestep._core as core

    assert core.__file__ is not None
    # Beside the compiled core, which stands in site-packages in an editable installation too.
    folder = Path(core.__file__).parent / "share" / "cmake" / "sidestep"
    if not (folder / "sidestepConfig.cmake").is_file():
        raise FileNotFoundError(f"there is no sidestepConfig.cmake in {folder}; install the package again")
    return folder


def _print_version(wanted: bool) -> None:
    if wanted:
        print(__version__)
        raise typer.Exit


def _print_cmake_dir(wanted: bool) -> None:
    if wanted:
        print(cmake_dir())
        raise typer.Exit


@app.callback()
def _options(
    version: Annotated[
        bool, typer.Option("--version", callback=_print_version, is_eager=True, help="Print the version.")
    ] = False,
    cmake: Annotated[
        bool,
        typer.Option(
            "--cmake-dir",
            callback=_print_cmake_dir,
            is_eager=True,
            help="Print the folder to give CMake as sidestep_DIR, for find_package(sidestep).",
        ),
    ] = False,
) -> None:
    pass
