"""RTDE, protocol version 2, as the box speaks it: one client's recipes and packages."""

from __future__ import annotations

import struct

from sidestep.drivers.ur_stand_in.box import Box

HEADER = struct.Struct(">HB")  # size with header, type
LARGEST = 4096  # [bytes] of a package
VERSION, CONTROLLER, OUTPUTS, INPUTS, START, PAUSE, DATA = (ord(kind) for kind in "VvOISPU")
FORMATS = {
    "DOUBLE": "d",
    "VECTOR6D": "6d",
    "VECTOR3D": "3d",
    "INT32": "i",
    "UINT32": "I",
    "UINT64": "Q",
    "VECTOR6INT32": "6i",
    "UINT8": "B",
    "BOOL": "?",
}
DOUBLES = (
    "timestamp actual_execution_time speed_scaling target_speed_fraction actual_momentum actual_main_voltage "
    "actual_robot_voltage actual_robot_current payload standard_analog_input0 standard_analog_input1 "
    "standard_analog_output0 standard_analog_output1 speed_slider_fraction standard_analog_output_0 "
    "standard_analog_output_1"
)
VECTORS = (
    "target_q target_qd target_qdd target_current target_moment actual_q actual_qd actual_current "
    "joint_control_output actual_TCP_pose actual_TCP_speed actual_TCP_force target_TCP_pose target_TCP_speed "
    "joint_temperatures actual_joint_voltage payload_inertia ft_raw_wrench tcp_offset external_force_torque"
)
TYPES = {
    **dict.fromkeys(DOUBLES.split(), "DOUBLE"),
    **dict.fromkeys(VECTORS.split(), "VECTOR6D"),
    **dict.fromkeys(("actual_tool_accelerometer", "payload_cog"), "VECTOR3D"),
    **dict.fromkeys(("robot_mode", "safety_mode", "safety_status"), "INT32"),
    **dict.fromkeys(
        ("runtime_state", "robot_status_bits", "safety_status_bits", "speed_slider_mask"), "UINT32"
    ),
    **dict.fromkeys(("actual_digital_input_bits", "actual_digital_output_bits"), "UINT64"),
    "joint_mode": "VECTOR6INT32",
}


class RtdeClient:
    """What one client has set up: which values it is sent, and what its packages mean."""

    def __init__(self, box: Box, controller: tuple[int, int, int, int]) -> None:
        """Connected, nothing set up.

        Args:
            box: the robot. controller: version of its software: major, minor, bugfix, build.
        """
        self._box, self._controller = box, controller
        self._received = bytearray()
        self._inputs: list[list[str]] = []
        self._outputs: dict[str, int] = {}  # how many numbers each has
        self._layout = struct.Struct(">B")
        self._every, self._count, self._started = 1, 0, False

    def receive(self, data: bytes) -> bytes:
        """Takes what came; returns what is answered.

        Raises:
            ValueError: it is not RTDE.
        """
        self._received += data
        answers = bytearray()
        while len(self._received) >= HEADER.size:
            size, kind = HEADER.unpack_from(self._received)
            if not HEADER.size <= size <= LARGEST:
                raise ValueError(f"a package of {size} bytes, allowed are {HEADER.size} to {LARGEST}")
            if len(self._received) < size:
                break
            payload = bytes(self._received[HEADER.size : size])
            del self._received[:size]
            if kind == DATA:
                self._take(payload)
            else:
                answers += _package(kind, self._answer(kind, payload))
        return bytes(answers)

    def package(self) -> bytes:
        """What is sent in this period: a package of outputs, or nothing."""
        if not self._started:
            return b""
        self._count += 1
        if self._count % self._every:
            return b""
        values: list[float] = []
        for name, size in self._outputs.items():
            value = self._box.value(name)
            values.extend((value,) * size if isinstance(value, (int, float)) else value)
        return _package(DATA, self._layout.pack(1, *values))

    def _answer(self, kind: int, payload: bytes) -> bytes:
        if kind == VERSION:
            return struct.pack(">B", payload == struct.pack(">H", 2))
        if kind == CONTROLLER:
            return struct.pack(">4I", *self._controller)
        if kind == OUTPUTS:
            (frequency,) = struct.unpack_from(">d", payload)
            formats = {name: FORMATS[_type(name)] for name in _names(payload[8:])}
            self._outputs = {name: int(format[:-1] or 1) for name, format in formats.items()}
            self._layout = struct.Struct(">B" + "".join(formats.values()))
            self._every = max(1, round(1.0 / (frequency * self._box.period)))
            return b"\x01" + ",".join(map(_type, self._outputs)).encode()
        if kind == INPUTS:
            self._inputs.append(_names(payload))
            return bytes([len(self._inputs)]) + ",".join(map(_type, self._inputs[-1])).encode()
        if kind in (START, PAUSE):
            self._started = kind == START
            return b"\x01"
        raise ValueError(f"a package of type {kind}, which RTDE does not have")

    def _take(self, payload: bytes) -> None:
        recipe = payload[0] if payload else 0
        if not 1 <= recipe <= len(self._inputs):
            raise ValueError(f"inputs by recipe {recipe}, known are 1 to {len(self._inputs)}")
        names = self._inputs[recipe - 1]
        values = struct.unpack_from(">" + "".join(FORMATS[_type(name)] for name in names), payload, 1)
        registers = self._box.registers
        registers.values.update(
            (name, value) for name, value in zip(names, values, strict=True) if name in registers.values
        )
        registers.written = self._box.time


def _names(payload: bytes) -> list[str]:
    return [name for name in payload.decode("ascii").split(",") if name]


def _type(name: str) -> str:
    if "_register_" in name:
        return "INT32" if "_int_" in name else "DOUBLE"
    return _checked(name)


def _checked(name: str) -> str:
    if name not in TYPES:
        raise ValueError(f"{name!r} is no variable of the stand-in; it has: {', '.join(TYPES)}")
    return TYPES[name]


def _package(kind: int, payload: bytes) -> bytes:
    return HEADER.pack(HEADER.size + len(payload), kind) + payload
