"""`sidestep fit`."""

from __future__ import annotations

import dataclasses
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from sidestep.cli.output import JsonOption, QuietOption, console, write_json

if TYPE_CHECKING:
    from sidestep import Body, Robot


class CovarianceChoice(StrEnum):
    """Shape of the Gaussians."""

    spherical = "spherical"
    diagonal = "diagonal"
    full = "full"


def fit(
    robot: Annotated[str | None, typer.Argument(help="A name from `sidestep robots`; or use --urdf.")] = None,
    urdf: Annotated[Path | None, typer.Option(help="URDF, xacro or MJCF file.")] = None,
    package_dir: Annotated[
        list[Path] | None, typer.Option(help="Folder searched for package:// addresses; may be repeated.")
    ] = None,
    components: Annotated[
        str, typer.Option("--components", "-k", help="Gaussians per link: a number, 'aic' or 'bic'.")
    ] = "4",
    covariance: Annotated[
        CovarianceChoice, typer.Option(help="Shape of the Gaussians.")
    ] = CovarianceChoice.full,
    seed: Annotated[int, typer.Option(min=0, help="Seed of sampling and EM.")] = 0,
    out: Annotated[Path | None, typer.Option("--out", "-o", help="Body file to write.")] = None,
    plots: Annotated[Path | None, typer.Option(help="Folder for figures.")] = None,
    json: JsonOption = None,
    quiet: QuietOption = False,
) -> None:
    """Fit a Gaussian mixture to the surface of every link of a robot."""
    if (robot is None) == (urdf is None):
        raise ValueError("give either the name of a robot (see `sidestep robots`) or --urdf FILE")
    number = _components(components)
    from sidestep import Robot

    if urdf is not None:
        arm = Robot.from_urdf(urdf, package_dirs=package_dir or ())
    else:
        arm = Robot.named(robot or "")
    terminal = console(quiet=quiet, to_stderr=json == "-")
    body = _fit_with_progress(arm, number, covariance.value, seed, terminal)
    terminal.print(_table(body))
    if out is not None:
        body.save(out)
        terminal.print(f"Body: {out}", highlight=False, soft_wrap=True)
    if plots is not None:
        from sidestep.body.report import plot_fit

        with terminal.status("drawing"):
            for path in plot_fit(body, arm, plots):
                terminal.print(f"Figure: {path}", highlight=False, soft_wrap=True)
    if json is not None:
        write_json(_document(arm, body), json)


def _components(text: str) -> int | Literal["aic", "bic"]:
    if text == "aic":
        return "aic"
    if text == "bic":
        return "bic"
    try:
        number = int(text)
    except ValueError:
        number = 0
    if number < 1:
        raise ValueError(f"--components is {text!r}; allowed: a whole number from 1, 'aic' or 'bic'")
    return number


def _fit_with_progress(
    robot: Robot,
    components: int | Literal["aic", "bic"],
    covariance: Literal["spherical", "diagonal", "full"],
    seed: int,
    terminal: Any,
) -> Body:
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    from sidestep import Body

    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with Progress(*columns, console=terminal, transient=True) as bar:
        task = bar.add_task(f"fitting {robot.name}", total=None)

        def on_step(link: str, done: int, total: int) -> None:
            bar.update(task, description=f"fitting {link}", completed=done, total=total)

        return Body.fit(robot, components=components, covariance=covariance, seed=seed, progress=on_step)


def _table(body: Body) -> object:
    from rich import box
    from rich.markup import escape
    from rich.table import Table

    from sidestep.body.report import fit_table

    heads = (
        "link",
        "Gaussians",
        "log-likelihood [nats]",
        "in 2-sigma ellipsoids",
        "mean distance to a mean",
        "EM",
    )
    table = Table(*map(escape, heads), box=box.SIMPLE, pad_edge=False)
    for column in table.columns[1:5]:
        column.justify = "right"
    for row in fit_table(body):
        table.add_row(
            row.link,
            str(row.num_components),
            f"{row.log_likelihood:.2f}",
            f"{row.coverage_percent:.1f} %",
            f"{row.mean_distance_mm:.1f} mm",
            "converged" if row.converged else "[yellow]not converged[/yellow]",
        )
    return table


def _document(robot: Robot, body: Body) -> dict[str, Any]:
    from sidestep.body.report import fit_table

    return {
        "robot": robot.name,
        "num_components": body.num_components,
        "links": [dataclasses.asdict(row) for row in fit_table(body)],
    }
