"""Conversation of the client process with the controller: one call after the other, never two at once.

Every motion of the script goes on until it is stopped, a real-time command that is followed by another one within
a controller's cycle may never be executed, and calls report by False that they were not executed: all three are
handled here. Unlocking, power and brakes go over the dashboard server, as a person at the pendant would do it.
"""

import threading
from collections.abc import Callable
from time import monotonic, sleep

from palpate.hw.ur.exchange import Opening, Order, UrState
from palpate.hw.ur.library import ControlClient, Library, PendantClient, Slider
from palpate.hw.ur.problems import IDLE, PLAYING, RUNNING, WORDS, Problem, UrRefusal, refusal, safety_problem
from palpate.hw.ur.rtde import DASHBOARD_BELOW, cycle_rate

_SETTLE_LIMIT = 0.05
"""[s] to wait at most for a controller's next cycles: then it is silent, which is found elsewhere."""

_REASON_WITHIN = 0.02
"""[s] after which the reason for a refusal has arrived: the library may see it before the receiving side."""

_PROGRAM_WITHIN = 5.0
"""[s] for the script to start; the library's own limit."""

_UNLOCK_WITHIN = 8.0
"""[s] in which a protective stop must be unlocked: a controller refuses during the first 5 s."""

_UNLOCK_EVERY = 0.5
"""[s] between tries to unlock."""

_POWER_WITHIN = 30.0
"""[s] for powering and for releasing brakes, joint after joint."""

_LOOK_EVERY = 2e-3
"""[s] between looks at the newest state: a cycle."""


class RefusedError(RuntimeError):
    """The library returned False: the controller does not execute a command, for a reason yet to be found."""


class Session:
    """Connections of one client process.

    Attributes:
        lock: Held while the controller is commanded.
        moves: Whether a velocity goes on in the script.
    """

    def __init__(self, opening: Opening, library: Library, newest: Callable[[], UrState | None]) -> None:
        """Begin without a connection.

        Args:
            opening: Settings of the process.
            library: Module that makes the connections.
            newest: Returns the newest state.
        """
        self.lock = threading.Lock()
        self.moves = False
        self._opening, self._library, self._newest = opening, library, newest
        self._cycle = 1.0 / cycle_rate(opening.version)
        self._controls: ControlClient | None = None
        self._slider: Slider | None = None
        self._last_write = 0.0  # by the controller's clock [s]

    @property
    def connected(self) -> bool:
        """Whether commands have a connection, as far as the library reports."""
        return self._controls is None or self._controls.isConnected()

    # Called from the loop, with the lock; they do not block.

    def follow(self, order: Order) -> None:
        """Send a velocity, or keep the arm at rest."""
        controls = self._commanded()
        if order.moves:
            # for one cycle: longer, or 0, and speedl would reach its target before it takes the next
            done = controls.speedL([*order.twist], self._opening.acceleration, self._cycle)
            self.moves = True
        else:
            done = controls.kickWatchdog()
        self._written()
        self._accepted("velocity" if order.moves else "none", done)

    def kick(self) -> None:
        """Feed the controller's watchdog."""
        if self._controls is not None:
            self._accepted("kickWatchdog", self._controls.kickWatchdog())

    # Called from the worker, with the lock; they may take their time.

    def rest(self) -> None:
        """End a velocity, and let the arm come to rest."""
        moved, self.moves = self.moves, False
        if moved and self._controls is not None:
            self._settle()
            self._accepted("speedStop", self._controls.speedStop(self._opening.deceleration))
            self._ready()

    def bring_up(self) -> None:
        """Load the script and set it up, the watchdog first: nothing may move without it.

        Raises:
            UrRefusal: If the controller is not fit to run, or refuses.
        """
        opening, problem = self._opening, self._problem()
        if problem is not Problem.NONE:
            raise refusal(problem)
        if opening.version[0] == 5:  # CB3 has no such mode, later ones no dashboard: the library checks there
            self._require_remote_control()
        if self._slider is None:
            self._slider = self._library.slider(opening.address)
        self.moves = False
        if self._controls is None:
            self._controls = self._library.controls(opening.address, cycle_rate(opening.version))
        else:
            self._accepted("reuploadScript", self._controls.reuploadScript())
        self._wait_for(lambda s: s.runtime_state == PLAYING, _PROGRAM_WITHIN, Problem.PROGRAM_STOPPED)
        self._watch()
        self._call("setTcp", lambda controls: controls.setTcp([*opening.tool]))
        if opening.payload:
            mass, *center = opening.payload
            self._call("setPayload", lambda controls: controls.setPayload(mass, center))
        if opening.speed_slider is not None:
            self._accepted("setSpeedSlider", self._slider.setSpeedSlider(opening.speed_slider))

    def recover(self) -> None:
        """Undo protective stop, power-off and brakes as far as possible; then bring the arm up again.

        Raises:
            UrRefusal: If that is not possible; the message gives the remedy.
        """
        sleep(_REASON_WITHIN)  # a repair made just now has arrived by then
        if self._problem() is Problem.PROTECTIVE_STOP:
            self._unlock()
        if self._problem() is Problem.NOT_POWERED:
            self._power_on()
        self.bring_up()

    def tare(self) -> None:
        """Take the present load for zero, at rest."""
        self.rest()
        self._call("zeroFtSensor", lambda controls: controls.zeroFtSensor())

    def leave(self) -> None:
        """Stop the arm and the script."""
        if self._controls is None:
            return
        try:
            self.rest()
            self._settle()
        finally:
            self._controls.stopScript()

    def reason(self, refused: RefusedError) -> UrRefusal:
        """Return why a call was refused, from the states of the next cycles."""
        sleep(_REASON_WITHIN)
        found = self._problem()
        if found is Problem.NONE and self._state().runtime_state != PLAYING:
            found = Problem.PROGRAM_STOPPED
        if found is not Problem.NONE:
            return refusal(found)
        problem, remedy = WORDS[Problem.REFUSED]
        return UrRefusal(f"{problem} ({refused})", remedy)

    # Calls of the control script

    def _watch(self) -> None:
        """Set the watchdog: the first call that a new script must execute.

        The call is repeated, since the library may take a program that still runs, of a client that has died, for
        its own, which begins a moment later.
        """
        controls, deadline = self._commanded(), monotonic() + _PROGRAM_WITHIN
        while not controls.setWatchdog(1.0 / self._opening.watchdog):
            if monotonic() > deadline:
                raise RefusedError("setWatchdog")
            problem = self._problem()
            if problem is not Problem.NONE:
                raise refusal(problem)
            sleep(10.0 * self._cycle)

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

    # States

    def _state(self) -> UrState:
        state = self._newest()
        if state is None:
            raise refusal(Problem.SILENT)
        return state

    def _problem(self) -> Problem:
        state = self._state()
        return safety_problem(state.robot_mode, state.safety_bits)

    def _wait_for(self, met: Callable[[UrState], bool], within: float, otherwise: Problem) -> None:
        """Wait until a state meets a condition.

        Raises:
            UrRefusal: If it does not within `within` [s]: in the words of the problem `otherwise`.
        """
        deadline = monotonic() + within
        while not met(self._state()):
            if monotonic() > deadline:
                raise refusal(otherwise)
            sleep(_LOOK_EVERY)

    # The pendant

    def _dashboard(self) -> PendantClient:
        """Connect to the dashboard server, which ends idle connections: one for each use."""
        if self._opening.version[0] >= DASHBOARD_BELOW:
            raise UrRefusal("this version has no dashboard server", "do it at the pendant, then `palpate recover`")
        client = self._library.dashboard(self._opening.address)
        client.connect()
        return client

    def _require_remote_control(self) -> None:
        client = self._dashboard()
        remote = client.isInRemoteControl()
        client.disconnect()
        if not remote:
            raise UrRefusal(
                "it is in local control",
                "choose Remote Control at the top right of the pendant (enable it in Settings, System)",
            )

    def _unlock(self) -> None:
        """Unlock a protective stop, as soon as the controller allows it.

        Raises:
            UrRefusal: If the controller never does.
        """
        client = self._dashboard()
        deadline = monotonic() + _UNLOCK_WITHIN
        while True:
            try:
                client.closeSafetyPopup()
                client.unlockProtectiveStop()
                break
            except (RuntimeError, OSError) as error:
                if monotonic() > deadline:
                    raise UrRefusal(
                        f"the protective stop cannot be unlocked ({error})",
                        "unlock it at the pendant, then `palpate recover`",
                    ) from error
                sleep(_UNLOCK_EVERY)
        client.disconnect()
        self._wait_for(
            lambda s: safety_problem(s.robot_mode, s.safety_bits) is not Problem.PROTECTIVE_STOP,
            _UNLOCK_WITHIN,
            Problem.PROTECTIVE_STOP,
        )

    def _power_on(self) -> None:
        """Power the arm, and release its brakes.

        Raises:
            UrRefusal: If it is not powered in time.
        """
        client = self._dashboard()
        client.powerOn()
        self._wait_for(lambda s: s.robot_mode in (IDLE, RUNNING), _POWER_WITHIN, Problem.NOT_POWERED)
        client.brakeRelease()
        client.disconnect()
        self._wait_for(lambda s: s.robot_mode == RUNNING, _POWER_WITHIN, Problem.NOT_POWERED)
