"""Where a robot's time comes from, in robot files: what `pace` may be."""

import msgspec

from palpate.errors import InvalidValueError, not_negative
from palpate.runtime.pacing import Pacer, SimulatedTime
from palpate.runtime.real_time import Overrun, RealTime


class SimulatedPaceEntry(
    msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True, tag_field="kind", tag="simulated"
):
    """Periods take as long as they take to compute: for simulations alone."""

    def pacer(self, period: float) -> Pacer:
        """Return a pacer for a control period [s]."""
        return SimulatedTime()


class RealTimePaceEntry(
    msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True, tag_field="kind", tag="real_time"
):
    """Absolute deadlines: see `palpate.runtime.real_time.RealTime`.

    Attributes:
        overrun: What is done when a deadline was missed.
        spin: How long before a deadline to watch the clock instead of sleeping [s].
        priority: SCHED_FIFO priority to ask for, 1 to 99; None: an ordinary thread.
    """

    overrun: Overrun = Overrun.SKIP
    spin: float = msgspec.field(name="spin_s", default=0.0)
    priority: int | None = None

    def __post_init__(self) -> None:
        not_negative("spin_s", self.spin, "s")
        if self.priority is not None and not 1 <= self.priority <= 99:
            raise InvalidValueError(f"priority = {self.priority}: must be a whole number from 1 to 99")

    def pacer(self, period: float) -> Pacer:
        """Return a pacer for a control period [s].

        Raises:
            InvalidValueError: `spin` is not shorter than the period.
        """
        return RealTime(period, self.overrun, spin=self.spin, priority=self.priority)


PaceEntry = SimulatedPaceEntry | RealTimePaceEntry
"""Told apart by `kind`."""
