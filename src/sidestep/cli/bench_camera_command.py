"""`sidestep bench camera-mask` and `sidestep bench camera-recording`."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated, Any

import typer

from sidestep.cli.bench_campaign import (
    FileOption,
    RobotsOption,
    ShardOption,
    campaign_rows,
    end_with,
    given_options,
)
from sidestep.cli.bench_output import JobsOption, SeedOption, figures_table, with_bar
from sidestep.cli.output import JsonOption, QuietOption, console, write_json

Row = dict[str, Any]

MOST_LEFT_OVER = 1e-5  # share of all pixels that show the arm, and count as an obstacle where none is
MOST_BEYOND = 0.02  # [m] from the arm beyond the expected error at which something is lost
LOOKS = ("mesh", "collision", "visual")


def camera_mask(
    robot: RobotsOption = None,
    noise: Annotated[
        list[str] | None, typer.Option(help="A noise model; may be repeated [default: all three].")
    ] = None,
    scenes: Annotated[int, typer.Option(min=1, help="Scenes of each robot and noise.")] = 4,
    images: Annotated[int, typer.Option(min=1, help="Images of each camera and scene, at 30 Hz.")] = 42,
    size: Annotated[str, typer.Option(metavar="WIDTHxHEIGHT", help="Of an image [pixel].")] = "424x240",
    translation: Annotated[float, typer.Option(min=0.0, help="Error of a camera's place [m].")] = 0.01,
    rotation: Annotated[float, typer.Option(min=0.0, help="Error of its direction [degrees].")] = 1.0,
    clock: Annotated[float, typer.Option(min=0.0, help="Error of times of capture [s].")] = 0.03,
    looks: Annotated[
        str,
        typer.Option(help="mesh, what covers are proven to; collision, its convex parts; or visual."),
    ] = "mesh",
    seed: SeedOption = 0,
    file: FileOption = None,
    shard: ShardOption = "1/1",
    jobs: JobsOption = None,
    json: JsonOption = None,
    quiet: QuietOption = False,
) -> None:
    """An arm moves at full speed above a table with objects, among three simulated cameras and an eye in hand.

    What Perception is told of cameras and times is wrong by just what it is told as bounds. Segmentation is the truth.
    Beside it: without any error, and links grown by 5 and 10 cm, which get every fourth image. Left over: pixels of the
    arm that count as obstacle; nowhere: not at something behind, whose depth an edge may show. Ghosts: obstacles nearer
    than 3 cm to the arm where nothing is. Lost: how far what counts as arm is from the arm, and beyond the expected
    error. Exit code: 0 when at most 1 in 10^5 pixels is left over where nothing is, no ghost is near the arm, and
    nothing is lost farther than 2 cm beyond the expected error of where the arm is believed; else 1.
    """
    from sidestep.bench import CameraMaskSettings, ghost_table, mask_table, run_camera_mask

    if looks not in LOOKS:
        raise ValueError(f"--looks is {looks!r}; allowed: {', '.join(LOOKS)}")
    width, height = _size(size)
    settings = CameraMaskSettings(
        **given_options(robots=robot, noises=noise),
        scenes=scenes,
        images=images,
        width=width,
        height=height,
        translation=translation,
        rotation=math.radians(rotation),
        clock=clock,
        looks=looks,  # type: ignore[arg-type]
        seed=seed,
    )
    rows = campaign_rows("camera-mask", run_camera_mask, settings, file, shard, jobs, json, quiet)
    tables = {by: mask_table(rows, by) for by in ("all", "view", "robot", "noise")}
    ghosts = ghost_table(rows)
    told = tables["all"]["told"]["all"]
    bad = (
        told["left_over_nowhere_share"] > MOST_LEFT_OVER
        or ghosts["told"]["near_arm"] > 0
        or (told["beyond_told"]["max"] or 0.0) > MOST_BEYOND
    )
    document = {"bench": "camera-mask", "size": size, "tables": tables, "ghosts": ghosts}  # rows: --file
    end_with(_mask_figures(tables, ghosts), document, json, quiet, bad=bad)


def _mask_figures(tables: dict[str, Any], ghosts: dict[str, dict[str, int]]) -> object:
    shown = figures_table(
        "errors",
        "images",
        "left over",
        "nowhere",
        "ghosts",
        "lost p50 [mm]",
        "p99",
        "max",
        "beyond p99",
        "max",
    )
    for by, table in tables.items():
        for way, cells in table.items():
            for name, cell in cells.items():
                if by != "all" and way != "told":
                    continue
                found = ghosts[way]
                shown.add_row(
                    way if by == "all" else f"  {name}",
                    str(cell["images"]),
                    f"{cell['left_over_share']:.1e}",
                    f"{cell['left_over_nowhere_share']:.1e}",
                    f"{found['near_arm']} in {found['moments']}" if by == "all" else "",
                    *(_mm(cell["distance"][key]) for key in ("p50", "p99", "max")),
                    *(_mm(cell["beyond"][key]) for key in ("p99", "max")),
                )
    return shown


def camera_recording(
    folder: Annotated[
        Path, typer.Argument(help="With depth images, camera.json, joints.csv and arm_mask_N.png.")
    ],
    robot: Annotated[str, typer.Option(help="A name from `sidestep robots`, or a description.")],
    pose: Annotated[
        str | None, typer.Option(help="Which of several poses of the camera is taken for true.")
    ] = None,
    translation: Annotated[float, typer.Option(min=0.0, help="Error that is added to it [m].")] = 0.01,
    rotation: Annotated[float, typer.Option(min=0.0, help="Error that is added to it [degrees].")] = 1.0,
    draws: Annotated[int, typer.Option(min=1, help="Poses with such an error.")] = 3,
    draft: Annotated[
        bool,
        typer.Option("--draft", help="With the body that is prepared in seconds, see `sidestep prepare`."),
    ] = False,
    seed: SeedOption = 0,
    json: JsonOption = None,
    quiet: QuietOption = False,
) -> None:
    """A recorded arm whose joints, calibration and masks are known: what is left of it, and taken of the world.

    Given: its calibration, told to be wrong by 1 cm and 5 mrad; exact: told to be exact; off: with errors that are
    added and told. Grown: links grown by 5 and 10 cm, and nothing told. Left over: pixels of the given mask that count
    as obstacle, at most 3 cm from the meshes; apart: farther away, such as a tool that the description lacks, or what
    is behind. World: more than 8 pixels outside of the mask and of the meshes as drawn; near: at most
    5 cm from them.
    """
    from sidestep import __version__
    from sidestep.bench import CameraRecordingSettings, recording_table, run_camera_recording

    settings = CameraRecordingSettings(
        folder,
        robot,
        pose,
        translation=translation,
        rotation=math.radians(rotation),
        draws=draws,
        draft=draft,
        seed=seed,
    )
    terminal = console(quiet=quiet, to_stderr=json == "-")
    rows = with_bar(terminal, folder.name, lambda show: run_camera_recording(settings, progress=show))
    table = recording_table(rows)
    terminal.print(_recording_figures(table))
    if json is not None:
        told = {"recording": folder.name, "robot": Path(robot).stem, "pose": pose, "draft": draft}
        write_json(
            {"bench": "camera-recording", **told, "table": table, "rows": rows, "version": __version__}, json
        )


def _recording_figures(table: dict[str, Row]) -> object:
    shown = figures_table(
        "pose",
        "images",
        "arm",
        "left over",
        "apart",
        "drawn, left",
        "world near",
        "lost near",
        "far",
        "farthest [mm]",
    )
    for way, cell in table.items():
        shown.add_row(
            way,
            str(cell["images"]),
            str(cell["mask_at_model"]),
            f"{cell['left_over_at_model']} ({100 * cell['left_over_share']:.2g} %)",
            f"{cell['left_over_apart']} of {cell['mask'] - cell['mask_at_model']}",
            str(cell["drawn_left_over"]),
            str(cell["world_near"]),
            f"{cell['lost_near']} ({100 * cell['lost_near_share']:.2g} %)",
            str(cell["lost_far"]),
            _mm(cell["max_lost"]),
        )
    return shown


def _size(text: str) -> tuple[int, int]:
    width, by, height = text.partition("x")
    if not (by and width.isdigit() and height.isdigit() and int(width) and int(height)):
        raise ValueError(f"--size is {text!r}; allowed: WIDTHxHEIGHT, for example 848x480")
    return int(width), int(height)


def _mm(metres: float | None) -> str:
    return "-" if metres is None else f"{1e3 * metres:.0f}"
