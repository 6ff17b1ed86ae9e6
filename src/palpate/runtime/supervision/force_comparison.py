"""Whether a fingertip's sensor feels the force that the arm itself measures: a dead sensor does not.

With a sensor that reports a constant, noise alone or a tenth of the load the controller presses harder and harder.
An arm that measures the force on what its flange carries shows it: an e-Series UR has a sensor there.
"""

from math import hypot

from palpate.runtime.data import Observation
from palpate.runtime.supervision.finding import Violation
from palpate.spatial import ZERO, Vector, add, rotate, scale, subtract

ACCURACY = 4.0
"""Of an arm's own force [N]: UR5e, data sheet."""

GAIN_ERROR = 0.1
"""Share of the force by which both may differ besides: calibrations and cross-talk, 5 % each."""

LARGEST_IMPULSE = 0.05
"""Integral over time of what the difference is beyond both [N s]: a difference of 10 N is found after 10 ms. As
much comes of a touch with 10 N that one of them shows 10 ms after the other. White noise of 1.5 N on each axis of
the difference, at 500 Hz, comes to it by chance once in 1e24 samples (Lundberg's bound)."""

FIRST = 0.1
"""Time from the start of a run [s] in which the difference is taken for the arm's zero: a payload that is set a
little wrong, a sensor that was not zeroed. From then on both are judged."""

LONGEST_STEP = 0.02
"""From sample to sample [s]: over a longer gap, a difference counts for so long."""

REMEDY = "check the fingertip's sensor, and the payload and zero of the arm's own"


class ForceComparison:
    """Compares the force of an arm's one finger with what the arm measures; silent without one of the two."""

    def __init__(self, limit: float) -> None:
        """Take the limit of the contact force [N], which holds for the arm's own, within its accuracy, too."""
        self._limit = limit
        self._began: float | None = None
        self._samples = 0
        self._offset: Vector = ZERO
        self._impulse = 0.0

    def broken(self, now: Observation, before: Observation | None) -> Violation | None:
        """Take a period; return what is wrong, if anything."""
        force = now.arm.tip_force_base
        if before is not None and (force is None) is not (before.arm.tip_force_base is None):
            return Violation("the arm's own force", "missing" if force is None else "new", "as in every period")
        if force is None or now.hand is not None or len(now.fingers) != 1:
            return None
        if before is None or self._began is None or now.time - self._began <= FIRST:
            self._tare(now, force)
            return None
        # by itself: calls of functions would be most of the time that this takes
        x, y, z, _, _, _ = now.fingers[0].wrench
        (a, b, c), (d, e, f), (g, h, i) = now.arm.rotation_base_tip
        (u, v, w), (k, m, n) = force, self._offset
        u, v, w = u - k, v - m, w - n
        apart = hypot(u - a * x - b * y - c * z, v - d * x - e * y - f * z, w - g * x - h * y - i * z)
        own = hypot(u, v, w)
        impulse = self._impulse + (apart - ACCURACY - GAIN_ERROR * own) * min(now.time - before.time, LONGEST_STEP)
        self._impulse = impulse if impulse > 0.0 else 0.0
        if own > self._limit + ACCURACY:
            return Violation(
                "contact force as the arm itself measures it",
                f"{own:.3g} N, by the fingertip's sensor {hypot(x, y, z):.3g} N,",
                f"{self._limit:g} N, and {ACCURACY:g} N for its accuracy: {REMEDY}",
            )
        if self._impulse <= LARGEST_IMPULSE:
            return None
        return Violation(
            "difference between the contact force that the arm itself measures and that of the fingertip's sensor",
            f"{apart:.3g} N ({own:.3g} N and {hypot(x, y, z):.3g} N)",
            f"{ACCURACY:g} N and {GAIN_ERROR:.0%} for longer than a touch lasts: {REMEDY}",
        )

    def _tare(self, now: Observation, force: Vector) -> None:
        """Take the mean difference until now for the arm's zero."""
        if self._began is None:
            self._began = now.time
        x, y, z, _, _, _ = now.fingers[0].wrench
        difference = subtract(force, rotate(now.arm.rotation_base_tip, (x, y, z)))
        self._samples += 1
        self._offset = add(self._offset, scale(1.0 / self._samples, subtract(difference, self._offset)))
