"""Whether what a finger feels and how the tip moves agree on directions: a sensor mounted wrongly does not.

A tip that runs into something is pushed back, against its motion. Where sensor, tip frame or arm base are mounted
or described the wrong way round, the force points elsewhere, and backing off along it would press harder.
"""

import math
from collections import deque
from math import hypot

from palpate.compiling import njit
from palpate.errors import FloatArray
from palpate.runtime.data import Command, Observation
from palpate.runtime.supervision.aftermath import Aftermath
from palpate.runtime.supervision.finding import Cause, Violation
from palpate.runtime.supervision.observed_row import FINGER, FINGERS, FORCE, HAND_JOINTS, ROTATION, TOUCHING
from palpate.runtime.supervision.run_guards import CONTACT_FORCE
from palpate.runtime.supervision.turned import turned_by
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


AGREED, COSINE = 0, 1
"""Numbers that are remembered of the approach: whether a contact has been made in it whose force opposed the
motion, and the cosine of the last one."""

MEMORY_SIZE = 2


@njit(error_model="numpy", cache=True)
def first_contact_fault(
    row: FloatArray, finger: int, approach: bool, command: FloatArray, memory: FloatArray
) -> int:
    """Return which finger's first contact in an approach, counted from 1, is wrong; 0: none.

    A tip that only turns touches nothing: what it feels then is weight that does not turn with the arm.

    Args:
        row: See `palpate.runtime.supervision.observed_row`.
        finger: Where the first finger stands.
        approach: Whether the last command was one of an approach.
        command: The velocities that led here: of the tip and of its turning, six numbers.
        memory: Written, zeros at first, shape (`MEMORY_SIZE`,).
    """
    if memory[AGREED] != 0.0 or not approach or row[HAND_JOINTS] >= 0.0:
        return 0
    v0, v1, v2 = command[0], command[1], command[2]
    speed = hypot(hypot(v0, v1), v2)
    if speed == 0.0 and command[3] == 0.0 and command[4] == 0.0 and command[5] == 0.0:
        return 0
    for i in range(int(row[FINGERS])):
        at = finger + FINGER * i
        if row[at + TOUCHING] == 0.0:
            continue
        if speed == 0.0:
            return i + 1
        f0, f1, f2 = row[at + FORCE], row[at + FORCE + 1], row[at + FORCE + 2]
        force = hypot(hypot(f0, f1), f2)
        f0, f1, f2 = turned_by(row[ROTATION : ROTATION + 9], f0, f1, f2)
        memory[COSINE] = (f0 * v0 + f1 * v1 + f2 * v2) / (force * speed)
        if not memory[COSINE] <= LARGEST_COSINE:
            return i + 1
        if memory[COSINE] <= CLEAR_COSINE:
            memory[AGREED] = 1.0
    return 0


def first_contact_finding(fault: int, now: Observation, last: Command, memory: FloatArray) -> Violation:
    """Return the finding that goes with what `first_contact_fault` returned.

    Args:
        fault: That.
        now: What is sensed.
        last: The command that led here.
        memory: What is remembered.
    """
    if norm(last.velocity_base_tip) > 0.0:
        return disagreement(f"angle between approach and first contact force of finger {fault}", memory[COSINE])
    felt, wanted = f"{norm(now.fingers[fault - 1].force):.3g} N", f"that of a touch: {WEIGHT}"
    return Violation(f"force of finger {fault} while the tip turned in the air", felt, wanted, Cause.DEVICE)


class DirectionCheck:
    """Watches every retreat of a run: it must not lead on into what was touched."""

    def __init__(self, period: float, memory: FloatArray) -> None:
        """Begin.

        Args:
            period: Of control [s].
            memory: Of `first_contact_fault`. From when a contact has agreed a retreat may follow the force, also
                ahead of an object that presses harder and harder.
        """
        self._memory = memory
        self._period = period
        self._recent: deque[tuple[Observation, Vector]] = deque(maxlen=max(2, math.ceil(HISTORY / period) + 1))
        self.add = self._recent.append
        """Take what was observed in a period, and the velocity that was commanded in the last [m/s]."""
        self._moved: Vector = ZERO
        self._felt: Vector | None = None
        self._force, self._rate = 0.0, math.inf

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
        if self._memory[AGREED]:
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
