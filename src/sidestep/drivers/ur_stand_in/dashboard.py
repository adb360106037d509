"""What the dashboard answers, line by line."""

from __future__ import annotations

from sidestep.drivers.ur_stand_in.box import IDLE, POWER_OFF, RUNNING, Box

GREETING = "Connected: Universal Robots Dashboard Server"


class Dashboard:
    """Turns the lines of a client into answers.

    Attributes:
        model: as the box names it, for example "UR10". version: of its software, for example "5.12.0.1101319".
    """

    def __init__(self, box: Box, *, model: str, version: str) -> None:
        """For one box."""
        self.model, self.version, self._box = model, version, box

    def answer(self, line: str) -> str:
        """The answer to a line, both without the end of the line."""
        box, words = self._box, line.strip()
        name = words.lower()
        told = {
            "polyscopeversion": f"URSoftware {self.version} (stand-in)",
            "version": self.version,
            "get robot model": self.model,
            "get serial number": "20260000001",
            "is in remote control": "true",
            "running": f"Program running: {str(box.playing).lower()}",
            "programstate": f"{'PLAYING rtde_control' if box.playing else 'STOPPED'}",
            "robotmode": f"Robotmode: {box.mode_words}",
            "safetymode": f"Safetymode: {box.safety_words}",
            "safetystatus": f"Safetystatus: {box.safety_words}",
            "close popup": "closing popup",
            "close safety popup": "closing safety popup",
            "quit": "Disconnected",
        }
        if name in told:
            return told[name]
        if name == "stop":
            box.stop_program()
            return "Stopped"
        if name == "unlock protective stop":
            return box.unlock()
        if name == "power on" and box.mode == POWER_OFF:
            box.mode = IDLE
        if name == "brake release" and box.mode == IDLE:
            box.mode = RUNNING
        if name in ("power on", "brake release"):
            return "Powering on" if name == "power on" else "Brake releasing"
        return f"could not understand: '{words}'"
