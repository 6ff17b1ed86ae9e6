"""Whether a fingertip's sensor feels the force that the arm itself measures: a dead sensor does not.

With a sensor that reports a constant, noise alone or a tenth of the load the controller presses harder and harder.
An arm that measures the force on what its flange carries shows it: an e-Series UR has a sensor there.
"""

from palpate.runtime.data import Observation
from palpate.runtime.supervision.finding import Violation
from palpate.spatial import ZERO, Vector, add, norm, rotate, scale, subtract

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

DIFFERENT = "check the fingertip's sensor, and the payload and zero of the arm's own"


class ForceComparison:
    """Compares the force of an arm's one finger with what the arm measures; silent without one of the two."""

    def __init__(self, limit: float) -> None:
        """Take the limit of the contact force [N], which holds for the arm's own, within its accuracy, too."""
        self._limit = limit
        self._began: float | None = None
        self._samples, self._sum = 0, ZERO
        self._offset: Vector = ZERO
        self._impulse = 0.0

    def broken(self, now: Observation, before: Observation | None) -> Violation | None:
        """Take a period; return what is wrong, if anything."""
        force = now.arm.tip_force_base
        if before is not None and (force is None) is not (before.arm.tip_force_base is None):
            return Violation("the arm's own force", "missing" if force is None else "new", "as in every period")
        if force is None or now.hand is not None or len(now.fingers) != 1:
            return None
        x, y, z, _, _, _ = now.fingers[0].wrench
        felt = rotate(now.arm.rotation_base_tip, (x, y, z))
        difference = subtract(force, felt)
        if self._began is None or before is None:
            self._began = now.time
        if now.time - self._began <= FIRST:
            self._samples += 1
            self._sum = add(self._sum, difference)
            self._offset = scale(1.0 / self._samples, self._sum)
            return None
        apart, own = norm(subtract(difference, self._offset)), norm(subtract(force, self._offset))
        if own > self._limit + ACCURACY:
            return Violation(
                "contact force as the arm itself measures it",
                f"{own:.3g} N (the fingertip's sensor: {norm(felt):.3g} N)",
                f"{self._limit:g} N, and {ACCURACY:g} N for its accuracy: {DIFFERENT}",
            )
        step = min(now.time - before.time, LONGEST_STEP) if before is not None else 0.0
        self._impulse = max(0.0, self._impulse + (apart - ACCURACY - GAIN_ERROR * own) * step)
        if self._impulse <= LARGEST_IMPULSE:
            return None
        return Violation(
            "difference of the arm's own force and that of the fingertip's sensor",
            f"{apart:.3g} N ({own:.3g} N against {norm(felt):.3g} N)",
            f"{ACCURACY:g} N + {GAIN_ERROR:.0%} but for {LARGEST_IMPULSE:g} N s: {DIFFERENT}",
        )
