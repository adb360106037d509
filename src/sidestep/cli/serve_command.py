"""`sidestep serve`."""

from __future__ import annotations

import time as clock
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from sidestep.cli.interrupts import Interrupts
from sidestep.cli.output import QuietOption, console

if TYPE_CHECKING:
    from rich.console import Console

    from sidestep import Arm, Controller
    from sidestep.link import Server
    from sidestep.loop import CycleObserver, LoopSettings, RunReport, Supervisor
    from sidestep.perception import Perception

DRIVERS = {
    "franka": "Franka",
    "ideal": "Ideal",
    "mujoco": "MuJoCo",
    "replay": "Replay",
    "simulator": "SimulatorDriver",
    "ur": "UR",
}  # their classes in sidestep.drivers
LOOK_PERIOD = 0.02  # [s] between two looks at what clients ask of the run
START_TIMEOUT = 1.0  # [s] for state and obstacles, before it is said what is missing; and from try to try


def serve(
    arm: Annotated[
        str,
        typer.Argument(help="A name from `sidestep robots`, a URDF, xacro or MJCF file, or an .arm file."),
    ],
    driver: Annotated[
        str,
        typer.Option(help="Of the robot: ideal, mujoco, simulator, franka, ur or replay."),
    ] = "ideal",
    robot: Annotated[
        str | None,
        typer.Option(
            help="Scene of mujoco, address of a `sidestep simulate` that runs, host of franka or ur, or recording."
        ),
    ] = None,
    address: Annotated[
        str, typer.Option(help="Where to listen on this machine: a name, unix:/PATH or tcp:PORT.")
    ] = "arm",
    token_file: Annotated[
        Path | None, typer.Option(help="File for the token [default: ADDRESS.token beside the socket].")
    ] = None,
    output: Annotated[
        str,
        typer.Option(help="What the robot is sent: automatic, torque, acceleration, velocity or position."),
    ] = "automatic",
    period: Annotated[
        float | None, typer.Option(min=1e-4, max=0.1, help="Of a step [s] [default: the robot's].")
    ] = None,
    camera: Annotated[
        list[Path] | None,
        typer.Option(
            exists=True, help="camera.json of a depth camera whose images clients send; may be repeated."
        ),
    ] = None,
    free: Annotated[
        bool,
        typer.Option("--free", help="The space is free until a client says otherwise; else the arm waits."),
    ] = False,
    supervise: Annotated[
        bool | None,
        typer.Option(
            "--supervise/--no-supervise",
            help="A process of its own approves every command [default: for all drivers but ideal].",
        ),
    ] = None,
    zenoh: Annotated[
        str | None, typer.Option(metavar="NAME", help="Serve also over Zenoh, for connect('zenoh/NAME').")
    ] = None,
    zenoh_endpoint: Annotated[
        str, typer.Option(help="Where Zenoh listens; other machines reach it only if that is no loopback.")
    ] = "tcp/127.0.0.1:7447",
    record: Annotated[
        Path | None, typer.Option(help="File of a recording of every step, see `sidestep replay`.")
    ] = None,
    longest_gap: Annotated[
        float | None,
        typer.Option(help="The run ends where the loop is later [s], see LoopSettings [default: 0.1]."),
    ] = None,
    black_box: Annotated[
        bool, typer.Option(help="Keep the last 30 s in the user's cache, for `sidestep report`.")
    ] = True,
    quiet: QuietOption = False,
) -> None:
    """Move an arm for other programs: they connect by `sidestep.connect`, look, and one of them is in command.

    The arm waits for obstacles from a client unless --free is given. A run that ends, by a client's wish or by
    something that went wrong, goes on once the client in command resumes. Ctrl-C brings the arm to rest within its
    limits, and ends.

    Exit code: 0 after Ctrl-C or SIGTERM with the arm at rest, 1 where it was not, 2 on bad input.
    """
    from sidestep import Controller, ControllerSettings, Obstacles
    from sidestep.cli.camera_options import load_arm
    from sidestep.link import Server
    from sidestep.loop import Supervisor
    from sidestep.loop.black_box import black_box_of

    terminal = console(quiet=quiet)
    loaded = load_arm(arm, console(quiet=quiet, to_stderr=True), draft=False)
    with ExitStack() as around:
        opened = around.enter_context(open_driver(driver, loaded, robot, period=period))
        settings = ControllerSettings(output=output_for(output, opened.description.outputs))
        settings.period = period or opened.description.period
        controller = Controller(loaded, settings)
        if record is not None:
            around.enter_context(controller.record(record))
        around.enter_context(black_box_of(controller, black_box))
        if free:
            controller.set_obstacles(Obstacles.none())
        seen = perception_of(controller, camera or [])
        server = Server(controller, address, token_file=token_file, perception=seen)
        if zenoh is not None:
            from sidestep.link import ZenohBridge

            around.enter_context(ZenohBridge(server.address, zenoh, endpoint=zenoh_endpoint))
        reach = "" if zenoh is None else f", and as zenoh/{zenoh} at {zenoh_endpoint}"
        terminal.print(
            f"serving '{loaded.name}' at {server.address}{reach}; token: {server.token_file}; Ctrl-C stops the arm",
            highlight=False,
            markup=False,
            soft_wrap=True,
        )
        watching = None
        if supervise if supervise is not None else driver.lower() != "ideal":
            watching = around.enter_context(Supervisor(controller))
        at_rest = serve_runs(controller, opened, server, watching, loop_settings(longest_gap), terminal)
    raise typer.Exit(0 if at_rest else 1)


def serve_runs(
    controller: Controller,
    driver: Any,
    server: Server,
    supervisor: Supervisor | None,
    settings: LoopSettings,
    terminal: Console,
) -> bool:
    """Runs the controller again and again as clients ask for it, until Ctrl-C; whether the arm was at rest then."""
    said = ""
    at_rest = True  # before the first motion
    with Interrupts() as interrupts:
        while True:
            began = clock.monotonic()
            try:
                report = one_run(controller, driver, server, supervisor, settings, interrupts)
            except RuntimeError as error:  # state or obstacles are missing, or the arm touches something
                if said != str(error):
                    said = str(error)
                    _say(terminal, f"waiting: {said}")
                if interrupts.wait(began + START_TIMEOUT - clock.monotonic()):
                    return at_rest
                continue
            said, at_rest = "", bool(report.at_rest)
            rest = f"at rest after {report.stop_time:.2f} s" if at_rest else "not at rest"
            _say(
                terminal,
                f"the run has ended ({report.end.name}): {report.why or report.end.name}; the arm was {rest}",
            )
            if report.end.name == "interrupted":
                return at_rest
            _say(terminal, "waiting for the client in command to resume")
            while not server.take_resume():
                if interrupts.wait(LOOK_PERIOD):
                    return at_rest


def one_run(
    controller: Controller,
    driver: Any,
    server: Server,
    supervisor: Supervisor | None,
    settings: LoopSettings,
    interrupts: Interrupts,
) -> RunReport:
    """One run, until a client, Ctrl-C or something that goes wrong ends it.

    Raises:
        RuntimeError: before the first motion: no state, no obstacles known, in contact, outside the limits.
    """
    from sidestep.loop import Loop
    from sidestep.loop.run import stopping

    observers: list[CycleObserver] = [server]
    if supervisor is not None:
        supervisor.reset()
        observers.append(supervisor.link)
    loop = Loop(controller, driver, settings, observers=observers)
    with stopping(loop):
        loop.start()
        server.run_began()
        while not loop.wait(LOOK_PERIOD):
            if (why := server.take_stop()) is not None:
                loop.stop("stopped", why)
            if interrupts.came:
                loop.stop("interrupted", "Ctrl-C")
    report = loop.finish()
    server.take_stop()  # of before the end, as the next one
    server.take_resume()
    server.run_ended(report.why or report.end.name)
    return report


@contextmanager
def open_driver(kind: str, arm: Arm, robot: str | None, *, period: float | None) -> Iterator[Any]:
    """The driver of a name, open.

    Raises:
        ValueError: there is no such driver, or it needs to know where the robot is.
    """
    from sidestep import drivers

    given = kind.lower()
    if given not in DRIVERS:
        raise ValueError(f"driver is {kind!r}; there are " + ", ".join(sorted(DRIVERS)))
    made = getattr(drivers, DRIVERS[given])
    if given == "ideal":
        driver = made(arm, period=period or 0.001)
    elif robot is None:
        raise ValueError(f"the driver {given} needs --robot, where the robot is")
    elif given == "mujoco" and robot.startswith(("unix:", "tcp:")):  # `sidestep simulate` runs there already
        driver = drivers.SimulatorDriver(robot)
    elif given == "ur":
        driver = made(robot, arm=arm)
    else:
        driver = made(robot)
    with driver if hasattr(driver, "__enter__") else nullcontext(driver) as opened:
        yield opened


def loop_settings(longest_gap: float | None) -> LoopSettings:
    """How the loop runs here: it says soon what it waits for."""
    from sidestep.loop import LoopSettings

    settings = LoopSettings(start_timeout=START_TIMEOUT)
    if longest_gap is not None:
        settings.longest_gap = longest_gap
    return settings


def output_for(output: str, outputs: list[str]) -> str:
    """What is sent: automatic where the robot takes torque, else the first that it takes."""
    return output if output != "automatic" or "torque" in outputs or not outputs else outputs[0]


def perception_of(controller: Controller, files: list[Path]) -> Perception | None:
    """What clients' images go to; None without cameras."""
    if not files:
        return None
    from sidestep.perception import Perception
    from sidestep.perception.camera_file import read_camera

    return Perception(controller, [read_camera(file).camera() for file in files])


def _say(terminal: Console, words: str) -> None:
    terminal.print(words, highlight=False, markup=False, soft_wrap=True)
