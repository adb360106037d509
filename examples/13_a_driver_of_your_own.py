"""A driver of your own: a robot that speaks JSON over UDP, here a stand-in in a thread. Positions at 250 Hz."""

import contextlib
import json
import socket
import threading
import time

import numpy as np

import sidestep as ss

PERIOD, PATIENCE = 0.004, 10.0  # [s]; before the first command the program may take its time


class JsonRobot:
    """Reads q and v from a robot, and sends it positions."""

    def __init__(self, address, arm):
        joints, limits = arm.robot.coordinate_names, arm.limits
        self.description = ss.drivers.RobotDescription(
            "JSON robot", period=PERIOD, outputs=["position"], joints=joints, limits=limits
        )
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.connect(address)
        self._send(hello=True)

    def start(self, output):
        """The robot takes commands from now on."""

    def read(self, timeout):
        """Waits for the robot's next state, which is the clock; the newest, where several have come meanwhile."""
        state = None
        with contextlib.suppress(TimeoutError, BlockingIOError):  # the latter where it is not to wait
            while True:
                self._socket.settimeout(0.0 if state else timeout)
                state = json.loads(self._socket.recv(4096))
        if state is None:
            return None
        if state["fault"]:
            raise ss.drivers.RobotStopped(state["fault"])
        return ss.drivers.RobotState(state["q"], state["v"], time=time.monotonic())

    def write(self, command):
        self._send(position=command.position.tolist())

    def stop(self):
        """The robot holds its last position by itself."""

    def _send(self, **message):
        self._socket.send(json.dumps(message).encode())


def stand_in(server, q, period):
    """A robot that is where it was told to be, and says so once a period, until nobody speaks for long."""
    server.settimeout(PATIENCE)
    client = server.recvfrom(4096)[1]
    v, told = 0.0 * q, time.monotonic()
    server.settimeout(period / 4)
    while time.monotonic() - told < PATIENCE:
        due, state = time.monotonic() + period, {"q": q.tolist(), "v": v.tolist(), "fault": ""}
        server.sendto(json.dumps(state).encode(), client)
        while time.monotonic() < due:
            with contextlib.suppress(TimeoutError):
                position = np.array(json.loads(server.recv(4096))["position"])
                v, q, told = (position - q) / period, position, time.monotonic()


arm = ss.Arm.load("fr3")
start = np.array([0.7, -0.785, 0.0, -2.356, 0.0, 1.571, 0.785])
server = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
server.bind(("127.0.0.1", 0))
threading.Thread(target=stand_in, args=(server, start, PERIOD), daemon=True).start()
controller = ss.Controller(arm, ss.ControllerSettings(output="position", period=PERIOD))
controller.set_obstacles(ss.Box((0.2, 0.1, 0.5), pose=ss.obstacles.pose_at([0.5, 0.0, 0.25])))
controller.set_goal(start * np.array([-1, 1, 1, 1, 1, 1, 1]))
report = ss.run(controller, JsonRobot(server.getsockname(), arm))
print(report.end.name, report.why)
