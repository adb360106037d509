"""One call that runs a controller on a robot until it is done, and stops the arm however it ends."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager, ExitStack, contextmanager
from typing import TYPE_CHECKING, Any

from sidestep._core import (
    Controller,
    CycleObserver,
    Loop,
    LoopSettings,
    Perception,
    RobotState,
    RunEnd,
    RunReport,
)
from sidestep.loop.black_box import black_box_of
from sidestep.loop.supervisor import Supervisor

if TYPE_CHECKING:
    from collections.abc import Iterator

LOOK_PERIOD = 0.02  # [s] between two calls of `until`


class Arrived:
    """The condition that the arm has been at its goal for `LoopSettings.hold`."""

    def __repr__(self) -> str:
        return "sidestep.arrived"


arrived = Arrived()


def run(
    controller: Controller,
    driver: Any,
    *,
    until: Arrived | Callable[[RobotState], bool] | None = arrived,
    duration: float | None = None,
    perception: Perception | AbstractContextManager[Any] | None = None,
    record: str | os.PathLike[str] | None = None,
    black_box: str | os.PathLike[str] | bool | None = None,
    supervisor: Supervisor | bool = False,
    settings: LoopSettings | None = None,
    observers: Sequence[CycleObserver] = (),
) -> RunReport:
    """Runs a controller on a robot in a real-time thread: reads the state, steps and writes the command, once a period.

    Set the goal before, or meanwhile from another thread. However the run ends, the arm is brought to rest within its
    limits and clearances, and the driver stops. The goal is kept: another `run` goes on.

    Args:
        controller: with what it knows of obstacles.
        driver: of the robot, see `sidestep.drivers`.
        until: `sidestep.arrived`; or a function of the newest `RobotState`, called 50 times a second, that says whether
            the run is done; or None: until `duration` is over or somebody stops it.
        duration: longest time, counted in cycles [s].
        perception: images come from the `with` block of `sidestep.perception.watch`, which is opened for the run; or a
            `Perception` that is fed by the driver, if that has `frames()`, or by you.
        record: file of a recording of every step, see `Controller.record`.
        black_box: folder for the last 30 s of every run, for `sidestep report`; None: one in the user's cache where the
            robot lives by the machine's clock; False: none.
        supervisor: a running `Supervisor`; or True: one for this run. Nothing is written that it does not approve.
        settings: of the loop.
        observers: take part in every cycle, such as a server.

    Returns:
        why the run ended, and how punctual it was. An end that was not asked for is no exception: see `RunReport.end`.

    Raises:
        ValueError: controller and robot do not fit: joints, limits, period, output; or the supervisor is another
            controller's.
        RuntimeError: before the first motion: no state, no obstacles known, in contact, outside the limits.
        KeyboardInterrupt: after Ctrl-C, once the arm is at rest. An exception of `until` likewise.
    """
    if not (until is None or isinstance(until, Arrived) or callable(until)):
        raise TypeError(f"until is {until!r}, must be sidestep.arrived, a function of the state, or None")
    if not isinstance(supervisor, (bool, Supervisor)):
        raise TypeError(f"supervisor is {supervisor!r}, must be a Supervisor, True or False")
    with ExitStack() as around:
        if record is not None:
            around.enter_context(controller.record(record))
        if supervisor is True:
            supervisor = around.enter_context(Supervisor(controller))
        watching = [supervisor.link_of(controller)] if isinstance(supervisor, Supervisor) else []
        loop = Loop(
            controller,
            driver,
            settings,
            until_arrived=True if isinstance(until, Arrived) else None,
            duration=duration,
            observers=[*observers, *watching],
        )
        around.callback(loop.finish)  # leaves the controller to the next run, however this one ends
        wanted = driver.description.real_time if black_box is None else black_box
        around.enter_context(black_box_of(controller, wanted))
        if perception is not None:
            around.enter_context(_images(perception, driver))
        with stopping(loop):
            loop.start()
            while not loop.wait(LOOK_PERIOD):
                if callable(until) and not loop.is_stopping and until(loop.state()):
                    loop.stop(RunEnd.arrived, "until says so")
        return loop.finish()


@contextmanager
def stopping(loop: Loop) -> Iterator[None]:
    """Stops the run for whatever ends the block, and waits until the arm is at rest.

    `loop.start` belongs in the block: an interrupt can come out of it when the run has begun.
    """
    try:
        yield
    except KeyboardInterrupt:
        loop.stop(RunEnd.interrupted, "Ctrl-C")
        loop.finish()
        raise
    except BaseException as error:
        loop.stop(RunEnd.failed, f"{type(error).__name__}: {error}")
        loop.finish()
        raise


def _images(perception: Perception | AbstractContextManager[Any], driver: Any) -> AbstractContextManager[Any]:
    if not isinstance(perception, Perception):
        return perception
    if not hasattr(driver, "frames"):
        return ExitStack()  # somebody else feeds it
    from sidestep.perception import watch

    return watch(perception, driver)
