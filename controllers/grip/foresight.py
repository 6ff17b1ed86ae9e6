"""Raises a grip before what is expected acts.

For what will hang a contact needs no more than what it needs now, and what the expected load alone needs: the
least normal force is subadditive (see `palpate.controllers.grip.zero_wander`). That is what the fingers are to
press with when it begins. They begin earlier by what the actuator takes: its lag, and the way at its rate.

What is expected is forgotten when it is over: by then the fingers feel it. What they needed before is taken once,
when its turn begins, or it would count twice.
"""

from collections.abc import Iterable, Sequence

from palpate.controllers.grip.expected_load import ExpectedLoad
from palpate.friction.limit_surface import LimitSurface

Forces = tuple[float, ...]


class Foresight:
    """What is expected of the load, and what grip that takes. Part of a grip; one call of `least` per period."""

    def __init__(self, lag: float, rate: float) -> None:
        """Take the actuator's lag [s], and how fast the grip may rise [N/s]."""
        self._lag, self._rate = lag, rate
        self.start()

    def start(self) -> None:
        """Nothing is expected."""
        self._coming: tuple[ExpectedLoad, ...] = ()
        self._raised: dict[ExpectedLoad, Forces] = {}

    @property
    def expects(self) -> bool:
        """Whether anything is expected."""
        return bool(self._coming)

    def expect(self, loads: Iterable[ExpectedLoad]) -> None:
        """Take what is expected; what is known already counts once."""
        for load in loads:
            if load not in self._coming:
                self._coming = (*self._coming, load)

    def least(
        self, time: float, needed: Forces, surfaces: Sequence[LimitSurface], margin: float, at: Forces
    ) -> Forces:
        """Return with which force each finger is to press at least for what comes [N]; 0: nothing comes.

        Args:
            time: Now [s].
            needed: Least force for what hangs now [N].
            surfaces: What each contact bears.
            margin: Share beyond.
            at: With which force each presses [N].
        """
        least = (0.0,) * len(needed)
        if not self._coming:
            return least
        self._coming = tuple(load for load in self._coming if time <= load.end)
        self._raised = {load: forces for load, forces in self._raised.items() if load in self._coming}
        for load in self._coming:
            forces = self._raised.get(load) or _for_both(load, needed, surfaces, margin)
            way = max(0.0, *(most - now for most, now in zip(forces, at, strict=True)))
            if load in self._raised or time >= load.begin - self._lag - way / self._rate:
                self._raised[load] = forces
                least = tuple(max(a, b) for a, b in zip(least, forces, strict=True))
        return least


def _for_both(load: ExpectedLoad, needed: Forces, surfaces: Sequence[LimitSurface], margin: float) -> Forces:
    """For what hangs and what comes, shared alike."""
    n = len(needed)
    return tuple(
        (1.0 + margin) * ((1.0 + load.more) * need + surface.least_normal_force(load.force / n, load.moment / n))
        for need, surface in zip(needed, surfaces, strict=True)
    )
