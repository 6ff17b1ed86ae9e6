"""Whether moments can be in the unit that they are read in: what a tip feels has an arm of about its size."""

import numpy as np

from palpate.errors import FloatArray, InvalidValueError
from palpate.estimation import Assumption, BrokenAssumption
from palpate.sensing.ft.arrays import OTHER_MOMENT_UNIT

ARM = 10.0
"""Distances from the sensor to the far end of the tip, above which the arm of moments is in another unit: contacts
are within one, spin adds less than another, and mN m for N m make a thousand."""

HUGE = 1e300
"""[N m]. Beyond any sensor; sums of three stay numbers."""

FEWEST = 20
"""Rows of a live source before it is judged."""


class MomentUnits:
    """Counts moments whose arm is too long; single ones are wrong readings, most of them a wrong unit."""

    def __init__(self, reach: float, *, endless: bool) -> None:
        """Take the fingertip.

        Args:
            reach: Distance from the sensor to its far end [m]; its thickness if it is endless.
            endless: Whether it is modelled without an end: a contact far out then has a long arm, but spin, the
                moment along the force, has none.
        """
        self._longest, self._endless = ARM * reach, endless
        self._rows = self._too_long = 0

    def take(self, wrenches: FloatArray) -> None:
        """Take further rows, shape (n, 6) [N, N m].

        Raises:
            InvalidValueError: As `judge`, once there are enough of them.
        """
        rows = wrenches[np.isfinite(wrenches).all(axis=1) & wrenches[:, :3].any(axis=1)]
        force = np.abs(rows[:, :3]).max(axis=1, initial=0.0)
        if self._endless:
            direction = rows[:, :3] / force[:, None]
            direction /= np.linalg.norm(direction, axis=1)[:, None]
            moment = np.abs((np.clip(rows[:, 3:], -HUGE, HUGE) * direction).sum(axis=1))
        else:
            moment = np.abs(rows[:, 3:]).max(axis=1, initial=0.0)
        self._rows += len(rows)
        self._too_long += int((moment / self._longest > force).sum())
        if self._rows >= FEWEST:
            self.judge()

    def judge(self) -> None:
        """Do nothing if most moments that were taken are those of a fingertip of this size.

        Raises:
            InvalidValueError: The arm of most is too long.
        """
        if 2 * self._too_long > self._rows:
            broken = BrokenAssumption(
                Assumption.PLAUSIBLE,
                f"{self._too_long} of {self._rows} moments have an arm above {self._longest:.3g} m, {ARM:g} "
                "times as long as the fingertip reaches",
                OTHER_MOMENT_UNIT,
            )
            raise InvalidValueError(str(broken))
