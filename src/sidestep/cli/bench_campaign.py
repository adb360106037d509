"""What the commands of campaigns share: their options, their run with a bar, and their end."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Annotated, Any, NoReturn, TypeAlias

import typer

from sidestep.cli.bench_output import with_bar
from sidestep.cli.output import console, write_json

Row = dict[str, Any]
RobotsOption: TypeAlias = Annotated[
    list[str] | None, typer.Option("--robot", help="A name from `sidestep robots`; may be repeated.")
]
FileOption: TypeAlias = Annotated[
    Path | None,
    typer.Option("--file", help="Rows as they come (JSON lines); an interrupted run continues from there."),
]
ShardOption: TypeAlias = Annotated[
    str, typer.Option(metavar="K/N", help="Only the K-th of N equal parts, for several machines.")
]


def given_options(**options: Sequence[Any] | None) -> dict[str, Any]:
    """The options that were given; the others have the defaults of the settings."""
    return {name: tuple(values) for name, values in options.items() if values}


def campaign_rows(
    title: str,
    run: Callable[..., list[Row]],
    settings: object,
    file: Path | None,
    shard: str,
    jobs: int | None,
    json: str | None,
    quiet: bool,
) -> list[Row]:
    from sidestep.bench import default_jobs, parse_shard

    part, processes = parse_shard(shard), jobs or default_jobs()
    return with_bar(
        console(quiet=quiet, to_stderr=json == "-"),
        title,
        lambda show: run(settings, file=file, shard=part, jobs=processes, progress=show),
    )


def end_with(shown: object, document: Row, json: str | None, quiet: bool, *, bad: bool) -> NoReturn:
    from sidestep import __version__
    from sidestep.bench.parallel import cpu_name

    console(quiet=quiet, to_stderr=json == "-").print(shown)
    if json is not None:
        write_json(_finite({**document, "cpu": cpu_name(), "version": __version__}), json)
    raise typer.Exit(1 if bad else 0)


def _finite(value: Any) -> Any:
    """Without infinities, which JSON does not have: None in their place."""
    if isinstance(value, dict):
        return {key: _finite(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(item) for item in value]
    return None if isinstance(value, float) and value in (float("inf"), float("-inf")) else value
