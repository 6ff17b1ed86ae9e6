"""Whether friction opposes sliding: on a sensor that is turned about the axis of touch it seems not to.

A straight push does not show such a turn (see `direction_check`); friction does, as it takes energy from whatever
slides and has no part across the motion. Without friction nothing shows it.
"""

import math

from palpate.runtime.data import Observation
from palpate.runtime.supervision.direction_check import LARGEST_COSINE, disagreement
from palpate.runtime.supervision.finding import Violation
from palpate.spatial import ZERO, Vector, add, as_vector, cross, dot, norm, rotate, scale, subtract

PATH = 3e-3
"""Over which friction is averaged [m]: six times the 0.5 mm that tip and arm give way before they slide."""

STRAIGHT = 0.95
"""Length of the mean direction over the last `PATH` from which on a path counts: 18 degrees on a circle of 9 mm.
On a narrower one friction lags behind the direction, by what gives way and, in MuJoCo, by acceleration across."""

SLOWEST = 1e-3
"""Speed along the surface [m/s] below which a tip may stick or creep."""

SLOWEST_TURN = 1e-2
"""Angular speed [rad/s] above which the contact moves otherwise than the tip: 0.1 mm/s on a tip of 10 mm."""

LEAST_SHARE, LEAST_FORCE = 0.1, 0.3
"""Of the normal force, and [N]: a tangential force up to their sum may be error of the zero; 0.3 N is the drift
from pose to pose of the largest sensor that palpate describes (preset `wrist`)."""


class SlidingCheck:
    """Compares friction with the tip's motion over the first `PATH` of straight sliding; then rests."""

    def __init__(self) -> None:
        """Begin with nothing slid."""
        self._agreed = False
        self._time = math.nan
        self._path = self._along = self._across = self._pressing = 0.0
        self._heading: Vector = ZERO

    def broken(self, now: Observation) -> Violation | None:
        """Take a period; return what is wrong, if anything."""
        if self._agreed or len(now.fingers) != 1 or now.hand is not None:
            return None
        finger, arm, before, self._time = now.fingers[0], now.arm, self._time, now.arm.time
        if not finger.believed or norm(arm.angular_velocity_base_tip) > SLOWEST_TURN:
            return None
        contact = finger.contact
        normal = rotate(arm.rotation_base_tip, as_vector(contact.normal))
        across = cross(normal, arm.velocity_base_tip)
        speed = norm(across)
        step = speed * (self._time - before)
        if not (speed >= SLOWEST and step > 0.0):
            return None
        share = 1.0 if self._heading == ZERO else -math.expm1(-step / PATH)
        self._heading = add(self._heading, scale(share, subtract(scale(1.0 / speed, across), self._heading)))
        if norm(self._heading) < STRAIGHT:
            return None
        friction = rotate(arm.rotation_base_tip, as_vector(contact.tangential_force))
        self._path += step
        self._pressing += step * contact.normal_force
        self._along += step * dot(friction, arm.velocity_base_tip) / speed
        self._across += step * dot(friction, across) / speed
        return self._verdict() if self._path >= PATH else None

    def _verdict(self) -> Violation | None:
        force = math.hypot(self._along, self._across)
        shows = force > LEAST_SHARE * self._pressing + LEAST_FORCE * self._path
        cosine = self._along / force if shows else math.nan
        self._agreed = cosine <= LARGEST_COSINE
        self._path = self._along = self._across = self._pressing = 0.0
        if self._agreed or not shows:
            return None
        return disagreement("angle between sliding and friction", cosine)
