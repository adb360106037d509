"""Arms of Universal Robots, by the package `ur-rtde`: positions by servoJ, velocities by speedJ."""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import suppress
from types import TracebackType
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from sidestep._core import Command
from sidestep.arm import Arm
from sidestep.drivers import ur_dashboard
from sidestep.drivers.answer_within import answer_within
from sidestep.drivers.core import RobotDescription, RobotState, RobotStopped
from sidestep.drivers.real_time_threads import real_time_threads
from sidestep.drivers.ur_kinematics import check_kinematics
from sidestep.drivers.ur_words import FASTEST, JOINTS, PROTECTIVE_STOP, SHIPPED, Status, limits_of
from sidestep.perception.least_delay_clock import LeastDelayClock

Array: TypeAlias = NDArray[np.float64]

RATES = {3: 125, 5: 500}  # of the real-time data [1/s], by the major version of the box's software
OUTPUTS = ("position", "velocity")
VARIABLES = (
    "timestamp actual_q actual_qd target_q target_qd target_qdd robot_mode safety_mode robot_status_bits runtime_state "
    "safety_status_bits"
)
PRIORITY = 65  # of the threads that receive, where real-time scheduling is permitted
POLL = 0.0002  # [s] between two looks for a new state
SILENCE = 0.2  # [s] without a state after which the robot is not asked for anything any more
CATCHING_UP = (
    1.3  # times the arm's acceleration limits: servoJ follows them with up to a quarter more at 125 Hz
)
BRAKING = 10.0  # [rad/s²] of speedStop, [m/s²] of servoStop
ANSWER = 3.0  # [s] in which the robot must answer


class UR:
    """A UR3 to UR16 of the CB3 or e-Series; a context manager.

    Positions go by servoJ, whose target follows as q'' = gain (q_d - q - lookahead v). It is sent
    q_d = position + lookahead velocity + acceleration / gain, so that the target follows the command without delay.
    Velocities go by speedJ. After lost cycles the target catches up with at most `acceleration`. Where nobody writes, a
    watchdog on the robot ends the program, and the arm brakes.

    Attributes:
        description: what it is.
    """

    def __init__(
        self,
        address: str,
        *,
        arm: Arm | str | None = None,
        frequency: int | None = None,
        lookahead: float = 0.1,
        gain: float = 300.0,
        acceleration: float | None = None,
        watchdog: float = 0.1,
        kinematics_tolerance: float = 0.01,
    ) -> None:
        """Connects, and reads; control begins with `start`.

        Args:
            address: of the controller box.
            arm: what the controller takes it for; without it the shipped arm of the model that the box names.
            frequency: of states and commands [1/s]; without it what the box can: 125 (CB3) or 500 (e-Series).
            lookahead: of servoJ [s], 0.03 to 0.2. gain: of servoJ [1/s²], 100 to 2000.
            acceleration: most that a command asks of the robot's target [rad/s²], 0.01 to 40: it bounds how the arm
                catches up after late commands. Without it 1.3 times the largest acceleration limit of the arm.
            watchdog: for how long nobody may write until the robot stops its program [s].
            kinematics_tolerance: by which robot and `arm` may place the flange differently [m]; `start` compares them.

        Raises:
            ValueError: an argument, or an arm whose joints are not those of a UR.
            ConnectionError: nobody answers at the address.
        """
        self._check(frequency, lookahead, gain, acceleration, watchdog)
        self._address, self._lookahead, self._gain = address, lookahead, gain
        self._watchdog, self._tolerance = watchdog, kinematics_tolerance
        box = ur_dashboard.ask(address)
        self._frequency = frequency or RATES.get(box.major, 500)
        self._arm = _chosen(arm, box)
        self.description = RobotDescription(
            f"{box.model} (PolyScope {box.software})",
            joints=list(JOINTS),
            limits=limits_of(box.model),
            outputs=list(OUTPUTS),
            period=1.0 / self._frequency,
            paced=True,
            real_time=True,
            when_silent=f"goes on for {1e3 * watchdog:g} ms, to the last position or at the last velocity; then its "
            "watchdog stops the program and the arm brakes",
        )
        self._clock, self._stamp, self._heard = LeastDelayClock(), -1.0, time.monotonic()
        usual = min(FASTEST, CATCHING_UP * float(self._arm.limits.acceleration.max()))
        self._acceleration = usual if acceleration is None else acceleration
        self._lower, self._upper = self._arm.robot.limits.lower, self._arm.robot.limits.upper
        self._control: Any = None
        self._output, self._is_watched = "", False  # while the robot is controlled
        self._status = Status(0, 0, 0)
        self._target = (
            np.zeros(len(JOINTS)),
            np.zeros(len(JOINTS)),
        )  # position and velocity that the robot goes on from
        self._receive = self._receiver()

    def __enter__(self) -> UR:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def start(self, output: str) -> None:
        """Sends the control program and begins; needs remote control on an e-Series.

        Args:
            output: "position" or "velocity".

        Raises:
            ValueError: another output, or the robot's flange is not where the arm's is.
            RobotStopped: it cannot move, and why.
            ConnectionError: the connection is gone.
        """
        if output not in OUTPUTS:
            raise ValueError(f"a UR takes {' or '.join(OUTPUTS)}, not {output!r}")
        self.stop()
        self._listen()
        if why := self._status.why_it_rests():
            raise RobotStopped(f"{self.description.name}: {why}")
        self._upload()
        try:
            check_kinematics(self._flange_at, self._arm.robot, self._tolerance)
        except BaseException:  # nothing would end the program: its watchdog begins with the first command
            with suppress(ConnectionError, RuntimeError):
                self._within(ANSWER, self._control.stopScript)
            raise
        self._output, self._is_watched, self._stamp = output, False, -1.0

    def read(self, timeout: float) -> RobotState | None:
        """The next state; None: none came.

        Args:
            timeout: how long to wait [s].

        Raises:
            RobotStopped: it has stopped itself, or somebody did, while it was controlled.
            ConnectionError: the connection is gone.
        """
        receive, until = self._receive, time.monotonic() + timeout
        while receive.getTimestamp() == self._stamp:
            if not receive.isConnected():
                raise ConnectionError(f"{self.description.name} at {self._address} has closed the connection")
            left = until - time.monotonic()
            if left <= 0.0:
                return None
            time.sleep(min(POLL, left))
        self._heard = time.monotonic()
        state = self._newest()
        if self._output and (why := self._why()):
            raise RobotStopped(f"{self.description.name}: {why}")
        return state

    def write(self, command: Command) -> None:
        """Sends the command's position or velocity; what is not finite is not sent.

        Raises:
            RobotStopped: the robot does not take it, and why.
            ConnectionError: the connection is gone.
        """
        if not self._output:
            raise RuntimeError(f"{self.description.name} is not controlled; call start")
        if not (self._receive.isConnected() and self._control.isConnected()):
            raise ConnectionError(f"{self.description.name} at {self._address} has closed the connection")
        if not self._is_watched:  # from the first command on: until then the arm rests, whatever happens here
            if not self._within(ANSWER, self._control.setWatchdog, 1.0 / self._watchdog):
                raise RobotStopped(f"{self.description.name} did not take the watchdog: {self._why()}")
            self._is_watched = True
        if self._output == "position":
            position = self._servo_position(command)
            if not np.isfinite(position).all():
                return
            period = self.description.period
            taken = self._control.servoJ(position.tolist(), 0.0, 0.0, period, self._lookahead, self._gain)
        else:
            velocity = command.velocity
            if not np.isfinite(velocity).all():
                return
            taken = self._control.speedJ(velocity.tolist(), self._acceleration, 0.0)
        if not taken:
            self.read(self.description.period * 2.0)  # says why
            raise RobotStopped(
                f"{self.description.name} did not take a command: {self._why() or 'it gave no reason'}"
            )

    def stop(self) -> None:
        """Brakes and ends the program; the robot holds its position. May be called again.

        A robot that is not heard is not asked: its watchdog does the same.
        """
        output, self._output = self._output, ""
        if not output or not self._hears():
            return
        with suppress(ConnectionError, RuntimeError):
            halt = self._control.servoStop if output == "position" else self._control.speedStop
            if self._within(ANSWER, halt, BRAKING):
                self._within(ANSWER, self._control.stopScript)

    def close(self) -> None:
        """Stops, and ends the connection."""
        self.stop()
        for interface in (self._control, self._receive):
            if interface is not None:
                with suppress(ConnectionError, RuntimeError):
                    self._within(ANSWER, interface.disconnect)
        self._control = None

    def recover(self, timeout: float = 20.0) -> None:
        """Ends a protective stop: unlocks it, as soon as the robot permits; then `start` or `sidestep.run` goes on.

        Find out first why it stopped, and that the arm is free.

        Args:
            timeout: how long the robot may take [s]; it permits it 5 s after the stop.

        Raises:
            RobotStopped: it stopped for another reason, which ends elsewhere; or it did not unlock, and what it says.
            ConnectionError: the connection is gone.
        """
        self.stop()
        until, said = time.monotonic() + timeout, ""
        while time.monotonic() < until:
            self._listen()
            if not (why := self._status.why_it_rests()):
                return
            if self._status.safety == PROTECTIVE_STOP:
                said = ur_dashboard.unlock(self._address)
            elif not said:
                raise RobotStopped(f"{self.description.name}: {why}")
            time.sleep(0.1)
        raise RobotStopped(
            f"{self.description.name} did not recover in {timeout:g} s; it says: {said or 'nothing'}"
        )

    @staticmethod
    def _check(
        frequency: int | None, lookahead: float, gain: float, acceleration: float | None, watchdog: float
    ) -> None:
        if frequency not in (None, *RATES.values()):
            raise ValueError(
                f"frequency is {frequency}, allowed are {', '.join(map(str, RATES.values()))} [1/s]"
            )
        for name, value, least, most in (
            ("lookahead", lookahead, 0.03, 0.2),
            ("gain", gain, 100.0, 2000.0),
            ("acceleration", FASTEST if acceleration is None else acceleration, 0.01, FASTEST),
            ("watchdog", watchdog, 0.02, 1.0),
        ):
            if not least <= value <= most:
                raise ValueError(f"{name} is {value}, must be {least:g} to {most:g}")

    def _receiver(self) -> Any:
        import rtde_receive

        try:
            with real_time_threads(PRIORITY):
                return rtde_receive.RTDEReceiveInterface(
                    self._address, float(self._frequency), VARIABLES.split()
                )
        except RuntimeError as error:
            raise ConnectionError(f"no UR answers at {self._address}: {error}") from error

    def _upload(self) -> None:
        """Has the control program run on the robot."""
        import rtde_control

        try:
            if self._control is None:
                with real_time_threads(PRIORITY):
                    self._control = rtde_control.RTDEControlInterface(self._address, float(self._frequency))
            else:
                self._within(ANSWER, self._control.reuploadScript)
                until = time.monotonic() + ANSWER
                while not self._control.isProgramRunning() and time.monotonic() < until:
                    time.sleep(0.01)
                time.sleep(0.02)  # the program's first cycle
        except RuntimeError as error:
            raise RobotStopped(
                f"{self.description.name} did not take the control program: {error}"
            ) from error
        if not self._control.isProgramRunning():
            raise RobotStopped(
                f"{self.description.name} did not take the control program; is it in remote control?"
            )

    def _newest(self) -> RobotState:
        receive, before, again = self._receive, self._stamp, 3
        while True:  # getters lock one by one: all must be of one package
            stamp = receive.getTimestamp()
            q, v = receive.getActualQ(), receive.getActualQd()
            target = receive.getTargetQ(), receive.getTargetQd(), receive.getTargetQdd()
            self._status = Status(receive.getSafetyMode(), receive.getRobotMode(), receive.getRobotStatus())
            again -= 1
            if receive.getTimestamp() == stamp or not again:
                break
        lost = max(0, round((stamp - before) * self._frequency) - 1) if before >= 0.0 else 0
        self._stamp, self._target = stamp, (np.array(target[0]), np.array(target[1]))
        return RobotState(
            np.array(q),
            np.array(v),
            time=self._clock.measured(stamp, time.monotonic()),
            told_position=np.array(target[0]),
            told_velocity=np.array(target[1]),
            told_acceleration=np.array(target[2]),
            lost_cycles=lost,
        )

    def _flange_at(self, posture: list[float]) -> list[float]:
        """Where the robot says that its flange is at joint positions [rad], without a tool: pose (6,)."""
        pose: list[float] | None = self._within(
            ANSWER, self._control.getForwardKinematics, posture, [0.0] * 6
        )
        if not pose:
            self._listen()
            raise RobotStopped(f"{self.description.name} did not say where its flange is: {self._why()}")
        return pose

    def _servo_position(self, command: Command) -> Array:
        """What servoJ is sent: q_d = q + lookahead v + a / gain, with (q, v) where the command wants the target and
        a the acceleration by which the target comes there, at most `acceleration`."""
        period = self.description.period
        target, velocity = self._target[0] + period * self._target[1], self._target[1]
        wanted = command.position + self._lookahead * command.velocity + command.acceleration / self._gain
        held = target + self._lookahead * velocity  # keeps the target's velocity
        most = self._acceleration / self._gain
        return np.asarray(np.clip(held + np.clip(wanted - held, -most, most), self._lower, self._upper))

    def _listen(self) -> None:
        """Waits for a state that comes after this call."""
        self._stamp = self._receive.getTimestamp()
        if self.read(ANSWER) is None:
            raise ConnectionError(f"{self.description.name} at {self._address} sends no states")

    def _why(self) -> str:
        """Why the robot does not obey; "": it does."""
        if why := self._status.why_it_rests():
            return why
        if not self._status.is_running_a_program:
            return (
                "its program has ended: on the pendant, or by its watchdog after "
                f"{1e3 * self._watchdog:g} ms without a command"
            )
        return ""

    def _hears(self) -> bool:
        if self._control is None or not (self._receive.isConnected() and self._control.isConnected()):
            return False
        with suppress(ConnectionError, RobotStopped):
            self.read(2.0 * self.description.period)
        return time.monotonic() - self._heard < SILENCE and not self._why()

    def _within(self, seconds: float, call: Callable[..., Any], *arguments: Any) -> Any:
        return answer_within(seconds, f"{self.description.name} at {self._address}", call, *arguments)


def _chosen(arm: Arm | str | None, box: ur_dashboard.Box) -> Arm:
    """The arm that was given, or the one that comes with Sidestep for this box."""
    if arm is None:
        if box.model not in SHIPPED:
            raise ValueError(f"no arm comes with Sidestep for a {box.model!r} ({box.software}); give `arm`")
        arm = SHIPPED[box.model]
    chosen = Arm.load(arm) if isinstance(arm, str) else arm
    if tuple(chosen.robot.coordinate_names) != JOINTS:
        raise ValueError(
            f"the joints of the arm are {', '.join(chosen.robot.coordinate_names)}; those of a UR {', '.join(JOINTS)}"
        )
    return chosen
