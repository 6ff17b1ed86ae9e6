"""The dashboard server's replies: one line for one line.

Source: Universal Robots, "Dashboard Server e-Series"; the wording is what ur_rtde 1.6.5 looks for.
"""

from collections.abc import Callable

from palpate.hw.emulators.connection import HangUpError, LineTalk
from palpate.hw.emulators.ur.commands import loaded_program
from palpate.hw.emulators.ur.controller import EmulatedController, RobotMode, RuntimeState, SafetyMode

GREETING = "Connected: Universal Robots Dashboard Server"


class DashboardServer:
    """Buttons of the screen, as text.

    Attributes:
        remote: Whether the robot is in remote control.
    """

    def __init__(self, robot: EmulatedController) -> None:
        """Serve a controller."""
        self._robot = robot
        self.remote = True
        self._loaded = ""
        self._exact: dict[str, Callable[[], str]] = {
            "PolyscopeVersion": lambda: f"URSoftware {robot.version} (Jan 01 2023)",
            "get serial number": lambda: "20235500001",
            "is in remote control": lambda: str(self.remote).lower(),
            "stop": self._stop,
            "play": self._play,
            "pause": lambda: "Pausing program" if robot.pause() else "Failed to execute: pause",
            "unlock protective stop": self._unlock,
            "running": lambda: f"Program running: {str(robot.runtime is RuntimeState.PLAYING).lower()}",
            "isProgramSaved": lambda: f"True {self._loaded}".rstrip(),
            "robotmode": lambda: f"Robotmode: {robot.mode.name}",
            "safetymode": lambda: f"Safetymode: {robot.safety.name}",
            "safetystatus": lambda: f"Safetystatus: {robot.safety.name}",
            "programState": lambda: f"{robot.runtime.name} {self._loaded}".rstrip(),
            "get robot model": lambda: "UR5",
            "get loaded program": lambda: (
                f"Loaded program: {self._loaded}" if self._loaded else "No program loaded"
            ),
            "close popup": lambda: "closing popup",
            "close safety popup": lambda: "closing safety popup",
            "power on": lambda: self._power(RobotMode.IDLE, "Powering on"),
            "power off": lambda: self._power(RobotMode.POWER_OFF, "Powering off"),
            "brake release": lambda: self._power(RobotMode.RUNNING, "Brake releasing"),
            "restart safety": self._restart_safety,
            "shutdown": lambda: "Shutting down",
            "quit": lambda: "Disconnected",
        }

    def reply(self, line: str) -> str:
        """Return the reply to a line."""
        self._robot.note("dashboard", line=line)
        exact = self._exact.get(line)
        if exact is not None:
            return exact()
        if line.startswith("load "):
            self._loaded = line.removeprefix("load ").strip()
            return f"Loading program: {self._loaded}"
        if line.startswith("popup"):
            return "showing popup"
        if line.startswith("addToLog"):
            return "Added log message"
        if line.startswith("set user role"):
            return f"Setting user role: {line.removeprefix('set user role').strip()}"
        return f"could not understand: '{line}'"

    def _stop(self) -> str:
        self._robot.end_program("dashboard")
        return "Stopped"

    def _play(self) -> str:
        # a program that came over the script port is gone once it has ended, and cannot be resumed either
        if self._loaded and self._robot.start_program(loaded_program(), self._loaded):
            return "Starting program"
        return "Failed to execute: play"

    def _unlock(self) -> str:
        if self._robot.unlock():
            return "Protective stop releasing"
        return (
            "Cannot unlock protective stop until 5s after occurrence. Always inspect cause of protective stop "
            "before unlocking"
        )

    def _power(self, mode: RobotMode, reply: str) -> str:
        self._robot.switch(mode)
        return reply

    def _restart_safety(self) -> str:
        if self._robot.safety is SafetyMode.ROBOT_EMERGENCY_STOP:
            return "Failed to execute: restart safety"
        self._robot.switch(RobotMode.POWER_OFF)
        return "Restarting safety"


class DashboardTalk(LineTalk):
    """Client of the dashboard server."""

    LONGEST = 4096

    def __init__(self, server: DashboardServer) -> None:
        """Begin a conversation."""
        super().__init__()
        self._server = server

    def reply(self, line: bytes) -> bytes:
        """See `LineTalk`."""
        text = line.decode(errors="replace").strip()
        reply = f"{self._server.reply(text)}\n".encode()
        if text == "quit":
            raise HangUpError("quit", reply)
        return reply
