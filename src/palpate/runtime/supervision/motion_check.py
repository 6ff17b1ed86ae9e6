"""Whether an arm moves as it reports: its positions must bear out its velocity."""

import math

from palpate.runtime.data import Observation
from palpate.runtime.supervision.finding import Cause, Violation
from palpate.spatial import ZERO, Vector

MEMORY = 0.5
"""Time constant [s] with which differences are forgotten, so that noise and filters of an arm do not add up."""

LARGEST_DIFFERENCE = 3e-3
"""Of displacement and integrated velocity [m]: an arm that creeps at 8 mm/s and reports rest reaches it in
0.7 s; below 6 mm/s, `LARGEST_DIFFERENCE` per `MEMORY`, it is not found."""

LONGEST_STEP = 0.02
"""From sample to sample [s]: over a longer gap velocity may have changed too much to be integrated."""


class MotionCheck:
    """Compares the tip's displacement with the integral of its reported velocity."""

    def __init__(self) -> None:
        """Begin without difference."""
        self._difference: Vector = ZERO
        self._uncertain = 0.0

    def broken(self, now: Observation, before: Observation | None) -> Violation | None:
        """Take a period; return what is wrong, if anything."""
        if before is None:
            return None
        time = now.arm.time - before.arm.time
        if not 0.0 < time <= LONGEST_STEP:
            return None
        keep, half = 1.0 - time / MEMORY, 0.5 * time
        x, y, z = now.arm.position_base_tip
        a, b, c = before.arm.position_base_tip
        u, v, w = now.arm.velocity_base_tip
        d, e, f = before.arm.velocity_base_tip
        p, q, r = self._difference
        p = keep * p + (x - a) - half * (u + d)
        q = keep * q + (y - b) - half * (v + e)
        r = keep * r + (z - c) - half * (w + f)
        self._difference = (p, q, r)
        size = math.hypot(p, q, r)
        # when a state was taken is known to its age: meanwhile the tip went this far
        self._uncertain = max(keep * self._uncertain, (now.time - now.arm.time) * math.hypot(u, v, w))
        most = LARGEST_DIFFERENCE + self._uncertain
        if size <= most:
            return None
        return Violation(
            "motion of the tip that the arm's reported velocity does not explain",
            f"{1e3 * size:.3g} mm within about {MEMORY:g} s",
            f"{1e3 * most:.3g} mm: check the arm's state stream",
            Cause.DEVICE,
        )
