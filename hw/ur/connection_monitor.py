"""The client process's loop: it hands states on, sends commands, and sees what goes wrong.

Several times per cycle of the controller; nothing in it waits for the controller. What does is the worker's.
"""

import math
import os
from collections.abc import Callable
from time import monotonic, sleep

from palpate.hw.ur.exchange import ClientPhase, Exchange, MotionCommand, Order, Status, UrState
from palpate.hw.ur.problems import FATAL, PLAYING, Problem, safety_problem
from palpate.hw.ur.requests import Opening
from palpate.hw.ur.session import RefusedError, Session
from palpate.hw.ur.state_receiver import ControllerRestartedError, ImpossibleStateError, StateReceiver

_KEEP_ALIVE = 0.2
"""Fraction of the watchdog's time after which it is fed, if no command did."""

_GIVE_UP = 1.0
"""[s] of silence, or after a lost connection, until the process ends: the library would begin to reconnect after
2.5 s without a state, and crash over it."""

_GIVEN_UP_FOR = {ControllerRestartedError: Problem.RESTARTED, ImpossibleStateError: Problem.RUBBISH}

_LONGEST_ROUND = 2e-3
"""[s] that a round counts for at most."""

_REASON_WITHIN = 0.01
"""[s] to wait, after a refused command, for the state that says why."""


class ConnectionMonitor:
    """One round after the other.

    Attributes:
        phase: How far the process is; set by the worker.
        state: The newest.
    """

    def __init__(
        self,
        exchange: Exchange,
        opening: Opening,
        state_receiver: StateReceiver,
        rest: Callable[[], None],
        log: int,
    ) -> None:
        """Begin.

        Args:
            exchange: With the arm.
            opening: The process's settings.
            state_receiver: Of states.
            rest: Asks the worker to bring the arm to rest.
            log: Descriptor of the file in memory to which the library prints; the loop reads it.
        """
        self.phase = ClientPhase.LISTENING
        self.state: UrState | None = None
        self._exchange, self._opening, self._reception = exchange, opening, state_receiver
        self._rest, self._log, self._log_size = rest, log, 0
        self._problem, self._problem_since = Problem.NONE, 0.0
        self._refused_since: float | None = None
        self._followed, self._lapses = 0, 0
        self._sent, self._rounds = 0.0, 0
        self._wanted = self._resting = False
        self._silence, self._last_round = 0.0, monotonic()

    def newest(self) -> UrState | None:
        """Return the newest state."""
        return self.state

    def pause(self, phase: ClientPhase) -> None:
        """Follow no commands; the worker is about to bring the arm up, or to leave it."""
        self.phase = phase

    def go(self) -> None:
        """Follow commands from now on, but none that was given before; what was wrong is over.

        For the worker; returns when that has been published.
        """
        self.forget_commands()
        self._problem, self._refused_since = Problem.NONE, None
        self.phase = ClientPhase.READY
        rounds = self._rounds
        while self._rounds < rounds + 2:  # one may have begun before
            sleep(1e-4)

    def forget_commands(self) -> None:
        """Follow none that was given before: after something that no command may end. For the worker, at rest."""
        command = self._exchange.command()
        self._followed = 0 if command is None else command.number
        self._wanted = self._resting = False

    def round(self, now: float, session: Session | None) -> bool:
        """Look once at everything.

        Returns:
            Whether to go on: not if a connection is lost for good.
        """
        try:
            state = self._reception.take(now)
        except (ControllerRestartedError, ImpossibleStateError) as error:
            self._found(_GIVEN_UP_FOR[type(error)], now)
            return False
        # our own pauses do not count: the library may not have had its turn yet, either
        self._silence += min(now - self._last_round, _LONGEST_ROUND)
        self._last_round = now
        if state is not None:
            self.state, self._silence = state, 0.0
            self._exchange.write_state(state)
        self._watch(now, session)
        if session is not None:
            self._attend(now, session)
        silent = self._silence >= _GIVE_UP
        if silent:  # while it is brought up, too: the process must not end without a word
            self._found(Problem.SILENT, now)
        self.publish(now)
        return self._problem not in FATAL and not silent

    def publish(self, now: float) -> None:
        """Say how it is."""
        self._rounds += 1
        sampled = -math.inf if self.state is None else self.state.time
        self._exchange.write_status(Status(now, sampled, self.phase, self._problem, self._followed, self._lapses))

    def _found(self, problem: Problem, now: float) -> None:
        """Keep the first problem: others follow from it. But not from the silence that comes before a loss."""
        if self._problem in (Problem.NONE, Problem.SILENT) and problem is not self._problem:
            first = self._problem is Problem.NONE
            self._problem, self._problem_since = problem, now
            if first and self.phase is ClientPhase.READY:
                self._rest()

    def _watch(self, now: float, session: Session | None) -> None:
        if self._says_reconnecting() or (session is not None and not session.connected):
            self._found(Problem.CONTROL_LOST, now)
        elif not self._reception.connected:
            self._found(Problem.RECEIVE_LOST, now)
        if self.phase is not ClientPhase.READY or self.state is None:
            return
        safety = safety_problem(self.state.robot_mode, self.state.safety_bits)
        if safety is not Problem.NONE:
            self._found(safety, now)
        elif self.state.runtime_state != PLAYING:
            self._found(Problem.PROGRAM_STOPPED, now)
        elif self._refused_since is not None and now - self._refused_since > _REASON_WITHIN:
            self._found(Problem.REFUSED, now)
        elif self._silence > self._opening.stale_after:
            self._found(Problem.SILENT, now)

    def _says_reconnecting(self) -> bool:
        """Whether the library says that it reconnects: the beginning of an endless storm, if it is let."""
        size = os.fstat(self._log).st_size
        if size == self._log_size:
            return False
        text = os.pread(self._log, size - self._log_size, self._log_size)
        self._log_size = size
        return b"reconnecting" in text

    def _attend(self, now: float, session: Session) -> None:
        """Send what is to be sent, unless the worker is at it."""
        if (
            self.phase is not ClientPhase.READY
            or self._problem is not Problem.NONE
            or self._refused_since is not None
        ):
            return
        if not session.lock.acquire(blocking=False):
            return
        try:
            self._command(now, session)
        except RefusedError:
            self._refused_since = now
        finally:
            session.lock.release()

    def _command(self, now: float, session: Session) -> None:
        command = self._exchange.command()
        if command is not None and command.number != self._followed:
            self._take(command, now, session)
        elif now - self._sent > _KEEP_ALIVE * self._opening.watchdog:
            if command is not None and self._wanted and session.motion is command.motion:
                self._repeat(command, now, session)
            else:
                session.kick()
            self._sent = now

    def _take(self, command: Order, now: float, session: Session) -> None:
        if session.must_rest_before(command.motion):
            if not self._resting:  # first; the command, or a newer one, comes when it is at rest
                self._resting = True
                self._rest()
            return
        self._followed, self._resting = command.number, False
        self._wanted = command.motion is not MotionCommand.NONE
        session.follow(command)
        self._sent = now

    def _repeat(self, command: Order, now: float, session: Session) -> None:
        if now - command.time > self._opening.watchdog:
            self._wanted, self._lapses = False, self._lapses + 1
            self._rest()
        else:
            session.follow(command)
