"""`sidestep prepare`."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Annotated

import typer

from sidestep.cli.bench_output import with_bar
from sidestep.cli.limit_options import (
    AccelerationLimitOption,
    EffortLimitOption,
    JerkLimitOption,
    LockedOption,
    PackageDirOption,
    TipOption,
    VelocityLimitOption,
    by_name,
    reading_options,
)
from sidestep.cli.output import QuietOption, console


def prepare(
    source: Annotated[
        str, typer.Argument(help="A name from `sidestep robots`, or a URDF, xacro or MJCF file.")
    ],
    out: Annotated[Path, typer.Option("--out", "-o", help="Arm file to write (.arm).")],
    package_dir: PackageDirOption = None,
    tip: TipOption = None,
    locked: LockedOption = None,
    effort_limit: EffortLimitOption = None,
    velocity_limit: VelocityLimitOption = None,
    acceleration_limit: AccelerationLimitOption = None,
    jerk_limit: JerkLimitOption = None,
    components: Annotated[
        list[str] | None,
        typer.Option(
            help="LINK=NUMBER of ellipsoids for a link that works close to things, such as hand=24: more of them "
            "overshoot less; may be repeated."
        ),
    ] = None,
    draft: Annotated[
        bool, typer.Option(help="In seconds: a body that covers the arm as surely, with larger ellipsoids.")
    ] = False,
    cache: Annotated[
        bool,
        typer.Option(
            "--cache/--no-cache", help="Take what is prepared already, and keep what is prepared now."
        ),
    ] = True,
    quiet: QuietOption = False,
) -> None:
    """Prepare an arm once: what a `Controller` needs, in one file that C++ reads alone.

    Covers every link, measures clearance tables and finds pairs of links that may touch: minutes for a new robot, with
    --draft seconds, moments where the user's cache has it. The cache is the folder that SIDESTEP_CACHE_DIR names, or
    `sidestep` in the user's cache directory (~/.cache/sidestep on Linux). It has covers by link and measures by pair of
    links, which other arms share, and may be deleted at any time.

    Exit code: 0 when the file is written, 2 on bad input.
    """
    if out.suffix.lower() != ".arm":
        raise ValueError(f"--out is {out}; an arm file ends with .arm")
    if not out.parent.is_dir():
        raise ValueError(f"--out is {out}; there is no folder {out.parent}")
    from sidestep.arm import Arm

    terminal = console(quiet=quiet, to_stderr=True)

    given = reading_options(
        package_dir, tip, locked, effort_limit, velocity_limit, acceleration_limit, jerk_limit
    )
    numbers = by_name(components, "--components", "LINK=NUMBER", "hand=24")
    if wrong := [f"{link}={number:g}" for link, number in numbers.items() if not number.is_integer()]:
        raise ValueError(
            f"--components is {wrong[0]!r}; allowed: LINK=NUMBER with a whole number of at least 1"
        )
    given["components"] = {link: int(number) for link, number in numbers.items()}

    def prepared(show: Callable[[int, int, str], None]) -> Arm:
        def tell(stage: str, item: str, done: int, in_all: int) -> None:
            show(done, in_all, f"{stage} {item}")

        return Arm.load(source, draft=draft, cache=cache, progress=tell, **given)

    arm = with_bar(terminal, f"preparing {Path(source).name}", prepared)
    arm.save(out)
    terminal.print(arm.summary(), highlight=False, markup=False, soft_wrap=True)
    terminal.print(f"Arm: {out} ({arm.num_coordinates} coordinates)", highlight=False, soft_wrap=True)
