"""Rolling, sliding and spinning told apart, for a fingertip on an object at rest.

In tip coordinates let v be the velocity of the tip frame's origin, w the tip's angular velocity, c the centroid,
n the normal there and c' the velocity of the centroid **in the tip frame**, as touch sees it migrate. The tip's
material point at c moves over the object with

    slip velocity   s = P (v + w x c),  P = 1 - n n'.

The place of contact moves over the tip with c' and, since its velocity in space is v + w x c + c', over the
object with s + c'. So the finger rolls where both surfaces are run over alike, s = 0, and slides by the
difference between the two. The rest of the relative motion is w: its part across n turns the tip over the
object (rolling rate), its part along n spins it in place (spin rate). A rigid contact allows no more: v + w x c
has no part along n.

The centroid also migrates without rolling: a tip that slides over a curved object without turning touches with
ever other points. And it trembles with the noise of the wrench. So rolling needs both, a centroid that migrates
and a tip that turns across n; the curvature of the object need not be known.
"""

import math
from collections import deque
from dataclasses import dataclass
from enum import Flag

from palpate.errors import InvalidValueError, not_negative
from palpate.spatial import ZERO, Vector, add, add_scaled, cross, dot, norm, scale


class ContactMotionKind(Flag):
    """What a contact does; kinds combine."""

    STILL = 0
    ROLLING = 1
    """The centroid migrates over the tip while the tip turns over the object."""
    SLIDING = 2
    """The tip's material moves over the object."""
    SPINNING = 4
    """The tip turns about the normal."""


@dataclass(frozen=True, slots=True)
class MotionThresholds:
    """What is too slow to count.

    Attributes:
        slip_speed: Of the tip's material over the object [m/s].
        migration_speed: Of the centroid over the tip [m/s]. Noise of standard deviation d, sampled every T, gives
            a slope over N samples the standard deviation d sqrt(12/N^3)/T: take three of them or more.
        roll_rate: Angular speed across the normal [rad/s].
        spin_rate: Angular speed about the normal [rad/s].
    """

    slip_speed: float = 1e-3
    migration_speed: float = 1e-3
    roll_rate: float = 0.02
    spin_rate: float = 0.02

    def __post_init__(self) -> None:
        not_negative("slip_speed", self.slip_speed, "m/s")
        not_negative("migration_speed", self.migration_speed, "m/s")
        not_negative("roll_rate", self.roll_rate, "rad/s")
        not_negative("spin_rate", self.spin_rate, "rad/s")


@dataclass(frozen=True, slots=True)
class ContactMotion:
    """How a contact moves, in tip coordinates.

    Attributes:
        time: When [s].
        slip_velocity: Of the tip's material at the centroid over the object [m/s].
        migration_velocity: Of the centroid over the tip [m/s].
        path_velocity: Of the contact over the object, in tip coordinates: the sum of both [m/s].
        roll_rate: Angular speed across the normal [rad/s].
        spin_rate: Angular velocity about the outward normal [rad/s], signed.
        separation_speed: Of the tip's material off the object [m/s]; zero for a rigid contact with an object at
            rest. If it is not, one of the two is not so, or the velocities are wrong.
        kind: What that makes.
    """

    time: float
    slip_velocity: Vector
    migration_velocity: Vector
    path_velocity: Vector
    roll_rate: float
    spin_rate: float
    separation_speed: float
    kind: ContactMotionKind


def contact_motion(
    time: float,
    centroid: Vector,
    normal: Vector,
    centroid_velocity: Vector,
    tip_velocity: Vector,
    tip_angular_velocity: Vector,
    thresholds: MotionThresholds,
) -> ContactMotion:
    """Return how the tip moves over an object at rest; all vectors in tip coordinates.

    Args:
        time: When [s].
        centroid: c [m].
        normal: n, outward.
        centroid_velocity: c', as seen from the tip [m/s].
        tip_velocity: v, of the tip frame's origin against the object [m/s].
        tip_angular_velocity: w, of the tip against the object [rad/s].
        thresholds: What is too slow to count.
    """
    material = add(tip_velocity, cross(tip_angular_velocity, centroid))
    approach = dot(material, normal)
    slip = add_scaled(material, -approach, normal)
    migration = add_scaled(centroid_velocity, -dot(centroid_velocity, normal), normal)
    spin_rate = dot(tip_angular_velocity, normal)
    roll_rate = norm(add_scaled(tip_angular_velocity, -spin_rate, normal))

    kind = ContactMotionKind.STILL
    if norm(migration) > thresholds.migration_speed and roll_rate > thresholds.roll_rate:
        kind |= ContactMotionKind.ROLLING
    if norm(slip) > thresholds.slip_speed:
        kind |= ContactMotionKind.SLIDING
    if abs(spin_rate) > thresholds.spin_rate:
        kind |= ContactMotionKind.SPINNING
    return ContactMotion(time, slip, migration, add(slip, migration), roll_rate, spin_rate, -approach, kind)


class ContactMotionTracker:
    """Follows one contact, sample by sample, over a short window.

    The centroid's velocity is the slope of the least-squares line through the window's samples. Everything else is
    their mean, so that all of it is delayed alike, by half the window: the time in the result says so.
    """

    def __init__(self, window: int = 15, thresholds: MotionThresholds | None = None) -> None:
        """Take the number of samples in the window, and what is too slow to count.

        Raises:
            InvalidValueError: Fewer than two samples.
        """
        if window < 2:
            raise InvalidValueError(f"window = {window}: a velocity needs at least 2 samples")
        self._samples: deque[tuple[float, Vector, Vector, Vector, Vector]] = deque(maxlen=window)
        self._thresholds = thresholds or MotionThresholds()

    def reset(self) -> None:
        """Forget all samples: at a landing, or when the contact was lost."""
        self._samples.clear()

    def step(
        self, time: float, centroid: Vector, normal: Vector, tip_velocity: Vector, tip_angular_velocity: Vector
    ) -> ContactMotion | None:
        """Take one sample of a contact with status OK; arguments are those of `contact_motion`.

        Returns:
            The motion in the middle of the window; None until it is full.

        Raises:
            InvalidValueError: Time did not advance, or a value is not finite.
        """
        sample = (time, centroid, normal, tip_velocity, tip_angular_velocity)
        if not math.isfinite(time + sum(map(sum, sample[1:]))):
            raise InvalidValueError(
                f"sample {sample}: every value must be finite; pass only contacts with status OK"
            )
        if self._samples and time <= self._samples[-1][0]:
            raise InvalidValueError(
                f"time = {time:g} s: samples must come in order, after the one at {self._samples[-1][0]:g} s"
            )
        self._samples.append(sample)
        if len(self._samples) < (self._samples.maxlen or 0):
            return None
        return self._motion()

    def _motion(self) -> ContactMotion:
        share = 1.0 / len(self._samples)
        middle = share * sum(sample[0] for sample in self._samples)
        c = n = v = w = slope = ZERO
        weight = 0.0
        for at, centroid, normal, velocity, turning in self._samples:
            late = at - middle
            weight += late * late
            c, n = add(c, centroid), add(n, normal)
            v, w = add(v, velocity), add(w, turning)
            slope = add_scaled(slope, late, centroid)
        return contact_motion(
            middle,
            scale(share, c),
            scale(1.0 / norm(n), n),
            scale(1.0 / weight, slope),
            scale(share, v),
            scale(share, w),
            self._thresholds,
        )
