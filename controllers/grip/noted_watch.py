"""Slips that were told, kept for whoever looks at the run afterwards."""

from collections.abc import Sequence
from dataclasses import dataclass

from palpate.friction.contact_load import ContactLoad
from palpate.friction.slip.fingers import FingerSlips
from palpate.friction.slip.kinds import SlipKind


@dataclass(frozen=True, slots=True)
class SlipAlarm:
    """A slip that was told.

    Attributes:
        time: When [s].
        finger: Where.
        kind: Whether it slides or spins.
    """

    time: float
    finger: int
    kind: SlipKind


class NotedWatch:
    """Tells what its detectors tell, and keeps it. A `SlipWatch`."""

    def __init__(self, slips: FingerSlips) -> None:
        """Take the detectors."""
        self._slips = slips
        self._alarms: list[SlipAlarm] = []

    @property
    def alarms(self) -> tuple[SlipAlarm, ...]:
        """All that were told since the start."""
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


class UnheededWatch(NotedWatch):
    """Keeps what its detectors tell, and tells nobody: for a control that is not to answer. A `SlipWatch`."""

    @property
    def slipping(self) -> bool:
        """See `SlipWatch`."""
        return False

    def step(self, time: float, loads: Sequence[ContactLoad | None]) -> Sequence[bool]:
        """See `SlipWatch`."""
        super().step(time, loads)
        return (False,) * len(loads)


class DisabledWatch(NotedWatch):
    """Hears nothing: of fingers that share a load one may come up to its limit and hand on, and nothing slips."""

    @property
    def slipping(self) -> bool:
        """See `SlipWatch`."""
        return False

    def step(self, time: float, loads: Sequence[ContactLoad | None]) -> Sequence[bool]:
        """See `SlipWatch`."""
        return (False,) * len(loads)
