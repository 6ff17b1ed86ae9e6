"""Whether what a finger feels and how the tip moves agree on directions: a sensor mounted wrongly does not.

A tip that runs into something is pushed back, against its motion. Where sensor, tip frame or arm base are mounted
or described the wrong way round, the force points elsewhere, and backing off along it would press harder.
"""

import math
from collections import deque

from palpate.runtime.data import Command, Observation, Phase
from palpate.runtime.supervision.aftermath import Aftermath
from palpate.runtime.supervision.finding import Cause, Violation
from palpate.runtime.supervision.run_guards import CONTACT_FORCE
from palpate.spatial import ZERO, Vector, add, dot, norm, rotate, scale, subtract

LARGEST_COSINE = -0.35
"""Of the angle between approach and first contact force: 110 degrees. A smooth flank of 70 degrees shows it,
or one of 84 degrees with mu = 0.3; an axis mounted at a right angle shows 90 degrees, or 107 with mu = 0.3."""

CLEAR_COSINE = -0.5
"""Likewise, from which on they agree for sure: 120 degrees. In between, the next periods decide."""

HISTORY = 0.05
"""Time before a trip [s] over which commanded motion and force rate are taken: delays of servo and sensor."""

SMALLEST_MOTION = 2e-4
"""That was commanded in that time [m]: less is no direction."""

ALONG = 0.35
"""Cosine of commanded motion and retreat, above which backing off goes on into what was run into: 70 degrees."""

LARGEST_RISE = 0.2
"""Share of the force at the trip that backing off may add to what the object itself would add by going on."""

FIRST_STEP = 2e-3
"""By then [m] backing off must have relieved something:"""

LEAST_RELIEF = 0.02
"""this share of the force at the trip, 0.4 N of 20 N: a contact of 200 N/m."""

STEADY = 0.5
"""Least ratio of the mean contact force before a trip to the mean of its size: noise and spikes have no direction.
Of a contact it is 1 but for noise, of 50 random readings 0.14."""

WEIGHT = "weight must turn with the arm; check the payload, and how the sensor is mounted"
"""What is wrong where a tip that only turns feels a force, and what to do."""

REMEDY = "check how sensor, tip and arm are mounted, and tcp, tip frame and sensor rotation in the robot file"


class DirectionCheck:
    """Watches the approach, the first contact and every retreat of a run.

    Attributes:
        agreed: Whether a contact has been made in an approach, and its force opposed the motion. From then on a
            retreat may follow the force, also ahead of an object that presses harder and harder.
    """

    def __init__(self, period: float) -> None:
        """Take the control period [s]."""
        self.agreed = False
        self._period = period
        self._recent: deque[tuple[Observation, Vector]] = deque(maxlen=max(2, math.ceil(HISTORY / period) + 1))
        self._moved: Vector = ZERO
        self._felt: Vector | None = None
        self._force, self._rate = 0.0, math.inf

    def first_contact(self, now: Observation, last: Command) -> Violation | None:
        """Take a period; return what is wrong if a finger touches in an approach and no contact has agreed yet.

        A tip that only turns touches nothing: what it feels then is weight that does not turn with the arm.

        Args:
            now: What is sensed.
            last: The command that led here.
        """
        self._recent.append((now, last.velocity_base_tip))
        if self.agreed:
            return None
        if last.phase is not Phase.APPROACH or now.hand is not None:
            return None
        speed = norm(last.velocity_base_tip)
        if speed == 0.0 and not any(last.angular_velocity_base_tip):
            return None
        for i, finger in enumerate(now.fingers):
            if finger.touching and speed == 0.0:
                felt, wanted = f"{norm(finger.force):.3g} N", f"that of a touch: {WEIGHT}"
                turning = f"force of finger {i + 1} while the tip turned in the air"
                return Violation(turning, felt, wanted, Cause.DEVICE)
            if finger.touching:
                force = rotate(now.arm.rotation_base_tip, finger.force)
                cosine = dot(force, last.velocity_base_tip) / (norm(force) * speed)
                if not cosine <= LARGEST_COSINE:
                    return disagreement(
                        f"angle between approach and first contact force of finger {i + 1}", cosine
                    )
                self.agreed = self.agreed or cosine <= CLEAR_COSINE
        return None

    def begin(self, aftermath: Aftermath) -> None:
        """Take the trip: how the tip was commanded to move and how the force rose before it."""
        self._force, self._felt = aftermath.force, None
        if self._recent:
            self._felt = _steady_force([now for now, _ in self._recent])
            first = self._recent[0][0]
            x, y, z = map(sum, zip(*(velocity for _, velocity in self._recent), strict=True))
            self._moved, time = scale(self._period, (x, y, z)), aftermath.first.time - first.time
            pushed = norm(self._moved) < SMALLEST_MOTION and time > 0.0  # by an object that came
            self._rate = max(0.0, self._force - CONTACT_FORCE.of(first)) / time if pushed else 0.0

    def objection(self, command: Command, now: Observation, aftermath: Aftermath) -> str:
        """Return why a reaction must not go on with a command; empty if it may.

        Args:
            command: Of the reaction.
            now: What is sensed.
            aftermath: Of the reaction until now.
        """
        speed = norm(command.velocity_base_tip)
        if speed == 0.0:
            return ""
        if self._felt is not None and dot(command.velocity_base_tip, self._felt) <= 0.0:
            return "did not back off: the contact was felt from another side until then, or from everywhere"
        if self.agreed:
            return ""
        away, moved = scale(1.0 / speed, command.velocity_base_tip), norm(self._moved)
        if moved >= SMALLEST_MOTION and dot(away, self._moved) > ALONG * moved:
            return f"did not back off: the measured force points along the motion that led there; {REMEDY}"
        gone = dot(subtract(now.arm.position_base_tip, aftermath.first.arm.position_base_tip), away)
        added = aftermath.force - self._force - self._rate * aftermath.duration
        if gone > 0.0 and added > LARGEST_RISE * self._force:
            return f"stopped because backing off added {added:.3g} N to {self._force:.3g} N; {REMEDY}"
        if gone > FIRST_STEP and added > -LEAST_RELIEF * self._force:
            return f"stopped because backing off {1e3 * gone:.0f} mm relieved nothing; {REMEDY}"
        return ""


def disagreement(angle: str, cosine: float) -> Violation:
    """Return the finding that an angle, of this cosine, is not what the mounting promises."""
    found, least = (math.degrees(math.acos(max(-1.0, min(1.0, each)))) for each in (cosine, LARGEST_COSINE))
    return Violation(angle, f"{found:.0f} degrees", f"{least:.0f} to 180 degrees: {REMEDY}", Cause.DEVICE)


def _steady_force(recent: list[Observation]) -> Vector | None:
    """Return the mean contact force of the only finger [N], base frame; zero if it has no direction.

    None if nothing was touched, or there are several fingers.
    """
    total, size = ZERO, 0.0
    for now in recent:
        if len(now.fingers) == 1 and now.fingers[0].touching:
            force = rotate(now.arm.rotation_base_tip, now.fingers[0].force)
            total, size = add(total, force), size + norm(force)
    if size == 0.0:
        return None
    return total if norm(total) >= STEADY * size else ZERO
