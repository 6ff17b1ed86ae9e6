"""Presses on a surface to find stiffness and delay: see `palpate.controllers.identification`.

The tip lands slowly, for nothing is known yet, presses at a speed that grows until the force rises as wanted, goes
up and down between two forces, swings about their middle from slow to fast, and lifts off. Nothing of that is
force control, which would need what is sought: ramps turn where the force says so.
"""

import math
from array import array
from dataclasses import dataclass
from enum import Enum

import numpy as np

from palpate.controllers.guarded_approach import DOWN, ContactEvent, GuardedApproach
from palpate.controllers.identification import Identification, PressRecord, identify
from palpate.controllers.tone import Tone
from palpate.errors import InvalidValueError, check_positive, not_negative, positive
from palpate.runtime.data import Command, Observation, Phase
from palpate.spatial import ZERO, Vector, as_vector, dot, rotate, scale, toward

GROWTH_TIME = 0.2
"""Time in which the speed of the first ramp grows e-fold [s]: an order above any delay, so that it grows no
further than a tenth beyond what was wanted before the force tells."""

FIRST_SPEED = 2e-5
"""Of the first ramp [m/s]: 7 N/s at 350 kN/m, the stiffest that an arm was found to hold its tip."""

FASTEST_SWING = 0.01
"""Largest speed of a sine [m/s]."""

FREQUENCIES = (2.0, 3.3, 5.5, 9.0, 15.0, 25.0, 40.0, 65.0, 95.0, 140.0, 200.0)
"""Of the sines [Hz]: from where servos follow, to beyond where force control through a servo of 100 rad/s begins
to oscillate, and on to where an arm does that feeds velocities forward. Neighbours are close enough for a smooth
response to be interpolated."""

STEADY_AFTER = 0.12
"""A ramp's samples count from so long after its turn [s]: a servo of 100 rad/s is steady to 1e-4 by then. What
turns has a mass, which would pass for stiffness."""

SKIPPED, COUNTED = 2, 6
"""Cycles of a sine: until it is steady, and then."""

LOST_AFTER = 0.02
"""A tip that feels nothing for longer than this in the middle of a sine has lost the surface [s]: less than the
six cycles of the fastest sine, too few to measure anything."""

MIN_SKIPPED = 0.25
"""At least so long until a sine is counted [s]: twelve time constants of a servo with 100 rad/s and half of that
again."""


@dataclass(frozen=True, slots=True)
class IdentifyParameters:
    """Parameters of the identification.

    Attributes:
        low: Lower force of the ramps [N].
        high: Upper force of the ramps [N].
        rate: At which the force shall change on them [N/s].
        ramps: How often up and down, after the first.
        swing: Amplitude of the sines, at most half of high - low [N].
        sensing_delay: From a load to the observation that shows it [s].
        landing_speed: [m/s].
        approach_distance: How far down the surface is looked for [m].
        fastest: Largest speed of a ramp [m/s].
        press_distance: How far it may press [m].
        settle_time: From the touch to the first ramp, and so long at most without contact on later ones [s].
        lift_distance: [m].
        lift_speed: [m/s].
        slew: Bound on the change of commanded velocity [m/s^2].
    """

    low: float = 1.0
    high: float = 3.0
    rate: float = 4.0
    ramps: int = 2
    swing: float = 0.4
    sensing_delay: float = 0.0
    landing_speed: float = 0.001
    approach_distance: float = 0.05
    fastest: float = 0.005
    press_distance: float = 0.02
    settle_time: float = 0.2
    lift_distance: float = 0.005
    lift_speed: float = 0.02
    slew: float = 10.0

    def __post_init__(self) -> None:
        check_positive(self, **_UNITS)
        not_negative("sensing_delay", self.sensing_delay, "s")
        if self.ramps < 1:
            raise InvalidValueError(f"ramps = {self.ramps}: must be at least 1")
        if self.high <= self.low:
            raise InvalidValueError(f"high = {self.high:g} N: must exceed low = {self.low:g} N")
        if self.swing > 0.5 * (self.high - self.low):
            raise InvalidValueError(
                f"swing = {self.swing:g} N: must be at most half of high - low, {0.5 * (self.high - self.low):g} N"
            )


_UNITS = {
    "low": "N",
    "high": "N",
    "rate": "N/s",
    "swing": "N",
    "landing_speed": "m/s",
    "approach_distance": "m",
    "fastest": "m/s",
    "press_distance": "m",
    "settle_time": "s",
    "lift_distance": "m",
    "lift_speed": "m/s",
    "slew": "m/s^2",
}


class _Stage(Enum):
    """Stage of the identification."""

    FIRST = "first ramp, ever faster"
    RAMP = "ramps"
    MIDDLE = "to the middle"
    SWING = "sines"


class IdentifyController:
    """Lands, presses, lifts off. Uses the first finger."""

    def __init__(self, parameters: IdentifyParameters, period: float) -> None:
        """Take how it is pressed, and the control period [s]."""
        self._parameters = parameters
        self.contact = GuardedApproach(parameters.settle_time, parameters.approach_distance, most_bounces=math.inf)
        self._period = positive("period", period, "s")
        self._most_change = parameters.slew * period
        # a slow loop samples no sine faster than this well enough
        self._frequencies = tuple(f for f in FREQUENCIES if f * period <= 0.2)
        self._restart(0.0, ZERO)

    def _restart(self, time: float, position: Vector) -> None:
        self.contact.start(time, position)
        self._outcome = Phase.DONE
        self._command = Command()
        self._normal = DOWN
        self._doing = _Stage.FIRST
        self._speed, self._turns, self._direction = FIRST_SPEED, 0, 1.0
        self._wanted, self._at_touch = 0.0, (0.0, 0.0)
        self._force, self._depth, self._commanded, self._steady = array("d"), array("d"), array("d"), array("b")
        self._turned, self._turned_at = 0, 0.0
        self._tones = [Tone(frequency, self._period, 3) for frequency in self._frequencies]
        self._skipped = [max(SKIPPED, math.ceil(MIN_SKIPPED * tone.frequency)) for tone in self._tones]
        self._tone = 0
        self._swing = 0.0
        self._touched = 0.0  # when it last did

    def start(self, first: Observation) -> None:
        """Begin the approach from where the tip is, from rest."""
        self._restart(first.time, first.arm.position_base_tip)

    def step(self, now: Observation) -> Command:
        """Return the velocity for the next period; a final phase only once that is zero."""
        self.contact.sense(now.time, now.arm.position_base_tip, now.fingers[0].touching)
        self._change_phase(now)
        velocity = toward(self._command.velocity_base_tip, self._velocity(now), self._most_change)
        braking = self.contact.phase.is_final and velocity != ZERO
        self._command = Command(velocity, self._command.phase if braking else self.contact.phase)
        self._wanted += self._period * dot(self._normal, velocity)
        return self._command

    def result(self) -> Identification:
        """Return what was found, once the run is done.

        Raises:
            InvalidValueError: It did not get so far.
        """
        if self._tone < len(self._tones) or self._outcome is Phase.LOST:
            raise InvalidValueError(
                f"nothing was identified: it ended in {self.contact.phase.value!r}, doing {self._doing.value!r}; "
                "let it land on a surface that stands still, and give it time"
            )
        force, depth, commanded = (np.array(rows) for rows in (self._force, self._depth, self._commanded))
        record = PressRecord(force, depth, commanded, np.array(self._steady, dtype=bool), self._period)
        return identify(record, self._tones, self._parameters.sensing_delay)

    def _change_phase(self, now: Observation) -> None:
        wanted, contact, finger = self._parameters, self.contact, now.fingers[0]
        if contact.phase is Phase.HOLD:
            if finger.touching:
                self._touched = now.time
            if contact.travel > wanted.press_distance or self._lost(now.time):
                self._outcome = Phase.LOST
                contact.enter(Phase.LIFT)
            elif self._tone == len(self._tones):
                contact.enter(Phase.LIFT)
        elif contact.phase is Phase.LIFT:
            if contact.lifted(wanted.lift_distance, wanted.lift_speed):
                contact.enter(self._outcome)
        elif contact.step() is ContactEvent.SETTLED:
            self._normal = rotate(now.arm.rotation_base_tip, as_vector(finger.contact.normal))
            self._wanted = 0.0
            self._at_touch = (finger.contact.normal_force, 0.0)
            contact.enter(Phase.HOLD)
        elif contact.loss.is_final:
            contact.enter(Phase.LOST)

    def _lost(self, time: float) -> bool:
        """Whether nothing is left to press on; the first ramp may still be returning to light contact."""
        if self._doing is _Stage.FIRST:
            return False
        longest = LOST_AFTER if self._doing is _Stage.SWING else self._parameters.settle_time
        return time - self._touched > longest

    def _velocity(self, now: Observation) -> Vector:
        wanted, phase = self._parameters, self.contact.phase
        if phase is Phase.APPROACH:
            return scale(wanted.landing_speed, DOWN)
        if phase is Phase.HOLD:
            finger = now.fingers[0]
            felt = finger.contact.normal_force if finger.touching else 0.0
            return scale(self._press(felt, dot(self._normal, now.arm.position_base_tip)), self._normal)
        if phase is Phase.LIFT:
            return scale(-wanted.lift_speed, self._normal)
        return ZERO

    def _press(self, felt: float, depth: float) -> float:
        """Speed into the object."""
        doing = self._doing
        if doing is _Stage.SWING:
            return self._swing_with(self._tones[self._tone], felt, depth)
        wanted = self._parameters
        middle = 0.5 * (wanted.low + wanted.high)
        if doing is _Stage.FIRST:
            self._speed = min(self._speed * math.exp(self._period / GROWTH_TIME), self._sought_speed(felt))
            if felt >= wanted.high:
                self._doing, self._direction = _Stage.RAMP, -1.0
                self._turned_at = self._wanted
        elif doing is _Stage.RAMP:
            if self._turns > 0:
                self._force.append(felt)
                self._depth.append(depth)
                self._commanded.append(self._wanted)
                self._turned += 1
                self._steady.append(self._turned * self._period > STEADY_AFTER)
            if felt >= wanted.high if self._direction > 0.0 else felt <= wanted.low:
                self._direction = -self._direction
                # as far as this ramp went, the next one shall go in the wanted time
                gone = abs(self._wanted - self._turned_at)
                self._speed = min(wanted.rate * gone / (wanted.high - wanted.low), wanted.fastest)
                self._turned_at = self._wanted
                self._turns += 1
                self._turned = 0
                if self._turns > 2 * wanted.ramps:
                    self._doing, self._direction = _Stage.MIDDLE, 1.0
        elif felt >= middle:
            self._doing = _Stage.SWING
            self._swing = self._wanted_swing(self._tones[0], wanted.rate / self._speed)
            return 0.0
        return self._direction * self._speed

    def _sought_speed(self, felt: float) -> float:
        """Speed at which the force changes as wanted, by what the first ramp has shown so far."""
        wanted, (force, at) = self._parameters, self._at_touch
        risen, gone = felt - force, self._wanted - at
        if risen < 0.25 * (wanted.high - wanted.low) or gone <= 0.0:
            return wanted.fastest
        return min(max(wanted.rate * gone / risen, FIRST_SPEED), wanted.fastest)

    def _wanted_swing(self, tone: Tone, stiffness: float) -> float:
        """Amplitude of the commanded velocity [m/s] for the wanted amplitude of the force."""
        return min(tone.angular * self._parameters.swing / stiffness, FASTEST_SWING)

    def _swing_with(self, tone: Tone, felt: float, depth: float) -> float:
        """Speed of a sine; its last sample says how far the next one is to swing."""
        velocity, skipped = self._swing * tone.cosine, self._skipped[self._tone]
        if tone.cycles < skipped:
            tone.skip()
            return velocity
        tone.add(depth, self._wanted, felt)
        if tone.cycles >= skipped + COUNTED:
            self._tone += 1
            if self._tone < len(self._tones):
                response = abs(tone.amplitude(2) / tone.amplitude(1))
                self._swing = self._wanted_swing(self._tones[self._tone], response)
        return velocity
