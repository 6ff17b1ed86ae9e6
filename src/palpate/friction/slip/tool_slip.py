"""Slip of a tool in the hand, while it touches a thing that stands still.

Three signs, each by itself:

- The place where it touches, in the base frame, has moved: the hand went on, and the tool did not go with it. The
  line of force runs through the thing wherever the tool is believed to be, and where it meets the tool's believed
  surface is the place: so what shows is slip along the contact's normal, which is where a tool is pushed to. Slip
  across it leaves no trace in the wrench, on a smooth tool that touches at its side.
- The places where the fingers touch the tool have moved on the fingertips: it rolls or turns between them.
- What the fingers bear by friction has fallen, though the hand does not let off: `LoadFall`.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import StrEnum

from palpate.friction.slip.load_fall import LoadFall
from palpate.friction.slip.place_watch import PlaceWatch, StandingPlace
from palpate.sensing.held.felt_place import BLOCK, FeltPlace
from palpate.spatial import IDENTITY, Vector

TOUCHING = StandingPlace()
"""Of the place where a tool touches."""

GRIPPING = StandingPlace(jitter=5e-5, wander=3e-4)
"""Of the places where fingertips of 10 mm hold a tool, which tilts by hundredths of a radian as loads change."""


class SlipSign(StrEnum):
    """What tells that the tool has slipped."""

    PLACE = "place"
    """It seems to touch elsewhere."""
    GRIP = "grip"
    """The fingers touch it elsewhere on them."""
    LOAD = "load"
    """What the fingers bear has fallen."""


@dataclass(frozen=True, slots=True)
class BorneLoad:
    """What the fingers bear by friction.

    Attributes:
        size: |f| of the environment's force, or of a finger's tangential one [N].
        deviation: Standard deviation of a sample [N].
        steady: Whether the hand keeps up what it does; if it lets off itself, a fall says nothing.
    """

    size: float
    deviation: float
    steady: bool = True


class ToolSlip:
    """Listens to all three. One call of `step` per period; begins anew with `start`, at each touch.

    Attributes:
        touching: The watch over the place where the tool touches; its `moved` says by how much.
        gripping: One for each finger.
    """

    def __init__(
        self,
        period: float,
        fingers: int,
        touching: StandingPlace = TOUCHING,
        gripping: StandingPlace = GRIPPING,
        every: int = BLOCK,
    ) -> None:
        """Set it up.

        Args:
            period: [s]
            fingers: How many hold the tool.
            touching: How well the place where it touches stands still; its time between false alarms is that of
                all places together.
            gripping: Likewise of the fingers' places; its time between false alarms does not count.
            every: Periods from one place to the next, as `PlaceFelt` gives them.
        """
        each = (1 + fingers) * touching.false_alarm_time
        self.touching = PlaceWatch(every * period, replace(touching, false_alarm_time=each))
        self.gripping = tuple(
            PlaceWatch(every * period, replace(gripping, false_alarm_time=each)) for _ in range(fingers)
        )
        self._fall = LoadFall(period)

    def start(self, directions: Sequence[Vector] = IDENTITY) -> None:
        """The tool touches, from now on.

        Args:
            directions: Along which the thing holds the place, base frame; see `PlaceWatch.start`.
        """
        self.touching.start(directions)
        for watch in self.gripping:
            watch.start()
        self._fall.start()

    def step(
        self,
        touched: FeltPlace | None,
        gripped: Sequence[FeltPlace | None] = (),
        load: BorneLoad | None = None,
    ) -> SlipSign | None:
        """Take one period; return what tells of slip, for a place from then on.

        Args:
            touched: Where the tool touches, base frame; None: not told.
            gripped: Where each finger touches it, in the finger's sensor frame.
            load: What the fingers bear.
        """
        if touched is not None:
            self.touching.step(touched.position, touched.covariance, touched.drift)
        for watch, place in zip(self.gripping, gripped, strict=False):
            if place is not None:
                watch.step(place.position, place.covariance, place.drift)
        fell = False
        if load is None or not load.steady:
            self._fall.restart()
        else:
            fell = self._fall.step(load.size, load.deviation)
        if self.touching.alarm:
            return SlipSign.PLACE
        if any(watch.alarm for watch in self.gripping):
            return SlipSign.GRIP
        return SlipSign.LOAD if fell else None
