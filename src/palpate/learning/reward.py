"""Rewards of an episode."""

from dataclasses import dataclass
from typing import Protocol

from palpate.errors import check_positive, not_negative
from palpate.runtime import Observation
from palpate.runtime.supervision import Trip
from palpate.spatial import add_scaled, dot, norm, rotate


class Reward(Protocol):
    """Rates every control period; the reward of an action is the mean over its periods."""

    def start(self, first: Observation) -> None:
        """Begin an episode."""
        ...

    def step(self, now: Observation) -> float:
        """Return the reward of a period; the object may keep state."""
        ...

    def tripped(self, trip: Trip) -> float:
        """Return what is added when the supervisor ends an episode."""
        ...


@dataclass(frozen=True, slots=True)
class HoldWhileSliding:
    """Hold a normal force while the tip slides. A `Reward` from 0 to 1 without memory.

    It is (1 - |f_n - force| / force), not below 0, times the speed along the surface over `speed`, not above 1.
    Nothing is gained in the air, pressing with twice the force or more, or standing still.

    Attributes:
        force: Normal force to hold [N].
        speed: Along the surface, from which on the whole reward is given [m/s].
        trip_penalty: What it costs to be stopped by the supervisor, in actions done perfectly.
    """

    force: float = 2.0
    speed: float = 0.02
    trip_penalty: float = 10.0

    def __post_init__(self) -> None:
        check_positive(self, force="N", speed="m/s")
        not_negative("trip_penalty", self.trip_penalty, "")

    def start(self, first: Observation) -> None:
        """See `Reward`."""

    def step(self, now: Observation) -> float:
        """See `Reward`."""
        finger = now.fingers[0]
        if not finger.touching:
            return 0.0
        contact = finger.contact
        held = 1.0 - abs(contact.normal_force - self.force) / self.force
        if held <= 0.0:
            return 0.0
        x, y, z = contact.normal.tolist()
        normal, velocity = rotate(now.arm.rotation_base_tip, (x, y, z)), now.arm.velocity_base_tip
        slide = norm(add_scaled(velocity, -dot(velocity, normal), normal))
        return held * min(slide / self.speed, 1.0)

    def tripped(self, trip: Trip) -> float:
        """See `Reward`."""
        return -self.trip_penalty
