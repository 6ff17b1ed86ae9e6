"""Inputs of a grip controller: the limit surface of each contact, and detection of slip."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

from palpate.friction.contact_load import ContactLoad
from palpate.friction.limit_surface import LimitSurface


class SurfaceBelief(Protocol):
    """The limit surface assumed for each contact. An adaptive one learns in `watch`."""

    def start(self) -> None:
        """A new grip begins."""
        ...

    def surface(self, finger: int) -> LimitSurface:
        """Return what to plan with for a finger; the controller's margin comes on top of it."""
        ...

    def watch(self, time: float, loads: Sequence[ContactLoad | None], onsets: Sequence[bool]) -> None:
        """Take what was felt in this period.

        Args:
            time: Of the period [s].
            loads: One per finger, sensor frame; None where there is none to be believed.
            onsets: One per finger: whether slip begins there.
        """
        ...


class SlipWatch(Protocol):
    """Detects the onset of slip."""

    @property
    def slipping(self) -> bool:
        """Whether a detected slip continues."""
        ...

    def start(self) -> None:
        """A new grip begins."""
        ...

    def step(self, time: float, loads: Sequence[ContactLoad | None]) -> Sequence[bool]:
        """Return for each finger whether slip begins there.

        Args:
            time: Of the period [s].
            loads: One per finger, sensor frame; None where there is none to be believed.
        """
        ...


@dataclass(frozen=True, slots=True)
class KnownSurface:
    """One limit surface for all fingers, as touch found it before. A `SurfaceBelief` that learns nothing.

    Attributes:
        known: It.
    """

    known: LimitSurface

    def start(self) -> None:
        """It remembers nothing."""

    def surface(self, finger: int) -> LimitSurface:
        """See `SurfaceBelief`."""
        return self.known

    def watch(self, time: float, loads: Sequence[ContactLoad | None], onsets: Sequence[bool]) -> None:
        """It learns nothing."""


class NoSlipWatch:
    """Never detects slip. A `SlipWatch`."""

    @property
    def slipping(self) -> bool:
        """See `SlipWatch`."""
        return False

    def start(self) -> None:
        """It remembers nothing."""

    def step(self, time: float, loads: Sequence[ContactLoad | None]) -> Sequence[bool]:
        """See `SlipWatch`."""
        return (False,) * len(loads)
