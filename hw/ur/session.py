"""What the client process does with the controller, one call after the other, never two at once.

Every motion of the script goes on for ever until it is stopped, a real-time command that is followed by another
one within a controller's cycle may never be executed, and calls say by False that they were not: all three are
taken care of here.
"""

import threading
from collections.abc import Callable
from time import monotonic, sleep

from palpate.hw.ur.exchange import MotionCommand, Order, UrState
from palpate.hw.ur.latest import Latest
from palpate.hw.ur.library import ControlClient, Library, Slider
from palpate.hw.ur.pendant import Pendant
from palpate.hw.ur.problems import PLAYING, WORDS, Problem, UrRefusal, refusal
from palpate.hw.ur.requests import Opening
from palpate.hw.ur.version import cycle_rate, has_freedrive

_FRAME_AS_GIVEN = 2
"""Type of force_mode: the task frame is not transformed (maker's script manual)."""

_SETTLE_LIMIT = 0.05
"""[s] to wait at most for a controller's next cycles: then it is silent, which is found elsewhere."""

_REASON_WITHIN = 0.02
"""[s] after which a reason for a refusal has arrived: the library may have seen it before the receiving side."""

_PROGRAM_WITHIN = 5.0
"""[s] for the script to start, as the library has it."""


class RefusedError(RuntimeError):
    """The library returned False: the controller does not execute a command, for a reason yet to be found."""


class Session:
    """Connections of one client process.

    Attributes:
        lock: Held by whoever commands the controller.
    """

    def __init__(self, opening: Opening, library: Library, newest: Callable[[], UrState | None]) -> None:
        """Begin, without a connection.

        Args:
            opening: The process's settings.
            library: Makes the connections.
            newest: Returns the newest state.
        """
        self.lock = threading.Lock()
        self._opening, self._library, self._newest = opening, library, newest
        self._latest = Latest(newest)
        self._pendant = Pendant(opening, library, self._latest)
        self._cycle = 1.0 / cycle_rate(opening.version)
        self._controls: ControlClient | None = None
        self._slider: Slider | None = None
        self._motion = MotionCommand.NONE
        self._free = False
        self._last_write = 0.0  # by the controller's clock [s]

    @property
    def motion(self) -> MotionCommand:
        """What goes on in the script."""
        return self._motion

    @property
    def connected(self) -> bool:
        """Whether commands have a connection, as far as the library knows."""
        return self._controls is None or self._controls.isConnected()

    def must_rest_before(self, motion: MotionCommand) -> bool:
        """Whether something goes on that has to end before that motion begins."""
        return self._free or self._motion not in (MotionCommand.NONE, motion)

    # Called from the loop, with the lock; they do not block.

    def follow(self, command: Order) -> None:
        """Send a command of the kind that already goes on, or from standing still."""
        controls, opening, values = self._commanded(), self._opening, command.values
        if command.motion is MotionCommand.VELOCITY:
            # for one cycle: longer, or 0, and speedl would reach its target before it takes the next
            done = controls.speedL([*values[:6]], opening.acceleration, self._cycle)
        elif command.motion is MotionCommand.JOINTS:
            done = controls.servoJ([*values[:6]], 0.0, 0.0, self._cycle, opening.lookahead, opening.gain)
        elif command.motion is MotionCommand.POSE:
            done = controls.servoL([*values[:6]], 0.0, 0.0, self._cycle, opening.lookahead, opening.gain)
        elif command.motion is MotionCommand.FORCE:
            selection = [int(v) for v in values[6:12]]
            done = controls.forceMode(
                [*values[:6]], selection, [*values[12:18]], _FRAME_AS_GIVEN, [*values[18:24]]
            )
        else:
            done = controls.kickWatchdog()
        if command.motion is not MotionCommand.NONE:
            self._motion = command.motion
        self._written()
        self._accepted(command.motion.name.lower(), done)

    def kick(self) -> None:
        """Tell the controller's watchdog that somebody is there."""
        if self._controls is not None:
            self._accepted("kickWatchdog", self._controls.kickWatchdog())

    # Called from the worker, with the lock; they may take their time.

    def rest(self) -> None:
        """End whatever moves the arm, and let it come to rest."""
        controls, opening = self._controls, self._opening
        if controls is None:
            return
        motion, self._motion = self._motion, MotionCommand.NONE
        if motion is not MotionCommand.NONE:
            self._settle()
        if motion is MotionCommand.VELOCITY:
            self._accepted("speedStop", controls.speedStop(opening.deceleration))
        elif motion in (MotionCommand.JOINTS, MotionCommand.POSE):
            self._accepted("servoStop", controls.servoStop(opening.deceleration))
        elif motion is MotionCommand.FORCE:
            self._accepted("forceModeStop", controls.forceModeStop())
        if self._free:
            self._free = False
            self._accepted("endFreedriveMode", controls.endFreedriveMode())
        if motion is not MotionCommand.NONE:
            self._ready()

    def bring_up(self) -> None:
        """Load the script and set it up, the watchdog first: nothing may move without it.

        Raises:
            Refusal: The controller is not fit to run, or refuses.
        """
        self._latest.refuse_unsafe()
        self._pendant.require_remote_control()
        opening = self._opening
        if self._slider is None:
            self._slider = self._library.slider(self._opening.address)
        self._motion, self._free = MotionCommand.NONE, False
        if self._controls is None:
            self._controls = self._library.controls(self._opening.address, cycle_rate(self._opening.version))
        else:
            self._accepted("reuploadScript", self._controls.reuploadScript())
        self._latest.wait_for(lambda s: s.runtime_state == PLAYING, _PROGRAM_WITHIN, Problem.PROGRAM_STOPPED)
        self._watch()
        self.set_tool(*opening.tool)
        if opening.payload:
            self.set_payload(*opening.payload)
        if opening.speed_slider is not None:
            self.set_slider(opening.speed_slider)

    def _watch(self) -> None:
        """Set the watchdog: the first call that a new script must execute.

        Again and again, since the library may take a program that was still going, of a client that has died, for
        its own, which begins a moment later.
        """
        controls, deadline = self._commanded(), monotonic() + _PROGRAM_WITHIN
        while not controls.setWatchdog(1.0 / self._opening.watchdog):
            if monotonic() > deadline:
                raise RefusedError("setWatchdog")
            self._latest.refuse_unsafe()
            sleep(10.0 * self._cycle)

    def recover(self) -> None:
        """Undo what can be undone from here: protective stop, power, brakes; then bring it up again.

        Raises:
            Refusal: It cannot: the message says who can.
        """
        sleep(_REASON_WITHIN)  # what was put right just now has been heard of by then
        if self._latest.problem() is Problem.PROTECTIVE_STOP:
            self._pendant.unlock()
        if self._latest.problem() is Problem.NOT_POWERED:
            self._pendant.power_on()
        self.bring_up()

    def tare(self) -> None:
        """Take the present load for zero, at rest."""
        self.rest()
        self._call("zeroFtSensor", lambda controls: controls.zeroFtSensor())

    def set_payload(self, mass: float, x: float, y: float, z: float) -> None:
        """Say what the flange carries [kg, m]."""
        self.rest()
        self._call("setPayload", lambda controls: controls.setPayload(mass, [x, y, z]))

    def set_tool(self, *pose: float) -> None:
        """Say where the tip frame is on the flange: position [m] and rotation vector [rad]."""
        self.rest()
        self._call("setTcp", lambda controls: controls.setTcp([*pose]))

    def set_slider(self, fraction: float) -> None:
        """Set the speed slider."""
        if self._slider is None:
            raise UrRefusal("not brought up", "call start() first")
        self._accepted("setSpeedSlider", self._slider.setSpeedSlider(fraction))

    def free(self) -> None:
        """Let the arm be led by hand."""
        if not has_freedrive(self._opening.version):
            raise UrRefusal("this version has no freedrive for programs", "use the button on the pendant")
        self.rest()
        self._free = True  # before it is: better ended once too often
        self._call("freedriveMode", lambda controls: controls.freedriveMode())

    def leave(self) -> None:
        """Stop the arm and the script."""
        if self._controls is None:
            return
        try:
            self.rest()
            self._settle()
        finally:
            self._controls.stopScript()

    def _call(self, name: str, call: Callable[[ControlClient], bool]) -> None:
        self._settle()
        self._accepted(name, call(self._commanded()))
        self._ready()

    def _commanded(self) -> ControlClient:
        if self._controls is None:
            raise UrRefusal("not brought up", "call start() first")
        return self._controls

    def _accepted(self, name: str, done: bool) -> None:
        if not done:
            raise RefusedError(name)

    def reason(self, refused: RefusedError) -> UrRefusal:
        """Return why a call was refused, from the states of the next cycles."""
        sleep(_REASON_WITHIN)
        found = self._latest.problem()
        if found is Problem.NONE and self._latest.state().runtime_state != PLAYING:
            found = Problem.PROGRAM_STOPPED
        if found is not Problem.NONE:
            return refusal(found)
        problem, remedy = WORDS[Problem.REFUSED]
        return UrRefusal(f"{problem} ({refused})", remedy)

    def _written(self) -> None:
        state = self._newest()
        if state is not None:
            self._last_write = state.controller_time

    def _ready(self) -> None:
        """Wait until the script is ready again: the next command would wait for it in a busy loop."""
        self._written()
        self._settle()

    def _settle(self) -> None:
        """Leave a real-time command the cycles that it needs to be read and executed."""
        deadline = monotonic() + _SETTLE_LIMIT
        while monotonic() < deadline:
            state = self._newest()
            # the newest state may be a cycle old, the command took up to one to be read, and one to be executed
            if state is not None and state.controller_time - self._last_write > 3.5 * self._cycle:
                return
            sleep(0.25 * self._cycle)
