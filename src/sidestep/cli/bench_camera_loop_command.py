"""`sidestep bench camera-scenes` and `sidestep bench camera-moving`."""

from __future__ import annotations

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
from sidestep.cli.bench_output import (
    DurationOption,
    FailuresOption,
    JobsOption,
    SeedOption,
    SizeOption,
    TorqueOption,
    figures_table,
)
from sidestep.cli.output import JsonOption, QuietOption, console


def camera_scenes(
    folder: Annotated[
        Path, typer.Argument(help="Folder of sets, or one set: sceneNNNN.yaml, requestNNNN.yaml.")
    ],
    robot: Annotated[str, typer.Option(help="A name from `sidestep robots`, or a URDF file.")] = "panda",
    cameras: Annotated[int, typer.Option(min=1, max=2, help="Over the arm's shoulders.")] = 1,
    unseen: Annotated[
        str, typer.Option(help="What space that no camera has seen counts as: free or closed.")
    ] = "free",
    problems: Annotated[int, typer.Option(min=1, help="Of each set, the first ones.")] = 10,
    size: SizeOption = "848x480",
    noise: Annotated[str, typer.Option(help="A noise model: d435, kinect, structured_light, none.")] = "d435",
    exact_poses: Annotated[
        bool,
        typer.Option(
            "--exact-poses",
            help="Perception is told that the cameras' poses are exact, which they are; else 5 mm and 5 mrad.",
        ),
    ] = False,
    duration: DurationOption = 30.0,
    seed: SeedOption = 0,
    failures: FailuresOption = False,
    file: FileOption = None,
    shard: ShardOption = "1/1",
    jobs: JobsOption = None,
    json: JsonOption = None,
    quiet: QuietOption = False,
) -> None:
    """The published problems of MotionBenchMaker, where the controller knows nothing but what depth cameras show.

    Images of 30 Hz come 50 ms late, with noise. The arm looks around for 0.5 s at rest. Each problem that is not
    solved says why: hidden, what it touched was never in view, or nobody has seen that the way is free; late, it was
    in view for less than 0.3 s before, or time was over; wrong, obstacles where nothing is; voxels, true ones, as
    large as voxels and noise make them, leave no room; touched, what was in view 0.3 s before. Contacts are judged on
    exact meshes between samples. Exit code: 0 when nothing was touched that was in view 0.3 s before, and nothing is
    lost by wrong obstacles; else 1.
    """
    from sidestep.bench import (
        CameraSceneSettings,
        MotionSettings,
        camera_scene_table,
        read_motion_bench_maker,
        run_camera_scenes,
    )

    if unseen not in ("free", "closed"):
        raise ValueError(f"--unseen is {unseen!r}; allowed: free, closed")
    found = read_motion_bench_maker(folder)
    sets = dict.fromkeys(item.set for item in found)
    chosen = [item for name in sets for item in [p for p in found if p.set == name][:problems]]
    settings = CameraSceneSettings(
        robot=robot,
        cameras=cameras,
        unseen_is_free=unseen == "free",
        size=size,
        noise=noise,
        exact_poses=exact_poses,
        motion=MotionSettings(duration=duration),
        seed=seed,
    )
    rows = campaign_rows(
        "camera-scenes",
        lambda chosen_settings, **options: run_camera_scenes(chosen_settings, chosen, **options),
        settings,
        file,
        shard,
        jobs,
        json,
        quiet,
    )
    table = camera_scene_table(rows)
    shown = figures_table("set", "full knowledge", "cameras", "lost", "touched what was seen")
    for name, cell in table.items():
        shown.add_row(
            name,
            f"{cell['told_solved']} of {cell['problems']}",
            f"{cell['solved']} of {cell['problems']}",
            ", ".join(f"{count} {loss}" for loss, count in cell["lost"].items()) or "-",
            str(cell["touched_what_was_seen"]),
        )
    if failures and not quiet:
        for row in rows:
            if row["loss"]:
                line = f"{row['name']}  {row['loss']}: {row['why']}; {'; '.join(row['reasons'])}"
                console(quiet=quiet, to_stderr=json == "-").print(line, highlight=False, markup=False)
    whole = table["all"]
    bad = bool(whole["touched_what_was_seen"] or whole["lost"].get("wrong"))
    end_with(shown, {"bench": "camera-scenes", "table": table, "rows": rows}, json, quiet, bad=bad)


def camera_moving(
    robot: RobotsOption = None,
    seen: Annotated[
        list[str] | None, typer.Option(help="noise, lost30 or gone; may be repeated [default: all].")
    ] = None,
    timing: Annotated[
        list[str] | None,
        typer.Option(help="30Hz (50 ms late) or 10Hz (150 ms); may be repeated [default: both]."),
    ] = None,
    speed: Annotated[
        list[float] | None, typer.Option(help="Speed of the obstacle [m/s]; may be repeated.")
    ] = None,
    runs: Annotated[
        int, typer.Option(min=1, help="Runs in each cell; in every second one the arm moves.")
    ] = 6,
    cameras: Annotated[int, typer.Option(min=1, max=2, help="That face each other across the arm.")] = 2,
    size: SizeOption = "424x240",
    torque: TorqueOption = False,
    seed: SeedOption = 0,
    file: FileOption = None,
    shard: ShardOption = "1/1",
    jobs: JobsOption = None,
    json: JsonOption = None,
    quiet: QuietOption = False,
) -> None:
    """A ball or a capsule comes at an arm that holds still or moves, and the controller sees it through cameras alone.

    Noise of a D435; lost30: 30 % of the images are lost; gone: for 1 s images show nothing where it is. Judged on
    exact meshes between samples; for each contact a way out is searched. A contact counts of what was in view for
    0.3 s before. Exit code: 0 when none that counts had a way out, up to 0.5 m/s; else 1.
    """
    from sidestep.bench import CameraMovingSettings, Seen, camera_moving_table, run_camera_moving

    for item in seen or ():
        if item not in list(Seen):
            raise ValueError(f"--seen is {item!r}; allowed: {', '.join(Seen)}")
    options = given_options(
        robots=robot, seen=[Seen(item) for item in seen or ()], timings=timing, speeds=speed
    )
    settings = CameraMovingSettings(
        **options, runs=runs, cameras=cameras, size=size, torque=torque, seed=seed
    )
    rows = campaign_rows("camera-moving", run_camera_moving, settings, file, shard, jobs, json, quiet)
    table = camera_moving_table(rows)
    shown = figures_table("contacts (way out, of them in view)/runs", *table)
    for column in dict.fromkeys(name for cells in table.values() for name in cells):
        shown.add_row(column, *(_cell(cells.get(column)) for cells in table.values()))
    bad = any(
        row["counts"] and row["way_out"] and row["speed"] <= 0.5 for row in rows if row["clearance_m"] <= 0.0
    )
    end_with(shown, {"bench": "camera-moving", "table": table, "rows": rows}, json, quiet, bad=bad)


def _cell(cell: dict[str, Any] | None) -> str:
    if cell is None:
        return "-"
    return f"{cell['contacts']}({cell['with_way_out']}, {cell['in_view']})/{cell['runs']}"
