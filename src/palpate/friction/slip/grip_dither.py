"""A small dither of the grip force that distinguishes sticking from slipping."""

import math
from dataclasses import dataclass

from palpate.errors import InvalidValueError, check_positive

MIN_SAMPLES = 4
"""Per cycle: below, nothing is left between the ripple and half the sampling rate."""


@dataclass(frozen=True, slots=True)
class GripDither:
    """amplitude sin(2 pi frequency t) on top of the grip force.

    A contact that sticks bears what the load asks for, whatever the grip; one that slips bears mu f_n, ripple
    included. The frequency should lie well above what loads do, and the actuator must bear it: 0.3 N at 20 kN/m
    are 15 um, for which a piezo stack in the fingertip is made; a geared servo holds it up by its friction.

    Attributes:
        amplitude: [N].
        frequency: [Hz].
        most_share: Of the grip force that the amplitude may be: the ripple lets the grip go by this much.
    """

    amplitude: float = 0.3
    frequency: float = 250.0
    most_share: float = 0.15

    def __post_init__(self) -> None:
        check_positive(self, amplitude="N", frequency="Hz")
        if not 0.0 < self.most_share < 1.0:
            raise InvalidValueError(f"most_share = {self.most_share}: must lie between 0 and 1")

    def amplitude_at(self, grip_force: float) -> float:
        """Return the amplitude at a grip force [N]."""
        return min(self.amplitude, self.most_share * max(grip_force, 0.0))

    def force_at(self, time: float, grip_force: float) -> float:
        """Return what to add to a grip force [N] at a time [s]."""
        return self.amplitude_at(grip_force) * math.sin(2.0 * math.pi * self.frequency * time)

    def half_cycle(self, period: float) -> int:
        """Return the number of sampling periods nearest to half a cycle.

        Raises:
            InvalidValueError: There are less than four samples in a cycle.
        """
        if not MIN_SAMPLES * self.frequency * period <= 1.0 + 1e-9:
            raise InvalidValueError(
                f"frequency = {self.frequency:g} Hz at a period of {period:g} s: must leave {MIN_SAMPLES} "
                f"samples in a cycle; take at most {1.0 / (MIN_SAMPLES * period):g} Hz"
            )
        return round(0.5 / (self.frequency * period))
