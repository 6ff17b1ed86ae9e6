"""What a robot does once a guard has tripped.

Several reactions in a tuple follow one another. One may remember what it has done: every trip works on copies of
its own. The hand keeps its grip through all of them: whatever went wrong, what it holds is not dropped. After the
last the robot stands still and the run ends.
"""

import math
from dataclasses import dataclass, field
from typing import Protocol

from palpate.errors import InvalidValueError, not_negative, positive
from palpate.runtime.data import Command, Observation, Phase
from palpate.sensing.contact import ContactStatus
from palpate.spatial import ZERO, Vector, as_vector, norm, rotate, scale, subtract

Grip = tuple[float, ...] | None
"""Normal force of each finger of the hand [N]; None: nothing is known to be held."""


class Reaction(Protocol):
    """One stage of what is done."""

    def step(self, now: Observation, since: Observation, grip: Grip) -> Command | None:
        """Return what to do now, or None if this stage is over.

        Args:
            now: What is sensed.
            since: What was sensed when this stage began.
            grip: To be kept.
        """
        ...


@dataclass(frozen=True, slots=True)
class Stop:
    """Stand still, and let the run end at once."""

    def step(self, now: Observation, since: Observation, grip: Grip) -> Command | None:
        """See `Reaction`."""
        return None


@dataclass(frozen=True, slots=True)
class Hold:
    """Stand still, with the grip as it is, for `duration` [s]."""

    duration: float = 0.1

    def __post_init__(self) -> None:
        not_negative("hold duration", self.duration, "s")

    def step(self, now: Observation, since: Observation, grip: Grip) -> Command | None:
        """See `Reaction`."""
        return Command(ZERO, Phase.HOLD, grip) if now.time - since.time < self.duration else None


PURSUIT_RATIO = 1.1
"""A contact that presses by this factor more than when the tip began to back off from it keeps coming."""

CLEARANCE_SLACK = 2.0
"""How much longer than it should take a tip may take to get clear of what pressed it: servos start slowly."""


@dataclass(slots=True)
class Retract:
    """Draw the fingertip back from what presses against it, and follow if that keeps coming.

    Standing still is not enough there: position servos would press on, and so would a surface that moves. While
    the tip is pressed it backs off, faster if that does not help; then it goes on until it is `distance` clear,
    and stands watching: whenever it is pressed again, it backs off again. It is over when nothing has pressed
    for the time `quiet`; the supervisor bounds the whole time and distance.

    It moves along the contact normal of the finger that feels most, out of the object; along the force, where no
    contact explains it. A hand that holds something does not retract: drawing one finger back would drop it.

    A surface that comes with speed u presses harder by (u + v) K T before the tip, which moved towards it with v,
    responds: T is the delay from a force to the tip's motion, K the stiffness of contact and robot in series.

    Attributes:
        relieved: A tip that feels more than this is pressed [N].
        speed: [m/s].
        distance: How far it goes on when it is pressed no more [m].
        fastest: Speed once backing off with `speed` has not kept the force from rising by `PURSUIT_RATIO` [m/s].
        quiet: How long it watches [s].
    """

    relieved: float
    speed: float = 0.02
    distance: float = 0.005
    fastest: float = 0.1
    quiet: float = 1.0
    _away: Vector | None = field(default=None, init=False, repr=False, compare=False)
    _felt: float = field(default=0.0, init=False, repr=False, compare=False)
    _pressed: Observation | None = field(default=None, init=False, repr=False, compare=False)
    _chased: bool = field(default=False, init=False, repr=False, compare=False)
    _calm: float | None = field(default=None, init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        not_negative("relieved", self.relieved, "N")
        positive("retract speed", self.speed, "m/s")
        positive("retract distance", self.distance, "m")
        positive("fastest retract speed", self.fastest, "m/s")
        not_negative("quiet", self.quiet, "s")
        if self.fastest < self.speed:
            raise InvalidValueError(
                f"fastest retract speed = {self.fastest:g} m/s: must be at least the retract speed, "
                f"{self.speed:g} m/s"
            )

    def step(self, now: Observation, since: Observation, grip: Grip) -> Command | None:
        """See `Reaction`."""
        if grip is not None or since.hand is not None or not since.fingers:
            return None
        forces = [norm(finger.force) for finger in now.fingers]
        if not all(map(math.isfinite, forces)):
            return None
        felt = max(forces)
        if self._pressed is None:
            self._begin(since, max(norm(finger.force) for finger in since.fingers))
        if felt > self.relieved:
            return self._back_off(now, felt, grip)
        return self._get_clear(now, since, grip)

    def _begin(self, now: Observation, felt: float) -> None:
        self._pressed, self._away, self._felt, self._chased, self._calm = now, _way_out(now), felt, False, None

    def _back_off(self, now: Observation, felt: float, grip: Grip) -> Command | None:
        if self._calm is not None:  # it came after the tip
            self._begin(now, felt)
        self._pressed = now
        self._chased = self._chased or felt > PURSUIT_RATIO * self._felt
        return self._move(self.fastest if self._chased else self.speed, grip)

    def _get_clear(self, now: Observation, since: Observation, grip: Grip) -> Command | None:
        pressed = self._pressed or since
        gone = norm(subtract(now.arm.position_base_tip, pressed.arm.position_base_tip))
        if self._calm is None:
            if gone < self.distance and now.time - pressed.time < CLEARANCE_SLACK * self.distance / self.speed:
                return self._move(self.speed, grip)
            self._calm = now.time
        return Command(ZERO, Phase.HOLD, grip) if now.time - self._calm < self.quiet else None

    def _move(self, speed: float, grip: Grip) -> Command | None:
        return None if self._away is None else Command(scale(speed, self._away), Phase.HOLD, grip)


def _way_out(since: Observation) -> Vector | None:
    """Unit vector out of the object, base frame; None if it cannot be determined."""
    finger = max(since.fingers, key=lambda f: norm(f.force))
    force = finger.force
    if finger.contact.status is ContactStatus.OK:
        away = scale(-1.0, as_vector(finger.contact.normal))
    else:
        size = norm(force)
        if not 0.0 < size < math.inf:
            return None
        away = scale(1.0 / size, force)
    return rotate(since.arm.rotation_base_tip, away)
