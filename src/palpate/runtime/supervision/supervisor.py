"""Limits that no controller can pass."""

import math
from collections.abc import Iterable, Mapping
from copy import copy
from dataclasses import replace

from palpate.errors import LatchedError, OverrunError, positive
from palpate.runtime.data import Command, Observation, Phase
from palpate.runtime.stopping import Stopping
from palpate.runtime.supervision.aftermath import Aftermath
from palpate.runtime.supervision.command_conditions import (
    CommandedAcceleration,
    CommandedGrip,
    CommandedSpeed,
    CommandedTurn,
    form_fault,
)
from palpate.runtime.supervision.command_watch import CommandWatch
from palpate.runtime.supervision.comparisons import UNCLEAR
from palpate.runtime.supervision.contact_speed_check import ContactSpeedCheck
from palpate.runtime.supervision.direction_check import DirectionCheck
from palpate.runtime.supervision.finding import NO_EXCEPTION, Attributed, Cause, Trip, Violation
from palpate.runtime.supervision.guard import Guard
from palpate.runtime.supervision.guard_watch import GuardWatch
from palpate.runtime.supervision.limits import Limits
from palpate.runtime.supervision.reactions import Grip, Reaction, Stop
from palpate.runtime.supervision.run_guards import guards_of
from palpate.spatial import ZERO, Vector, add_scaled, norm, scale, toward


class WorkspaceCheck:
    """Compares where the tip would come to rest, if it were stopped now, with the workspace.

    On each axis it goes on with the commanded velocity or the measured one, whichever leads farther out: a tip
    that was turned off its path still goes on along it.
    """

    def __init__(self, limits: Limits, stopping: Stopping) -> None:
        """Take the workspace, and how the tip comes to rest."""
        self._lower, self._upper, self._stopping = limits.workspace_lower, limits.workspace_upper, stopping

    def broken(self, now: Observation, velocity: Vector) -> Violation | None:
        """Return what is wrong with commanding a velocity of the tip [m/s, base frame], if anything."""
        arm = now.arm
        position, age = arm.position_base_tip, now.time - arm.time
        axes = tuple(zip(velocity, arm.velocity_base_tip, strict=True))
        # it has gone on since it was seen there
        time = age + self._stopping.equivalent_time(math.hypot(*(max(abs(v), abs(u)) for v, u in axes)))
        for at, (v, u), low, high in zip(position, axes, self._lower, self._upper, strict=True):
            up, down = max(v, u), min(v, u)
            if (up > 0.0 and at + time * up > high) or (down < 0.0 and at + time * down < low):
                break
        else:
            return None
        x, y, z = add_scaled(position, time, max(velocity, arm.velocity_base_tip, key=norm))
        return Violation(
            "tip position after a stop from its velocity",
            f"({x:.4f}, {y:.4f}, {z:.4f}) m",
            f"between {self._lower} m and {self._upper} m",
            Cause.MOTION,
        )


LONGEST_REACTION = 10.0
"""After this long [s] a reaction is over, finished or not: backing off from a surface that comes at 10 mm/s takes
as long for `LARGEST_RETREAT`."""

CAUSES: Mapping[str, Cause] = {
    "touch": Cause.DEVICE,
    "controller": Cause.CONTROLLER,
    "live parameters": Cause.CONTROLLER,
    "observer": Cause.CONTROLLER,
}
"""Of an exception that states none, by who raised it."""

LARGEST_RETREAT = 0.1
"""Distance from where it tripped [m] at which a reaction ends, too."""


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
        self._period, self._stopping = math.inf, Stopping()
        self.reset()

    def reset(self) -> None:
        """Forget the trip: somebody has looked, and the robot may move again."""
        self.trip: Trip | None = None
        self.error: Exception | None = None
        self.finished = False
        self._grip: Grip = None
        self._forget()

    def start(self, period: float, stopping: Stopping | None = None) -> None:
        """Begin a run.

        Args:
            period: Of control [s].
            stopping: How the tip comes to rest; None: the default.

        Raises:
            LatchedError: It tripped before and was not reset.
        """
        if self.trip is not None:
            raise LatchedError(f"the supervisor has tripped ({self.trip}): see to it, then call its reset()")
        self._period, self._stopping = positive("period", period, "s"), stopping or Stopping()
        self._forget()

    def _forget(self) -> None:
        self._before: Observation | None = None
        self._broken_since: dict[int, float] = {}
        self._broken_at_trip: frozenset[int] = frozenset()
        self._stages: tuple[Reaction, ...] = ()
        self._reaction: tuple[Reaction, ...] = ()
        self._since: Observation | None = None
        self._aftermath: Aftermath | None = None
        limits, period = self.limits, self._period
        self._watch = GuardWatch(self.guards, limits.force)
        self._directions = DirectionCheck(period, self._watch.approach)
        self._contact_speed = ContactSpeedCheck(limits)
        self._workspace = WorkspaceCheck(limits, self._stopping)
        conditions = (
            CommandedSpeed(limits.speed),
            CommandedAcceleration(limits.acceleration, period),
            CommandedTurn(limits.angular_speed, limits.angular_acceleration, period),
            CommandedGrip(limits.grip_force),
        )
        self._commands = CommandWatch(conditions, self._contact_speed.most, limits, self._stopping)
        self._commanded: Vector = ZERO

    @property
    def reacting(self) -> bool:
        """Whether it has tripped and the reaction is not over."""
        return self.trip is not None and not self.finished

    def admits(self, now: Observation) -> bool:
        """Return whether the controller may see this and go on."""
        if self.trip is not None:
            return False
        before, self._before, watch, commands = self._before, now, self._watch, self._commands
        found = watch.judge(now, commands)
        if found == UNCLEAR:
            if self._trips(range(len(self.guards)), now, before):
                return False
            found = watch.compare(commands)
        else:
            if self._broken_since:
                self._broken_since = {i: since for i, since in self._broken_since.items() if i in watch.others}
            if watch.others and self._trips(watch.others, now, before):
                return False
        last = commands.last
        self._directions.add((now, last.velocity_base_tip))
        if found == 0:
            return True
        self._trip(now.time, watch.finding(now, last), (Stop(),))
        return False

    def _trips(self, guards: Iterable[int], now: Observation, before: Observation | None) -> bool:
        """Ask guards one by one; return whether one has tripped."""
        for i in guards:
            finding, guard = self._watch.broken(i, now, before), self.guards[i]
            if finding is None:
                self._broken_since.pop(i, None)
            elif now.time - self._broken_since.setdefault(i, now.time) >= guard.duration or guard.duration == 0.0:
                self._trip(now.time, finding, guard.reaction)
                self._broken_at_trip = frozenset(
                    j for j in range(len(self.guards)) if self._watch.broken(j, now, before)
                )
                self._watch.keep()
                return True
        return False

    def check(self, now: Observation, command: Command) -> Command:
        """Return the command, or what is done instead."""
        if self.trip is not None:
            return self.react(now)
        if now is not self._before:
            self._watch.look(now)
        self._contact_speed.see(now)
        if not self._commands.passes(command, self._watch.seen):
            finding = self._objection(now, command)
            if finding is not None:
                if finding.cause is Cause.OTHER:
                    finding = finding._replace(cause=Cause.CONTROLLER)
                self._trip(now.time, finding, (Stop(),))
                return self.react(now)
            command = _plain(command)
            self._commands.take(command)
        if command.grip_force is not None:
            self._grip = command.grip_force
        return command

    def _objection(self, now: Observation, command: Command) -> Violation | None:
        finding = self._commands.fault(command) or self._contact_speed.broken(now, command)
        return finding or self._workspace.broken(now, command.velocity_base_tip)

    def react(self, now: Observation) -> Command:
        """Return what is done after a trip."""
        if self._since is None or self._aftermath is None:
            self._since, self._aftermath = now, Aftermath(now)
            self._directions.begin(self._aftermath)
        else:
            self._aftermath.add(now)
            if not self.finished:
                self._end_if_worse(now, self._aftermath)
        self._before = now
        self._watch.keep()
        while self._stages and not self.finished:
            command = self._within_limits(self._stages[0].step(now, self._since, self._grip))
            if command is not None:
                objection = self._directions.objection(command, now, self._aftermath)
                outside = self._workspace.broken(now, command.velocity_base_tip)
                if outside is not None:
                    objection = _ended_because(outside)
                if not objection:
                    self._commanded = command.velocity_base_tip
                    return command
                self._finish(self._aftermath, objection)
            self._stages, self._since = self._stages[1:], now
        if not self.finished:
            self._finish(self._aftermath)
        return self.standstill()

    def _end_if_worse(self, now: Observation, aftermath: Aftermath) -> None:
        """End a reaction that runs into something new, takes too long, or leads too far."""
        if not aftermath.duration < LONGEST_REACTION:
            self._finish(aftermath, f"ended after {LONGEST_REACTION:g} s")
        elif not aftermath.distance < LARGEST_RETREAT:
            self._finish(aftermath, f"ended after {1e3 * LARGEST_RETREAT:g} mm")
        else:
            self._watch.look(now)
            for i, guard in enumerate(self.guards):
                # what calls for the very same, a contact that presses harder for one, is no reason to break it off
                if i in self._broken_at_trip or guard.reaction == self._reaction:
                    continue
                finding = self._watch.broken(i, now, self._before)
                if finding is not None:
                    self._finish(aftermath, _ended_because(finding))
                    return

    def _finish(self, aftermath: Aftermath, why: str = "") -> None:
        self.finished = True
        if self.trip is not None and (why or aftermath.moved):
            self.trip = replace(self.trip, aftermath=aftermath.summary(why))

    def _within_limits(self, command: Command | None) -> Command | None:
        """A reaction's command, slowed down to the limits; None if it is none, or lets go of something.

        A reaction begins with a stop, whatever the controller's last command was: its own commands alone keep to
        the limit on acceleration.
        """
        if command is None or form_fault(command, self._commands.grip) is not None:
            return None
        velocity, turn = command.velocity_base_tip, command.angular_velocity_base_tip
        fastest, widest = self.limits.speed, self.limits.angular_speed
        share = 1.0 / max(norm(velocity) / fastest, norm(turn) / widest, 1.0)  # of both: the path stays the same
        velocity = toward(self._commanded, scale(share, velocity), self.limits.acceleration * self._period)
        return Command(velocity, command.phase, self._grip, scale(share, turn))

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
            self._trip(time, Violation(source, _text_of(error), NO_EXCEPTION, _cause_of(source, error)), ())
        self.finished = True

    def _trip(self, time: float, finding: Violation, reaction: tuple[Reaction, ...]) -> None:
        self.trip = Trip(time, *finding)
        self._reaction, self._stages = reaction, tuple(copy(stage) for stage in reaction)


def _plain(command: Command) -> Command:
    """Return a command as it is, or with plain numbers for an array that its owner may fill again."""
    velocity, turn = command.velocity_base_tip, command.angular_velocity_base_tip
    if type(velocity) is tuple and type(turn) is tuple:
        return command
    (x, y, z), (u, v, w) = velocity, turn
    velocity, turn = (float(x), float(y), float(z)), (float(u), float(v), float(w))
    return replace(command, velocity_base_tip=velocity, angular_velocity_base_tip=turn)


def _ended_because(finding: Violation) -> str:
    """Return why a reaction was over before its end."""
    return f"ended because {finding.measure} was {finding.value}"


def _cause_of(source: str, error: Exception) -> Cause:
    """Return what has to be seen to: what an exception states, or whose code raised it."""
    if isinstance(error, OverrunError):
        return Cause.COMPUTER
    if isinstance(error, Attributed):
        return error.cause
    if source == "back end" and isinstance(error, OSError):
        return Cause.WIRE
    return CAUSES.get(source, Cause.OTHER)


def _text_of(error: Exception) -> str:
    """An exception in one line, whatever it does when it is asked for its words."""
    try:
        words = f": {error}"
    except Exception:
        words = ""
    text = " ".join(f"{type(error).__name__}{words}".split())
    return text if len(text) <= 300 else text[:297] + "..."
