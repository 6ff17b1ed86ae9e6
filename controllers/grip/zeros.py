"""What a grip knows of the zeros of its fingers' sensors."""

from typing import Protocol

from palpate.friction.limit_surface import LimitSurface
from palpate.runtime.data import Observation


class Zeros(Protocol):
    """The zeros of the fingers' sensors, which wander after a tare."""

    @property
    def resting(self) -> bool:
        """Whether hand and load are at rest, so that what changes slowly are the zeros."""
        ...

    @property
    def hidden(self) -> float:
        """Share by which the load may have grown, where that was taken for a zero that wanders."""
        ...

    def start(self) -> None:
        """A run begins: the sensors were tared just now."""
        ...

    def step(self, now: Observation, forces: tuple[float, ...]) -> Observation:
        """Return what the fingers feel beyond their zeros.

        Args:
            now: What they feel.
            forces: With which each was told to press in the period before [N]; empty: not at all.
        """
        ...

    def reserve(self, surface: LimitSurface) -> float:
        """Return by how much more a contact is to press for what its zero may have wandered unseen [N]."""
        ...


class SteadyZeros:
    """Zeros that do not wander. `Zeros`."""

    resting = False
    hidden = 0.0

    def start(self) -> None:
        """It remembers nothing."""

    def step(self, now: Observation, forces: tuple[float, ...]) -> Observation:
        """See `Zeros`."""
        return now

    def reserve(self, surface: LimitSurface) -> float:
        """See `Zeros`: nothing."""
        return 0.0
