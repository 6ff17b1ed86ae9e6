"""Slip detection that records its alarms for the report of the run."""

from collections.abc import Sequence
from dataclasses import dataclass

from palpate.friction.contact_load import ContactLoad
from palpate.friction.slip.fingers import FingerSlips
from palpate.friction.slip.kinds import SlipKind


@dataclass(frozen=True, slots=True)
class SlipAlarm:
    """A detected slip.

    Attributes:
        time: When [s].
        finger: Where.
        kind: Whether it slides or spins.
    """

    time: float
    finger: int
    kind: SlipKind


class RecordingWatch:
    """Passes on the alarms of its detectors and records them. A `SlipWatch`."""

    def __init__(self, slips: FingerSlips) -> None:
        """Take the detectors."""
        self._slips = slips
        self._alarms: list[SlipAlarm] = []

    @property
    def alarms(self) -> tuple[SlipAlarm, ...]:
        """All alarms since the start."""
        return tuple(self._alarms)

    @property
    def slipping(self) -> bool:
        """See `SlipWatch`."""
        return self._slips.slipping

    def start(self) -> None:
        """A new grip begins."""
        self._slips.start()
        self._alarms.clear()

    def step(self, time: float, loads: Sequence[ContactLoad | None]) -> Sequence[bool]:
        """See `SlipWatch`."""
        onsets = self._slips.step(time, loads)
        if True in onsets:
            for i, kind in enumerate(self._slips.kinds):
                if onsets[i] and kind is not None:
                    self._alarms.append(SlipAlarm(time, i, kind))
        return onsets


class PassiveWatch(RecordingWatch):
    """Records the alarms of its detectors, without reporting them to the grip. A `SlipWatch`."""

    @property
    def slipping(self) -> bool:
        """See `SlipWatch`."""
        return False

    def step(self, time: float, loads: Sequence[ContactLoad | None]) -> Sequence[bool]:
        """See `SlipWatch`."""
        super().step(time, loads)
        return (False,) * len(loads)


class DisabledWatch(RecordingWatch):
    """Runs no detector: where fingers share a load, one may reach its limit without any slip of the object."""

    @property
    def slipping(self) -> bool:
        """See `SlipWatch`."""
        return False

    def step(self, time: float, loads: Sequence[ContactLoad | None]) -> Sequence[bool]:
        """See `SlipWatch`."""
        return (False,) * len(loads)
