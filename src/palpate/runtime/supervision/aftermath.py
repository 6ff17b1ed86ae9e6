"""What happened after a trip, summarised at its end."""

from palpate.runtime.data import Observation
from palpate.runtime.supervision.run_guards import CONTACT_FORCE
from palpate.spatial import norm, subtract


class Aftermath:
    """Watches a reaction.

    Attributes:
        first: What was sensed at the trip.
        duration: So far [s].
        distance: From where it tripped [m].
        farthest: Largest distance so far [m].
        hardest: Largest contact force of any finger so far [N].
        force: Of the finger that feels most, now [N].
    """

    def __init__(self, first: Observation) -> None:
        """Take the observation of the trip."""
        self.first = first
        self.duration = self.distance = self.farthest = 0.0
        self.force = self.hardest = CONTACT_FORCE.of(first)

    def add(self, now: Observation) -> None:
        """Take a period."""
        self.duration = now.time - self.first.time
        self.distance = norm(subtract(now.arm.position_base_tip, self.first.arm.position_base_tip))
        self.force = CONTACT_FORCE.of(now)
        if self.distance > self.farthest:
            self.farthest = self.distance
        if self.force > self.hardest:
            self.hardest = self.force

    @property
    def moved(self) -> bool:
        """Whether it took any time: a plain stop takes none."""
        return self.duration > 0.0

    def summary(self, why: str = "") -> str:
        """Return a sentence for the log.

        Args:
            why: It ended early; empty if it did not.
        """
        words = (
            f"backed off {1e3 * self.farthest:.1f} mm within {self.duration:.2f} s, "
            f"felt at most {self.hardest:.3g} N and {self.force:.3g} N at the end"
        )
        return f"{words} ({why})" if why else words
