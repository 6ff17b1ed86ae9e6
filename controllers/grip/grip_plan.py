"""Plans the normal force of each finger from the loads of all fingers."""

from collections.abc import Sequence
from typing import Protocol

from palpate.controllers.grip.belief import SurfaceBelief
from palpate.controllers.grip.load_ahead import LoadAhead
from palpate.controllers.grip.need import GripNeed, NeedWithSpin
from palpate.controllers.grip.parameters import GripParameters
from palpate.friction.contact_load import ContactLoad
from palpate.runtime.data import Observation

Loads = Sequence[ContactLoad | None]
"""What each finger bears, sensor frame; None where there is nothing to be believed."""


class GripPlan(Protocol):
    """Plans normal forces that hold the measured loads."""

    @property
    def needed(self) -> tuple[float, ...]:
        """Least force of each finger for the present load, without margin [N]; the last that all of them felt."""
        ...

    def start(self) -> None:
        """Forget what was needed, and all loads: something else has moved the fingers."""
        ...

    def wanted(self, now: Observation, loads: Loads, margin: float, missing: float = 1.0) -> tuple[float, ...]:
        """Take a period and return what its load and that of a little later want of each finger [N].

        Args:
            now: What is known.
            loads: Of it, what each finger bears.
            margin: Share of grip beyond the least.
            missing: What hangs over what is felt of it: above 1 where contacts slip.
        """
        ...

    def completed(self, forces: tuple[float, ...]) -> tuple[float, ...]:
        """Return forces that hold that load and are at least these: what one finger presses more, others bear."""
        ...

    def missing(self, wanted: tuple[float, ...], felt: tuple[float, ...]) -> tuple[float, ...]:
        """Return by how much each finger is to press more than it is felt to do [N]; below 0: less."""
        ...


class CommonGrip:
    """One grip for all fingers: the largest of what each of them needs for the share that it feels. A `GripPlan`.

    Each finger tells by its own sensor which share of the load it bears: nothing needs to be known of where the
    fingers are. Fingers opposite each other balance with one grip, and share alike.
    """

    def __init__(
        self,
        fingers: int,
        belief: SurfaceBelief,
        period: float,
        parameters: GripParameters | None = None,
        need: GripNeed | None = None,
    ) -> None:
        """Take the pieces.

        Args:
            fingers: How many there are.
            belief: What the contacts bear.
            period: Of control [s].
            parameters: How loads are followed; safe defaults if not given.
            need: From load to least grip; with spin if not given.
        """
        p = parameters or GripParameters()
        self._belief, self._need, self._lead = belief, need or NeedWithSpin(), p.lead
        self._ahead = tuple(LoadAhead(p.smoothing, period) for _ in range(fingers))
        self.start()

    def start(self) -> None:
        """See `GripPlan`."""
        self.needed = (0.0,) * len(self._ahead)
        for ahead in self._ahead:
            ahead.restart()

    def wanted(self, now: Observation, loads: Loads, margin: float, missing: float = 1.0) -> tuple[float, ...]:
        """See `GripPlan`; of a finger that feels nothing to be believed, the others."""
        most, now_most = 0.0, 0.0
        for i, load in enumerate(loads):
            ahead = self._ahead[i]
            if load is None:  # its last rate is that of a fall or a glitch, not of a load
                ahead.restart()
                continue
            ahead.step(load)
            surface = self._belief.surface(i)
            force, torque = ahead.ahead(0.0)
            need = self._need.least(surface, missing * force, missing * torque)
            force, torque = ahead.ahead(self._lead)
            later = self._need.least(surface, missing * force, missing * torque)
            now_most = max(now_most, need)
            most = max(most, need, later)
        if None not in loads:
            self.needed = (now_most,) * len(loads)
        return (most * (1.0 + margin),) * len(loads)

    def completed(self, forces: tuple[float, ...]) -> tuple[float, ...]:
        """See `GripPlan`: they are alike already."""
        return forces

    def missing(self, wanted: tuple[float, ...], felt: tuple[float, ...]) -> tuple[float, ...]:
        """See `GripPlan`: what the weakest lacks, for all."""
        return (wanted[0] - min(felt),) * len(wanted)
