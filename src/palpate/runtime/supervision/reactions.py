"""What a robot does once a guard has tripped.

A reaction is a pure function of where things stand; several in a tuple follow one another. The hand keeps its grip
through all of them: whatever went wrong, what it holds is not dropped. After the last the robot stands still and
the run ends.
"""

import math
from dataclasses import dataclass
from typing import Protocol

from palpate.errors import not_negative, positive
from palpate.runtime.data import Command, FingerObservation, Observation, Phase
from palpate.sensing.contact import ContactStatus
from palpate.spatial import ZERO, Vector, norm, rotate, scale, subtract

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


@dataclass(frozen=True, slots=True)
class Retract:
    """Draw the fingertip back from what it presses against.

    Standing still is not enough there: position servos would press on. The way is along the contact normal of the
    finger that feels most, out of the object; along the force, where no contact explains it. A hand that holds
    something does not retract: drawing one finger back would drop it.

    Attributes:
        relieved: The force at which it is enough [N].
        speed: [m/s].
        distance: Longest way [m].
    """

    relieved: float
    speed: float = 0.02
    distance: float = 0.005

    def __post_init__(self) -> None:
        not_negative("relieved", self.relieved, "N")
        positive("retract speed", self.speed, "m/s")
        positive("retract distance", self.distance, "m")

    def step(self, now: Observation, since: Observation, grip: Grip) -> Command | None:
        """See `Reaction`."""
        if grip is not None or since.hand is not None or not since.fingers:
            return None
        felt = [norm(_force(finger)) for finger in now.fingers]
        gone = norm(subtract(now.arm.position_base_tip, since.arm.position_base_tip))
        if not (all(map(math.isfinite, felt)) and max(felt) > self.relieved and gone < self.distance):
            return None
        away = _way_out(since)
        return None if away is None else Command(scale(self.speed, away), Phase.HOLD, grip)


def _way_out(since: Observation) -> Vector | None:
    """Unit vector out of the object, base frame; None if it cannot be told."""
    finger = max(since.fingers, key=lambda f: norm(_force(f)))
    force = _force(finger)
    if finger.contact.status is ContactStatus.OK:
        x, y, z = finger.contact.normal.tolist()
        away = (-x, -y, -z)
    else:
        size = norm(force)
        if not 0.0 < size < math.inf:
            return None
        away = scale(1.0 / size, force)
    return rotate(since.arm.rotation_base_tip, away)


def _force(finger: FingerObservation) -> Vector:
    x, y, z, _, _, _ = finger.wrench
    return (x, y, z)
