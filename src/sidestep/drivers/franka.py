"""The Franka Research 3, by Franka's own library."""

from __future__ import annotations

import gc
import time
from types import TracebackType
from typing import Any, Literal, Self

import numpy as np

from sidestep._core import Command, JointLimits, StreamLimiter

from .core import RobotDescription, RobotState, RobotStopped

PERIOD = 0.001  # [s] of the robot's cycle
# What the robot enforces: Franka's "Robot and interface specifications" of the Research 3.
LIMITS = JointLimits(
    lower=[-2.7501, -1.7918, -2.9065, -3.0481, -2.8101, 0.54092, -3.0196],
    upper=[2.7501, 1.7918, 2.9065, -0.1458, 2.8101, 4.5205, 3.0196],
    velocity=[2.62, 2.62, 2.62, 2.62, 5.26, 4.18, 5.26],
    acceleration=[10.0] * 7,
    jerk=[5000.0] * 7,
    effort=[87.0, 87.0, 87.0, 87.0, 12.0, 12.0, 12.0],
    effort_rate=[1000.0] * 7,
)
# D [rad/s^2] and o [rad/s] of its velocity limits towards the ends of the joints, see StreamLimiter.
END_DECELERATION = (6.0, 2.585, 3.5, 4.0, 17.0, 5.5, 17.0)
END_OFFSET = (0.3, 0.2, 0.2, 0.3, 0.35, 0.35, 0.35)
# Share of the period after which an answer may come too late: the robot reads it before its next state leaves [-].
ANSWER_SHARE = 0.7
WAITED = 2e-5  # a read that took longer waited for its state [s]
STALE = 1.5  # periods after which a read that waited has slept on, while newer states came [-]
REST = 0.02  # joint speed below which a motion is finished, not stopped [rad/s]
# Differences of what the robot says it was told from what was sent, beyond rounding to single precision: of positions
# it makes 0.12 rad/s^2.
SAME_TORQUE, SAME_ACCELERATION = 1e-3, 0.15  # [Nm], [rad/s^2]
ROUNDING = 1e-6  # of a rate [-]

Output = Literal["torque", "velocity", "position"]


class Franka:
    """Drives a Franka Research 3 by `pylibfranka`: joint torques, velocities or positions, 1,000 a second.

    A command that does not reach the robot within its cycle is lost: the robot goes on by itself, at the acceleration
    or torque of before, and judges the next command against that. So each command goes on from what the robot says that
    it was told, within its limits (`StreamLimiter`); a command that would come late is not sent; and the first state
    after a gap is not answered, as a command may still be on its way to the robot. `lost_cycles` counts all.

    address: of the robot. enforce_real_time: refuse to run without a real-time kernel. library: instead of
    `pylibfranka`. `read` waits at most as long as Franka's library does, 1 s, whatever its `timeout`.

    Raises:
        MissingExtraError: `pylibfranka` is not installed.
        pylibfranka.FrankaException: there is no robot at the address, or it is in use.
    """

    def __init__(self, address: str, *, enforce_real_time: bool = True, library: Any = None) -> None:
        if library is None:
            import pylibfranka

            library = pylibfranka
        self._library = library
        config = library.RealtimeConfig
        self._robot = library.Robot(address, config.kEnforce if enforce_real_time else config.kIgnore)
        self._limiter = StreamLimiter(
            LIMITS, PERIOD, end_deceleration=END_DECELERATION, end_offset=END_OFFSET
        )
        self._control: Any = None
        self._output: Output = "torque"
        self._state: Any = None  # the last that was read
        self._sent: np.ndarray | None = None  # the answer to it; None: it was not answered
        self._arrived = 0.0  # when it came, on time.monotonic() [s]
        self.late = 0  # commands that were not sent because they would have come late

    @property
    def description(self) -> RobotDescription:
        """What a loop has to know of the robot."""
        return RobotDescription(
            "Franka Research 3",
            joints=tuple(f"fr3_joint{k}" for k in range(1, 8)),
            period=PERIOD,
            outputs=("torque", "velocity", "position"),
            limits=LIMITS,
            when_silent="goes on at its last acceleration or torque, and stops itself after 20 ms",
        )

    def start(self, output: Output) -> None:
        """Begins control, from where the robot says it is.

        Raises:
            RobotStopped: the robot is not ready, for example in a reflex, see `recover`.
            ValueError: it does not take this output.
        """
        if output not in ("torque", "velocity", "position"):
            raise ValueError(f"franka: output is {output!r}, allowed: 'torque', 'velocity' or 'position'")
        robot, impedance = self._robot, self._library.ControllerMode.JointImpedance
        state = self._call(robot.read_once)
        if state.robot_mode != self._library.RobotMode.Idle:
            raise RobotStopped(
                f"the robot cannot be moved: it is in mode {state.robot_mode.name}; recover() ends a reflex"
            )
        if output == "torque":
            self._control = self._call(robot.start_torque_control)
        elif output == "velocity":
            self._control = self._call(robot.start_joint_velocity_control, impedance)
        else:
            self._control = self._call(robot.start_joint_position_control, impedance)
        self._output, self._state, self._sent = output, None, None
        gc.freeze()  # else Python looks through all there is now and then, for longer than the robot waits
        self._limiter.begin(state.q_d, state.tau_J_d)

    def read(self, timeout: float = 1.0) -> RobotState:
        """The robot's next state. Waits for it; `timeout` is that of Franka's library.

        Raises:
            RobotStopped: the robot has stopped itself.
            pylibfranka.NetworkException: the connection is lost.
        """
        state, passed, fresh = self._receive()
        in_flight = self._sent is not None
        lost = 0 if self._state is None else passed - in_flight
        while self._control is not None and (
            not fresh or (in_flight and (passed > 1 or self._differs(state)))
        ):
            state, passed, fresh = self._receive()
            lost += passed
            in_flight = False
        self._state, self._sent = state, None
        told = self._control is not None and self._output != "torque"
        return RobotState(
            np.array(state.q),
            np.array(state.dq),
            time=self._arrived,
            torque=np.array(state.tau_J),
            told_position=np.array(state.q_d) if told and self._output == "position" else None,
            told_velocity=np.array(state.dq_d) if told else None,
            told_acceleration=np.array(state.ddq_d) if told else None,
            lost_cycles=max(0, lost),
        )

    def write(self, command: Command) -> None:
        """Answers the state that was read last; not at all where the answer would come late.

        Raises:
            RobotStopped: the robot has stopped itself, or is not controlled.
            pylibfranka.NetworkException: the connection is lost.
        """
        if self._control is None:
            raise RobotStopped("the robot is not controlled: start() begins")
        if time.monotonic() - self._arrived > ANSWER_SHARE * PERIOD:
            self.late += 1
            return
        self._sent = self._next(command)
        self._call(self._control.writeOnce, self._message(self._sent))

    def stop(self) -> None:
        """Ends control: the robot holds its position. Once it moves, the robot brakes by itself."""
        control, self._control = self._control, None
        gc.unfreeze()
        if control is None:
            return
        library = self._library
        try:
            state, _ = control.readOnce()
            if max(map(abs, state.dq)) < REST:
                held = {"torque": state.tau_J_d, "velocity": [0.0] * 7, "position": state.q_d}
                message = self._message(np.array(held[self._output]))
                message.motion_finished = True
                control.writeOnce(message)
            else:
                self._robot.stop()
        except (library.FrankaException, RuntimeError):
            pass  # it has stopped itself, or the connection is lost

    def recover(self) -> None:
        """Ends a reflex, so that `start` may be called again. The cause has to be gone."""
        self._call(self._robot.automatic_error_recovery)

    def close(self) -> None:
        """Ends control and the connection."""
        self.stop()
        self._robot = None

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def _next(self, command: Command) -> np.ndarray:
        """The message's content nearest to the command that the robot accepts."""
        state = self._state
        if self._output == "torque":
            return self._limiter.limit_torques(state.tau_J_d, command.torque_without_gravity)
        wanted = (command.position, command.velocity, command.acceleration)
        if self._output == "velocity":  # its sum of velocities is not where the arm is
            return self._limiter.limit_velocities((state.q, state.dq_d, state.ddq_d), wanted)
        return self._limiter.limit_positions((state.q_d, state.dq_d, state.ddq_d), wanted)

    def _message(self, values: np.ndarray) -> Any:
        kinds = {"torque": "Torques", "velocity": "JointVelocities", "position": "JointPositions"}
        return getattr(self._library, kinds[self._output])(values.tolist())

    def _differs(self, state: Any) -> bool:
        """Whether the answer to the last state was lost: the robot counts it, or goes on from something else."""
        before, rate = self._state, state.control_command_success_rate
        if rate >= 1.0 or self._sent is None:
            return False
        if rate < before.control_command_success_rate - ROUNDING:
            return True
        if self._output == "torque":
            return bool(np.abs(np.array(state.tau_J_d) - self._sent).max() > SAME_TORQUE)
        velocity = (
            (self._sent - before.q_d) / PERIOD if self._output == "position" else self._sent
        ) - before.dq_d
        return bool(np.abs(velocity / PERIOD - state.ddq_d).max() > SAME_ACCELERATION)

    def _receive(self) -> tuple[Any, int, bool]:
        """The newest state, cycles since the one before, and whether it has just come."""
        began = time.monotonic()
        if self._control is None:
            state, passed = self._call(self._robot.read_once), 0
        else:
            state, span = self._call(self._control.readOnce)
            passed = round(span.to_sec() / PERIOD)
        now = time.monotonic()
        waited = now - began
        self._arrived = now if waited > WAITED else min(now, self._arrived + passed * PERIOD)
        return state, passed, waited < STALE * PERIOD and (waited > WAITED or passed <= 1)

    def _call(self, function: Any, *arguments: Any) -> Any:
        library = self._library
        try:
            return function(*arguments)
        except (library.ControlException, library.CommandException) as error:
            self._control = None
            raise RobotStopped(str(error)) from error
