"""Bumpless transfer from approach to force control."""

from palpate.errors import positive

TRANSFER_SHARE = 0.5
"""Share of the settling time over which the set point is ramped; the rest is left for the force to settle."""


class BumplessTransfer:
    """Ramps the set point from the force measured at touch to the desired force.

    Force control starts with zero error, and so from standstill, whatever overshoot the impact has left.
    """

    def __init__(self, settle_time: float) -> None:
        """Take the settling time [s], of which the ramp takes `TRANSFER_SHARE`."""
        self._duration = TRANSFER_SHARE * positive("settle_time", settle_time, "s")
        self.reset()

    def reset(self) -> None:
        """Start the next ramp from the next measured force."""
        self._from: float | None = None
        self._since = 0.0

    def force(self, time: float, felt: float, wanted: float) -> float:
        """Return the set point for this period [N].

        Args:
            time: [s].
            felt: Measured normal force [N].
            wanted: Desired normal force [N].
        """
        if self._from is None:
            # an impact peak must not be held
            self._from, self._since = min(felt, wanted), time
        share = min(1.0, (time - self._since) / self._duration)
        return self._from + share * (wanted - self._from)
