"""`sidestep simulate`."""

from __future__ import annotations

import gc
import os
import signal
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, TypeAlias

import typer

from sidestep.cli.interrupts import Interrupts
from sidestep.cli.output import JsonOption, QuietOption, console, write_json
from sidestep.simulation.link import HOLD_CYCLES

if TYPE_CHECKING:
    from sidestep.simulation.simulator import Simulator

DelayOption: TypeAlias = Annotated[
    str, typer.Option(metavar="MIN:MAX", help="Of messages, in each direction [ms]; drawn once a second.")
]
JitterOption: TypeAlias = Annotated[
    float, typer.Option(min=0.0, help="Mean of what each message takes longer [ms], exponential.")
]
LossOption: TypeAlias = Annotated[
    float, typer.Option(min=0.0, max=0.99, help="Share of the messages that are lost, in each direction.")
]


def simulate(
    scene: Annotated[
        str,
        typer.Argument(
            help="A scenario file (YAML), a name from `sidestep scenarios`, or a robot's name from `sidestep robots`."
        ),
    ],
    address: Annotated[
        str | None,
        typer.Option(
            metavar="unix:PATH|tcp:PORT|NAME",
            help="Where drivers connect, on this machine alone [default: a socket of its own, which is printed].",
        ),
    ] = None,
    object_: Annotated[
        list[str] | None,
        typer.Option(
            "--object",
            metavar="KIND:LENGTHS@X,Y,Z",
            help="Around a robot by name [m], such as sphere:0.05@0.4,0,0.5; may be repeated.",
        ),
    ] = None,
    start: Annotated[
        str | None,
        typer.Option(metavar="Q1,Q2,…", help="Of a robot by name [rad or m] [default: mid-range]."),
    ] = None,
    delay: DelayOption = "0:0",
    jitter: JitterOption = 0.0,
    loss: LossOption = 0.0,
    seed: Annotated[int, typer.Option(min=0, help="Of delays and losses.")] = 0,
    speed: Annotated[
        float,
        typer.Option(min=0.0, help="Simulated time per time of the machine; 0: as fast as it is asked."),
    ] = 1.0,
    hold: Annotated[
        int,
        typer.Option(
            min=1, max=1000, help="Cycles without a command for which the last one holds; then it brakes."
        ),
    ] = HOLD_CYCLES,
    leap: Annotated[
        bool,
        typer.Option("--leap", help="Torques leap as they are told, not at most by their rate limits."),
    ] = False,
    clock_jump: Annotated[
        float,
        typer.Option(
            metavar="SECONDS", help="On SIGUSR1 the clock of its states jumps by so much, may be negative."
        ),
    ] = 0.0,
    duration: Annotated[
        float | None, typer.Option(min=0.001, help="End after so much simulated time [s].")
    ] = None,
    motion: Annotated[
        Path | None, typer.Option(help="Write the true motion to this file (.npz), every cycle.")
    ] = None,
    once: Annotated[
        bool, typer.Option("--once", help="End when the first driver has gone and the arm rests.")
    ] = False,
    parent: Annotated[
        int | None, typer.Option(hidden=True, help="End as soon as the parent is not this process any more.")
    ] = None,
    json: JsonOption = None,
    quiet: QuietOption = False,
) -> None:
    """A robot in MuJoCo as a program of its own, which drivers command at 1 kHz.

    It sends its state every cycle and takes torque (gravity is added), acceleration, velocity or position. The world
    stands still until a driver starts. Where no command comes, the last one holds for a while; then the arm brakes,
    also when the driver is killed. At the end it says what was touched and which limits were exceeded. Exit code: 0
    where nothing was touched and no limit of position, velocity, torque or its rate exceeded, 1 where some, 2 on bad
    input.
    """
    from sidestep.scenario.simulated import port_of, scene_of, simulated_robot
    from sidestep.simulation.link import Link
    from sidestep.simulation.motion_record import MotionRecord
    from sidestep.simulation.simulator import Simulator

    link = Link(delay=delay_of(delay), jitter=1e-3 * jitter, loss=loss, seed=seed)
    record = None if motion is None else MotionRecord()
    at = None if start is None else numbers_of(start, "--start")
    scenario = scene_of(scene, objects=object_ or (), start=at)
    robot = simulated_robot(scenario, hold_cycles=hold, ramps=not leap, record=record)
    port = port_of(robot, address or own_address(), speed=speed)
    terminal = console(quiet=quiet, to_stderr=json == "-")
    print(f"listening at {port.address}", flush=True)
    simulator = Simulator(robot, port, link=link, speed=speed)
    if clock_jump:
        signal.signal(signal.SIGUSR1, lambda *_: _jump(simulator, clock_jump))
    gc.freeze()  # what is loaded stays: no pause of a collection in a cycle

    interrupts = Interrupts()

    def goes_on() -> bool:
        over = duration is not None and robot.time >= duration
        gone = once and simulator.was_controlled and not port.is_controlled and robot.at_rest
        return not (interrupts.came or over or gone or (parent is not None and os.getppid() != parent))

    found: dict[str, Any] = {"address": port.address, "failure": ""}
    with interrupts:
        try:
            simulator.run(goes_on)
        except Exception as error:
            found["failure"] = str(error)
            raise
        finally:  # what is known until then, whatever ended it
            found |= {**simulator.to_dict(), "refusals": port.refusals}
            if record is not None and motion is not None:
                record.save(motion)
                found["unrecorded_cycles"] = record.left_out
            if json is not None:
                write_json(found, json)
    terminal.print(_table(found))
    raise typer.Exit(1 if found["contacts"] or found["limits_exceeded"] else 0)


def _jump(simulator: Simulator, seconds: float) -> None:
    simulator.clock_ahead += seconds


def delay_of(text: str) -> tuple[float, float]:
    """Least and most [s] of a delay as the command line writes it, MIN:MAX or one number [ms].

    Raises:
        ValueError: names the text and what is allowed.
    """
    low, _, high = text.partition(":")
    try:
        least, most = float(low), float(high or low)
        if not 0.0 <= least <= most <= 1000.0:
            raise ValueError
    except ValueError:
        raise ValueError(f"--delay is {text!r}; allowed: MIN:MAX in ms, 0 <= MIN <= MAX <= 1000") from None
    return 1e-3 * least, 1e-3 * most


def numbers_of(text: str, option: str) -> list[float]:
    """Numbers between commas.

    Raises:
        ValueError: names the text.
    """
    try:
        return [float(part) for part in text.split(",")]
    except ValueError:
        raise ValueError(f"{option} is {text!r}; allowed: numbers between commas") from None


def own_address() -> str:
    """The name of a socket that no other simulator has."""
    return f"simulate-{os.getpid()}"


def _table(found: dict[str, Any]) -> object:
    from sidestep.cli.bench_output import figures_table

    table = figures_table("", "", show_header=False)
    table.add_row("simulated", f"{found['simulated_s']:.3f} s, {found['late_cycles']} cycles late")
    table.add_row("cycles without a command", f"{found['lost_cycles']}")
    pairs = ", ".join(f"{pair} {count}" for pair, count in found["contact_pairs"].items())
    table.add_row("contact points", f"{found['contacts']}" + (f" ({pairs})" if pairs else ""))
    for name, limit in found["limits"].items():
        told = f"{limit['cycles']} cycles beyond"
        if limit["cycles"]:
            told += f", by {limit['worst']:.3g} at worst"
        if name != "position":
            told += f"; at most {100.0 * limit['largest']:.0f} % used"
        table.add_row(name, told)
    leaps = found["torque_leaps"]
    told = f", {leaps['largest']:.3g} times the limit at worst" if leaps["cycles"] else ""
    table.add_row("torque leaps", f"{leaps['cycles']}{told}")
    if found.get("unrecorded_cycles"):
        table.add_row("cycles not in the motion's file", f"{found['unrecorded_cycles']}: it was full")
    if found["trouble"]:
        table.add_row("stopped by itself", found["trouble"])
    return table
