"""Closes the fingers on an object, lifts it and holds it, with a slip-safe grip from the first touch on.

The weight is unknown, and is measured as the fingers take it up. Meanwhile the hand moves up
ever faster, by a factor of e in `GROWTH_TIME`. A contact of any stiffness K bears K s, and s is then the speed
times that time: so its load, too, grows by that factor and no faster, and what it will need in `LOOKAHEAD` is
known. Where the fingers do not yet press with that and `GRIP_RESERVE`, the hand stands still and lets the grip
catch up: servos that are position controlled may follow with no more than 15 N/s.

It is DONE with an object that all fingers feel. If they do not all touch in time, or one feels nothing, or nothing
to be believed, for longer than `patience`, or the grip does not come up to what the object takes, it is LOST: the
hand stands still with the grip as it is.
"""

import math
from dataclasses import dataclass

from palpate.controllers.grip.slip_safe import SlipSafeGrip
from palpate.errors import InvalidValueError, check_positive, not_negative, positive
from palpate.runtime.data import Command, Observation, Phase
from palpate.runtime.live import LiveParameters
from palpate.sensing.ft.poses import STANDARD_GRAVITY
from palpate.spatial import ZERO

START_SPEED = 5e-5
"""[m/s] With which a weight begins to be taken up: 6 N/s of grip where a contact bears 55 N/mm, with mu 0.5."""

GROWTH_TIME = 0.03
"""[s] In which the speed grows by a factor of e, until the acceleration is all of what is allowed."""

LOOKAHEAD = 0.03
"""[s] So far ahead the needed grip is looked at: smoothing, bus and servos of hand and carrier, 10 + 20 ms."""

RATE_TIME = 0.01
"""[s] Time constant of that grip's rate."""

GRIP_RESERVE = 0.06
"""Share beyond that: half of what a grip is usually planned with. The margin itself is live, and no lift is to be
another one for that."""

GRIP_FACTOR = 1.5
"""Of the needed grip: with that the fingers press while they lift, so that there is room for what comes on."""

BRAKING = 3.0
"""[m/s^2] With which the hand stops where the grip is too small."""

TOO_HEAVY = 0.3
"""[s] For which a load may take more grip than there is before holding ends: slips are stopped within 0.15 s."""

GRIP_TIMEOUT = 2.0
"""[s] For which it waits for the grip at most: 15 N with 15 N/s take one."""


@dataclass(frozen=True, slots=True)
class LiftParameters:
    """How an object is lifted.

    Attributes:
        first_grip: With which the fingers close and lift [N]; given up for the least when the lift is over.
        settle_time: From the last finger's touch to the lift, and from there to holding [s].
        height: How far it is lifted [m]; 0: it is held where it stands.
        speed: With which it is lifted [m/s].
        acceleration: With which it gets there [m/s^2].
        hold_time: How long it is held [s].
        close_time: By when all fingers must touch [s]: 40 mm at 5 mm/s, and as long again.
        patience: How long a finger may feel nothing, or nothing to be believed, before it is given up [s].
    """

    first_grip: float = 3.0
    settle_time: float = 0.3
    height: float = 0.01
    speed: float = 0.02
    acceleration: float = 0.2
    hold_time: float = 5.0
    close_time: float = 15.0
    patience: float = 0.5

    def __post_init__(self) -> None:
        check_positive(
            self,
            first_grip="N",
            settle_time="s",
            speed="m/s",
            acceleration="m/s^2",
            hold_time="s",
            close_time="s",
            patience="s",
        )
        not_negative("height", self.height, "m")


class LiftController:
    """Closes, lifts, holds; ends with the object held.

    Attributes:
        live: What may be changed while it runs: that of the grip.
        grip: How it presses.
        phase: What it is doing.
    """

    def __init__(self, grip: SlipSafeGrip, period: float, parameters: LiftParameters | None = None) -> None:
        """Take the grip, the period of control [s], and how to lift.

        Raises:
            InvalidValueError: The first grip is more than the grip may be.
        """
        self.grip, self._period, self._parameters = (
            grip,
            positive("period", period, "s"),
            parameters or LiftParameters(),
        )
        first, most = self._parameters.first_grip, grip.parameters.largest_grip
        if first > most:
            raise InvalidValueError(f"first_grip = {first:g} N: must be at most largest_grip = {most:g} N")
        self.phase = Phase.APPROACH
        self._since = self._began = self._trusted = self._moved = self._borne = 0.0
        self._lifted = self._speed = 0.0
        self._needed = self._rate = 0.0

    @property
    def live(self) -> LiveParameters:
        """See `palpate.runtime.live.Tunable`."""
        return self.grip.live

    def start(self, first: Observation) -> None:
        """Take the first observation."""
        self.grip.start(self._parameters.first_grip)
        self._reset(first.time)

    def start_later(self, now: Observation) -> None:
        """Begin to lift now, with all that the grip's belief has learned since `start`."""
        self._reset(now.time)

    def step(self, now: Observation) -> Command:
        """Return what hand and arm are to do during the next period."""
        p = self._parameters
        if self.phase is Phase.APPROACH:
            if not all(finger.touching for finger in now.fingers):
                self._since = now.time
                if now.time - self._began > p.close_time:
                    self._go_on(Phase.LOST, now.time)
            elif now.time - self._since >= p.settle_time:
                self._trusted = self._moved = now.time
                self._go_on(Phase.LIFT if p.height > 0.0 else Phase.HOLD, now.time)
            return Command(ZERO, self.phase, (p.first_grip,) * len(now.fingers))
        forces = self.grip.step(now, self._at_least(), hanging=p.height > 0.0)
        if not self.grip.faulty:
            self._trusted = now.time
        elif now.time - self._trusted >= p.patience and not self.phase.is_final:
            self._speed = 0.0
            self._go_on(Phase.LOST, now.time)
        if self.phase is Phase.LIFT:
            self._lift(now)
        elif self.phase is Phase.SETTLE and now.time - self._since >= p.settle_time:
            self._go_on(Phase.HOLD, now.time)
        elif self.phase is Phase.HOLD and not self.grip.faulty:
            self._borne = self._borne if self.grip.overloaded else now.time
            if now.time - min(self._borne, now.time) > TOO_HEAVY or now.time - self._since >= p.hold_time:
                self._go_on(Phase.DONE, now.time)
        return Command((0.0, 0.0, self._speed), self.phase, forces)

    def _at_least(self) -> float:
        """Least grip, whatever the load [N]."""
        if self.phase is Phase.HOLD:
            return 0.0
        first = self._parameters.first_grip
        if self.phase is not Phase.LIFT:
            return first
        # its own acceleration adds a share to what hangs, known before it is felt
        return max(first, (GRIP_FACTOR + self._parameters.acceleration / STANDARD_GRAVITY) * self._needed)

    def _lift(self, now: Observation) -> None:
        """Advance the lift: no faster than allows a stop at the height, and than the grip follows the load."""
        p, dt = self._parameters, self._period
        share, needed = dt / RATE_TIME, self.grip.needed
        self._rate += share * ((needed - self._needed) / dt - self._rate)
        self._needed, predicted = needed, needed + LOOKAHEAD * max(self._rate, 0.0)
        if self.grip.pressed(now) < predicted * (1.0 + GRIP_RESERVE):
            self._speed = max(self._speed - BRAKING * dt, 0.0)
            if now.time - self._moved >= GRIP_TIMEOUT:
                self._go_on(Phase.LOST, now.time)
        else:
            self._moved = now.time
            reach = max(p.height - self._lifted, 0.0)
            grown = min(self._speed * math.exp(dt / GROWTH_TIME), self._speed + p.acceleration * dt)
            self._speed = min(p.speed, (2.0 * p.acceleration * reach) ** 0.5, max(grown, START_SPEED))
        self._lifted += self._speed * dt
        if p.height - self._lifted <= 0.0:
            self._speed = 0.0
            self._go_on(Phase.SETTLE, now.time)

    def _reset(self, time: float) -> None:
        self.phase = Phase.APPROACH
        self._since = self._began = self._trusted = self._moved = self._borne = time
        self._lifted = self._speed = 0.0
        self._needed = self._rate = 0.0

    def _go_on(self, phase: Phase, time: float) -> None:
        self.phase, self._since = phase, time
