"""A whole grasp: close, lift, hold, set down and release; on a fault it keeps holding.

The hand opens only when the object stands again where it stood and the reading of every finger is valid. Where a
finger feels nothing, or nothing to be believed, for longer than `patience`, the run ends where it is with the grip
as it is. So it does where something is met while lowering, before it can be what it stood on: an object that has
tilted in the hand comes down on an edge.
"""

import math
from dataclasses import dataclass
from enum import StrEnum
from typing import Protocol

from palpate.controllers.grip.expected_load import ExpectedLoad
from palpate.controllers.grip.slip_safe import SlipSafeGrip
from palpate.controllers.grip.zeros import SteadyZeros, Zeros
from palpate.errors import check_not_negative, check_positive, positive
from palpate.runtime.data import Command, FingerObservation, Observation, Phase
from palpate.runtime.live import LiveParameters
from palpate.spatial import ZERO, Vector, dot

FELT_DOWN = -0.2
"""Share of the load before lowering: the fingers push down on what stands on something. A load that only goes away
does so in the air, too."""

SLOW = 2e-3
"""[m] Above where it stood, from where on it is lowered with the landing speed. What is met higher up is not what
it stood on."""

GROWN, GROWN_BY = 1.5, 0.5
"""Of the grip that was needed before lowering, and [N] beyond: an edge has been met that pushes one finger down,
or turns the object. Lowering alone takes up to 1.1 of it (noise, and 3 % of acceleration)."""

PUSHED, PUSHED_FOR = 0.1, 0.01
"""And by which share the load must have changed in all, and for how long [s]: three fingers share the same load in
one of many distributions, and settle on another one while the hand moves or the grip is reduced. Then it swings
beyond for at most 5 ms; an edge pushes on. At the speed of lowering this takes 0.2 mm of travel."""

FELT_UP = 0.2
"""Share of it above which that was no table: what had pushed is gone, and it is lowered on."""


class GraspStage(StrEnum):
    """Stage of a grasp."""

    CLOSE = "close"
    NUDGE = "nudge"
    LIFT = "lift"
    HOLD = "hold"
    SET_DOWN = "set down"
    LET_GO = "let go"


class LiftingController(Protocol):
    """Closes, lifts and holds, and ends as DONE with the object held: `LiftController` or `NudgeAndLift`."""

    @property
    def live(self) -> LiveParameters:
        """What may be changed while it runs."""
        ...

    def start(self, first: Observation) -> None:
        """Take the first observation."""
        ...

    def step(self, now: Observation) -> Command:
        """Return what hand and arm are to do during the next period."""
        ...


@dataclass(frozen=True, slots=True)
class SetDownParameters:
    """How an object is set down and let go.

    Attributes:
        height: From which it is lowered [m]; 0: it was never lifted.
        speed: With which it is lowered [m/s].
        acceleration: With which that begins, and ends [m/s^2].
        landing_speed: With which it meets the table [m/s].
        beyond: How far below where it stood the table is looked for [m].
        settle_time: From there to letting go [s].
        release_time: In which the grip is let go [s].
        resting_grip: To what [N]. 0 opens the hand, as `Command.grip_force` has it; but a position servo that was
            held up by an object opens only when its profile is back from where it was to close to, 7 s for the
            simulated hand: take 0 with 8 s of `rest_time`. This rather leaves the fingers where they are.
        rest_time: For which the hand then rests [s].
        patience: How long a finger may feel nothing, or nothing to be believed, before the run ends [s].
    """

    height: float = 0.01
    speed: float = 0.02
    acceleration: float = 0.2
    landing_speed: float = 0.005
    beyond: float = 0.001
    settle_time: float = 0.2
    release_time: float = 0.3
    resting_grip: float = 0.01
    rest_time: float = 0.3
    patience: float = 0.5

    def __post_init__(self) -> None:
        check_not_negative(self, height="m", beyond="m", resting_grip="N")
        check_positive(
            self,
            speed="m/s",
            acceleration="m/s^2",
            landing_speed="m/s",
            settle_time="s",
            release_time="s",
            rest_time="s",
            patience="s",
        )


class GraspController:
    """Carries, sets down, lets go; ends with LOST and the grip as it is where a finger fails.

    Attributes:
        grip: How it presses.
        stage: What it is at.
        zeros: Of the fingers' sensors.
        met_early: Whether the run ended because something was met higher up than what the object stood on.
    """

    def __init__(
        self,
        lifting: LiftingController,
        grip: SlipSafeGrip,
        period: float,
        parameters: SetDownParameters | None = None,
        *,
        first: GraspStage = GraspStage.CLOSE,
        zeros: Zeros | None = None,
    ) -> None:
        """Take the pieces.

        Args:
            lifting: Closes, lifts and holds with `grip`.
            grip: How it presses.
            period: Of control [s].
            parameters: How to set down.
            first: What closing is called: NUDGE where the fingers nudge first.
            zeros: Of the fingers' sensors, that `grip` has, too; they do not wander if not given.
        """
        self._lifting, self.grip, self._period = lifting, grip, positive("period", period, "s")
        self._parameters, self._first = parameters or SetDownParameters(), first
        self.zeros = zeros or SteadyZeros()
        self._pressed: tuple[float, ...] = ()
        self._pulls: tuple[Vector, ...] = ()
        self._landed: float | None = None
        self._released: tuple[float, ...] = ()
        self._lowered = self._speed = self._edge_for = 0.0
        self._pushed = False
        self._forget(0.0)

    @property
    def live(self) -> LiveParameters:
        """See `palpate.runtime.live.Tunable`."""
        return self._lifting.live

    def start(self, first: Observation) -> None:
        """Take the first observation."""
        self.zeros.start()
        self._lifting.start(first)
        self._forget(first.time)

    def step(self, now: Observation) -> Command:
        """Return what hand and arm are to do during the next period."""
        command = self._next(self.zeros.step(now, self._pressed))
        self._pressed = command.grip_force or self._pressed
        return command

    def _next(self, now: Observation) -> Command:
        if self.stage is GraspStage.LET_GO:
            return self._let_go(now)
        command = self._set_down(now) if self.stage is GraspStage.SET_DOWN else self._carried(now)
        if command.phase is Phase.LOST:
            return command
        if not self.grip.faulty:
            self._trusted = now.time
        elif now.time - self._trusted >= self._parameters.patience:
            return Command(ZERO, Phase.LOST, command.grip_force)
        return command

    def _carried(self, now: Observation) -> Command:
        command = self._lifting.step(now)
        match command.phase:
            case Phase.LIFT:
                self.stage = GraspStage.LIFT
            case Phase.HOLD:
                self.stage = GraspStage.HOLD
            case Phase.APPROACH:
                self.stage = GraspStage.CLOSE
            case Phase.DONE:
                self._go_on(GraspStage.SET_DOWN, now.time)
                self._pulls = tuple(_pull_of(finger) for finger in now.fingers)
                self._most_needed = GROWN * self.grip.needed + GROWN_BY
                self._announce(now.time)
                return Command(ZERO, Phase.TRAVEL, command.grip_force)
            case _:
                pass
        return command

    def _announce(self, time: float) -> None:
        """Tell the grip of the hand's own stop: within the time of lowering it may come at any instant."""
        p = self._parameters
        lasts = p.speed / p.acceleration + (p.height + p.beyond) / p.landing_speed
        self.grip.expect(ExpectedLoad(time, time + lasts, acceleration=p.acceleration))

    def _set_down(self, now: Observation) -> Command:
        p, forces = self._parameters, self.grip.step(now, hanging=False)
        # twice in a row: one odd sample is no table
        borne, before = self._borne(now), self._pushed
        self._pushed = borne < FELT_DOWN
        met = before and self._pushed
        if self._landed is None:
            left = p.height - self._lowered
            edge = self.grip.needed > self._most_needed and abs(borne - 1.0) > PUSHED
            self._edge_for = self._edge_for + self._period if edge else 0.0
            if left > SLOW and (self._edge_for >= PUSHED_FOR or met):
                self.met_early = True
                return Command(ZERO, Phase.LOST, forces)
            if left < -p.beyond or met:
                self._landed, self._speed, self._released = now.time, 0.0, forces
            else:
                slowest = p.landing_speed
                ends = (slowest**2 + 2.0 * p.acceleration * max(left - SLOW, 0.0)) ** 0.5
                self._speed = min(p.speed, ends, self._speed + p.acceleration * self._period)
                self._lowered += self._speed * self._period
        elif borne > FELT_UP and self._lowered < p.height + p.beyond:
            self._landed = None
        elif now.time - self._landed >= p.settle_time and not self.grip.faulty:
            self._go_on(GraspStage.LET_GO, now.time)
        # pushed on by the table the fingers are to slip: a grip that is safe from that would only push harder
        kept = forces if self._landed is None else self._released
        return Command((0.0, 0.0, -self._speed), Phase.TRAVEL, kept)

    def _borne(self, now: Observation) -> float:
        """Share of the load before lowering that the fingers bear; below 0 if it is reversed."""
        before = sum(dot(pull, pull) for pull in self._pulls)
        borne = sum(dot(_pull_of(its), pull) for its, pull in zip(now.fingers, self._pulls, strict=True))
        return borne / before if before > 0.0 else 1.0

    def _let_go(self, now: Observation) -> Command:
        p, gone = self._parameters, now.time - self._since
        left = max(0.0, 1.0 - gone / p.release_time)
        phase = Phase.DONE if gone >= p.release_time + p.rest_time else Phase.SETTLE
        return Command(ZERO, phase, tuple(max(left * force, p.resting_grip) for force in self._released))

    def _forget(self, time: float) -> None:
        self.stage = self._first
        self._since = self._trusted = time
        self._lowered = self._speed = self._edge_for = 0.0
        self._pulls, self._most_needed, self.met_early = (), math.inf, False
        self._landed, self._released, self._pushed = None, (), False
        self._pressed = ()

    def _go_on(self, stage: GraspStage, time: float) -> None:
        self.stage, self._since = stage, time


def _pull_of(finger: FingerObservation) -> Vector:
    """Tangential force on a finger, sensor frame [N]."""
    x, y, z = finger.contact.tangential_force.tolist()
    return (x, y, z)
