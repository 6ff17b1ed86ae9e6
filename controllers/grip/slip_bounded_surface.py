"""A limit surface that is no larger than what slipping contacts have shown of it."""

import math
from collections.abc import Sequence
from dataclasses import replace

from palpate.controllers.grip.belief import SurfaceBelief
from palpate.friction.contact_load import ContactLoad
from palpate.friction.limit_surface import LimitSurface

LEAST_LEFT = 0.45
"""Share of its friction that a contact can have lost at once: half, and the sensors' error. What loses more is
heard again. A load that goes away shows less and less friction, until it is told from a slip."""


REGAINS, SLOWEST = 60.0, 960.0
"""[s] A margin of 12 % is used up after 7 s, and then after twice that: 0.1 mm of slip each."""

BORNE = 0.1
"""[s] Time constant of the mean of what a contact bears."""


class SlipBoundedSurface:
    """What another belief says, its friction at most what each contact showed as it slipped. A `SurfaceBelief`.

    Downwards at once: what slips shows its limit. Upwards at once to what a contact is seen to bear, and beyond
    slowly: by a factor of e in `REGAINS`, and half as fast after each slip that this leads to.
    """

    def __init__(self, belief: SurfaceBelief) -> None:
        """Take what is believed otherwise."""
        self.believed = belief
        self.start()

    def start(self) -> None:
        """A new grip begins."""
        self.believed.start()
        self._bounds: dict[int, float] = {}
        self._bounded: dict[int, tuple[LimitSurface, LimitSurface]] = {}  # what was believed, and that, bounded
        self._before: dict[int, float] = {}
        self._borne: dict[int, float] = {}
        self._regains, self._time = REGAINS, math.inf

    def surface(self, finger: int) -> LimitSurface:
        """See `SurfaceBelief`."""
        surface = self.believed.surface(finger)
        if not self._bounds:
            return surface
        bound = self._bounds.get(finger, math.inf)
        if surface.friction <= bound:
            return surface
        known = self._bounded.get(finger)
        if known is None or known[0] is not surface or known[1].friction != bound:
            known = self._bounded[finger] = (surface, replace(surface, friction=bound))
        return known[1]

    def watch(self, time: float, loads: Sequence[ContactLoad | None], onsets: Sequence[bool]) -> None:
        """See `SurfaceBelief`."""
        self.believed.watch(time, loads, onsets)
        gone, self._time = max(time - self._time, 0.0), time
        for finger, bound in tuple(self._bounds.items()):
            surface, load = self.believed.surface(finger), loads[finger]
            if load is None or onsets[finger]:
                self._borne.pop(finger, None)
                continue
            ratio = surface.friction * surface.load_ratio(
                load.normal_force, load.tangential_length, load.spin_torque
            )
            before = self._borne.get(finger, bound)
            borne = self._borne[finger] = before + (ratio - before) * -math.expm1(-gone / BORNE)
            bound = max(bound * math.exp(gone / self._regains), borne)
            if bound < surface.friction:
                self._bounds[finger] = bound
            else:
                del self._bounds[finger]

    def show(self, friction: Sequence[float], borne: Sequence[float]) -> None:
        """Take what contacts show as they slip.

        Contacts that do not slip are of the same materials: they may have lost the same share of their friction,
        but bear what they bear.

        Args:
            friction: Of each contact; infinite where it shows none.
            borne: Load ratio of each.
        """
        believed = [self.believed.surface(i).friction for i in range(len(friction))]
        before = [min(self._before.get(i, math.inf), mu) for i, mu in enumerate(believed)]
        shown = [max(mu, LEAST_LEFT * was) for mu, was in zip(friction, before, strict=True)]
        left = min(mu / was for mu, was in zip(shown, before, strict=True))
        for finger, mu in enumerate(shown):
            bound = min(mu, max(left * before[finger], borne[finger]))
            if bound < self._bounds.get(finger, math.inf):
                self._bounds[finger] = bound

    def keep(self) -> None:
        """What was shown so far was so, and something slips again."""
        if self._bounds:
            self._regains = min(2.0 * self._regains, SLOWEST)
        self._before = dict(self._bounds)

    def forget(self) -> None:
        """Nothing that was shown was slip."""
        self._bounds, self._before = {}, {}

    def take_back(self) -> None:
        """What was shown since the last `keep` was no slip."""
        self._bounds = dict(self._before)
