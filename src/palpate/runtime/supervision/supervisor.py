"""Limits that no controller can pass."""

from dataclasses import replace

from palpate.errors import LatchedError, positive
from palpate.runtime.data import Command, Observation, Phase
from palpate.runtime.supervision.command_conditions import (
    CommandCondition,
    CommandedAcceleration,
    CommandedGrip,
    CommandedSpeed,
    CommandedTurn,
    WellFormed,
)
from palpate.runtime.supervision.finding import Finding, Trip
from palpate.runtime.supervision.guard import Guard, guards_of
from palpate.runtime.supervision.limits import Limits
from palpate.runtime.supervision.reactions import Grip, Reaction, Stop
from palpate.spatial import ZERO, norm, scale

LONGEST_REACTION = 1.0
"""After this long [s] a reaction is over, finished or not."""


class Supervisor:
    """Passes commands on until something is out of bounds; from then on only its reaction moves the robot.

    Once per period: `admits` looks at what was sensed, before the controller does; `check` at what the controller
    wants. From a trip on `react` says what is done, until `finished`. A trip stays, over runs too, until `reset`.

    Attributes:
        trip: Why it stopped the robot; None while all is well.
        error: The exception that was the reason, if it was one.
        finished: Whether the reaction to the trip is over.
    """

    def __init__(self, limits: Limits | None = None, guards: tuple[Guard, ...] = ()) -> None:
        """Take the limits, or the defaults of `Limits`, and further guards of one's own."""
        self.limits = limits or Limits()
        self.guards = (*guards_of(self.limits), *guards)
        self._command_conditions: tuple[CommandCondition, ...] = (WellFormed(),)
        self.reset()

    def reset(self) -> None:
        """Forget the trip: somebody has looked, and the robot may move again."""
        self.trip: Trip | None = None
        self.error: Exception | None = None
        self.finished = False
        self._grip: Grip = None
        self._forget()

    def start(self, period: float) -> None:
        """Begin a run with a control period [s].

        Raises:
            LatchedError: It tripped before and was not reset.
        """
        if self.trip is not None:
            raise LatchedError(f"the supervisor has tripped ({self.trip}): see to it, then call its reset()")
        limits = self.limits
        self._command_conditions = (
            WellFormed(),
            CommandedSpeed(limits.speed),
            CommandedAcceleration(limits.acceleration, positive("period", period, "s")),
            CommandedTurn(limits.angular_speed, limits.angular_acceleration, period),
            CommandedGrip(limits.grip_force),
        )
        self._forget()

    def _forget(self) -> None:
        self._before: Observation | None = None
        self._last = Command()
        self._broken_since: dict[int, float] = {}
        self._broken_at_trip: frozenset[int] = frozenset()
        self._stages: tuple[Reaction, ...] = ()
        self._since: Observation | None = None
        self._began = 0.0

    @property
    def reacting(self) -> bool:
        """Whether it has tripped and the reaction is not over."""
        return self.trip is not None and not self.finished

    def admits(self, now: Observation) -> bool:
        """Return whether the controller may see this and go on."""
        if self.trip is not None:
            return False
        before, self._before = self._before, now
        for i, guard in enumerate(self.guards):
            finding = guard.condition.broken(now, before)
            if finding is None:
                if self._broken_since:
                    self._broken_since.pop(i, None)
            elif now.time - self._broken_since.setdefault(i, now.time) >= guard.duration or guard.duration == 0.0:
                self._trip(now.time, finding, guard.reaction)
                self._broken_at_trip = self._broken(now, before)
                return False
        return True

    def check(self, now: Observation, command: Command) -> Command:
        """Return the command, or what is done instead."""
        if self.trip is None:
            for condition in self._command_conditions:
                finding = condition.broken(command, self._last)
                if finding is not None:
                    self._trip(now.time, finding, (Stop(),))
                    return self.react(now)
            velocity = command.velocity_base_tip
            if type(velocity) is not tuple:  # an array that its owner may fill again
                x, y, z = velocity
                command = replace(command, velocity_base_tip=(float(x), float(y), float(z)))
            turn = command.angular_velocity_base_tip
            if type(turn) is not tuple:
                x, y, z = turn
                command = replace(command, angular_velocity_base_tip=(float(x), float(y), float(z)))
            if command.grip_force is not None:
                self._grip = command.grip_force
                self._last = command
            else:
                self._last = Command(
                    command.velocity_base_tip, command.phase, self._grip, command.angular_velocity_base_tip
                )
            return command
        return self.react(now)

    def react(self, now: Observation) -> Command:
        """Return what is done after a trip."""
        if self._since is None:
            self._since, self._began = now, now.time
        elif self._worse(now):
            self.finished = True
        self._before = now
        while self._stages and not self.finished:
            command = self._within_limits(self._stages[0].step(now, self._since, self._grip))
            if command is not None:
                return command
            self._stages, self._since = self._stages[1:], now
        self.finished = True
        return self.standstill()

    def _within_limits(self, command: Command | None) -> Command | None:
        """A reaction's command, slowed down to the speed limit; None if it is none, or lets go."""
        if command is None or self._command_conditions[0].broken(command, self._last) is not None:
            return None
        velocity, turn = command.velocity_base_tip, command.angular_velocity_base_tip
        fastest, widest = self.limits.speed, self.limits.angular_speed
        excess = max(norm(velocity) / fastest, norm(turn) / widest)
        if excess <= 1.0 and command.grip_force == self._grip:
            return command
        share = 1.0 / max(excess, 1.0)  # of both: the way stays the same
        return Command(scale(share, velocity), command.phase, self._grip, scale(share, turn))

    def standstill(self) -> Command:
        """Return the command to stand still without dropping anything: safe when nothing is known."""
        return Command(ZERO, Phase.STOP, self._grip)

    def fail(self, time: float, source: str, error: Exception) -> None:
        """Trip because something raised an exception; nothing is known, so the robot stands still.

        Args:
            time: When [s].
            source: Who raised it: "controller", "back end".
            error: The exception.
        """
        if self.trip is None:
            self.error = error
            self._trip(time, Finding(source, _told(error), "no exception"), ())
        self.finished = True

    def _trip(self, time: float, finding: Finding, reaction: tuple[Reaction, ...]) -> None:
        self.trip = Trip(time, *finding)
        self._stages = reaction

    def _broken(self, now: Observation, before: Observation | None) -> frozenset[int]:
        return frozenset(i for i, guard in enumerate(self.guards) if guard.condition.broken(now, before))

    def _worse(self, now: Observation) -> bool:
        """Whether the reaction runs into something new, or takes too long."""
        in_time = now.time - self._began < LONGEST_REACTION
        return not in_time or not self._broken(now, self._before) <= self._broken_at_trip


def _told(error: Exception) -> str:
    """An exception in one line, whatever it does when it is asked for its words."""
    try:
        words = f": {error}"
    except Exception:
        words = ""
    text = " ".join(f"{type(error).__name__}{words}".split())
    return text if len(text) <= 300 else text[:297] + "..."
