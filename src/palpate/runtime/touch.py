"""From samples to observations: what touch makes of what the devices said."""

from dataclasses import dataclass, field

import numpy as np

from palpate.errors import InvalidValueError, positive
from palpate.runtime.data import FingerObservation, Observation, Sample
from palpate.sensing.compensation import Payload, contact_wrench
from palpate.sensing.contact import Contact, ContactStatus
from palpate.sensing.solver import Surface, contact_from_wrench
from palpate.spatial import Wrench, norm


@dataclass(frozen=True, slots=True)
class Finger:
    """A fingertip and how its wrench becomes a contact.

    Attributes:
        surface: The fingertip, in the sensor frame.
        payload: What the sensor carries; its weight and inertia are taken off.
        touch_force: A force above this [N] is a touch,
        release_force: and the touch ends below this [N].
    """

    surface: Surface
    payload: Payload = field(default_factory=Payload)
    touch_force: float = 0.2
    release_force: float = 0.1

    def __post_init__(self) -> None:
        positive("touch_force", self.touch_force, "N")
        positive("release_force", self.release_force, "N")
        if self.release_force > self.touch_force:
            raise InvalidValueError(
                f"release_force = {self.release_force:g} N: must not exceed touch_force = {self.touch_force:g} N"
            )


class Touch:
    """Senses with one or more fingers; remembers only which of them touch."""

    def __init__(self, *fingers: Finger) -> None:
        """Take the fingers, in the order of the sample's wrenches.

        Raises:
            InvalidValueError: No finger given.
        """
        if not fingers:
            raise InvalidValueError("Touch() has no finger: give at least one")
        self.fingers = fingers
        for finger in fingers:  # compile what is not yet compiled: never in the loop
            contact_from_wrench(finger.surface, np.array([0.0, 0.0, -1.0, 0.0, 0.0, 0.0]))
        self._touching = [False] * len(fingers)

    def start(self) -> None:
        """Forget which fingers touch."""
        self._touching = [False] * len(self.fingers)

    def sense(self, sample: Sample) -> Observation:
        """Return what the sample means.

        Raises:
            InvalidValueError: The sample has another number of wrenches than there are fingers.
        """
        if len(sample.wrenches) != len(self.fingers):
            raise InvalidValueError(
                f"the sample has {len(sample.wrenches)} wrenches: there are {len(self.fingers)} fingers"
            )
        observed = []
        for i, finger in enumerate(self.fingers):
            given = sample.wrenches[i]
            wrench = contact_wrench(given.wrench, given.acceleration, finger.payload)
            contact = contact_from_wrench(finger.surface, np.array(wrench))
            self._touching[i] = _touches(wrench, contact, finger, self._touching[i])
            observed.append(FingerObservation(wrench, contact, self._touching[i]))
        return Observation(sample.time, sample.arm, tuple(observed))


def _touches(wrench: Wrench, contact: Contact, finger: Finger, before: bool) -> bool:
    threshold = finger.release_force if before else finger.touch_force
    return contact.status is ContactStatus.OK and norm(wrench[:3]) > threshold
