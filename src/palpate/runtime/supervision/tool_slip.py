"""Slip of a held tool in the hand: by a load that its grip cannot bear, or by a surface that seems to give way.

Two signs. The force across the squeeze is compared with what friction and squeeze hold: where friction is known,
that tells before anything moves, of knocks and of a squeeze that fades. And a tip on a surface that stands still
moves along that surface: what it moves along the normal is, up to compression, how far the tool gave way. Force
control follows a tool that slips, so that slip shows as that motion, whatever is known of friction; but not a slow
one, of less than some millimetres a second, which errors of the normal look like, too.
"""

import math
from dataclasses import dataclass

from palpate.errors import check_positive
from palpate.friction.slip.place_watch import PlaceWatch, StandingPlace
from palpate.runtime.data import FingerObservation, Observation
from palpate.runtime.supervision.finding import Cause, Violation
from palpate.spatial import ZERO, Matrix, Vector, add, as_vector, cross, dot, norm, rotate

NORMAL: tuple[Vector, ...] = ((1.0, 0.0, 0.0),)
"""One direction: the motion along the normal is a number."""

STANDING = StandingPlace(jitter=5e-5, wander=3e-4)
"""How well it stands still: MEASURED with a pin of 6 mm, 30 mm below the fingers, at 1 N and 20 mm/s on a sphere
with a Nano17 behind each finger it wanders by 0.16 mm within 0.2 s at most, as its normals err."""

EXACT: Matrix = (ZERO, ZERO, ZERO)


@dataclass(frozen=True, slots=True)
class ToolGrip:
    """How a tool is held, for whoever watches it.

    Attributes:
        friction: Between fingertips and tool, as it is believed.
        load: Largest share of what friction holds that may be used.
        least_squeeze: Sum of the normal forces of all fingers [N] below which the squeeze has faded.
        least_force: Normal force [N] below which where it touches says nothing of slip.
        compliance: Of contact and grip together [m/N].
        across: Directions in which the squeeze itself bears nothing, unit vectors at right angles, tip frame.
    """

    friction: float
    load: float
    least_squeeze: float
    least_force: float
    compliance: float
    across: tuple[Vector, ...]

    def __post_init__(self) -> None:
        check_positive(self, friction="", load="", least_squeeze="N", least_force="N", compliance="m/N")


class ToolHeld:
    """The tool stays where it is in the hand. A `Condition`: the first finger is the tool, all others hold it.

    It remembers: one for each run.
    """

    def __init__(self, grip: ToolGrip, period: float) -> None:
        """Take how it is held, and the control period [s]."""
        self._grip, self._watch = grip, PlaceWatch(period, STANDING)
        self._time, self._arm_time = -math.inf, -math.inf
        self._moved, self._following = 0.0, False
        self._finding: Violation | None = None

    def broken(self, now: Observation, before: Observation | None) -> Violation | None:
        """See `Condition`."""
        if now.time != self._time:
            self._finding = self._overloaded(now) or self._gave_way(now)
            self._time = now.time
        return self._finding

    def _overloaded(self, now: Observation) -> Violation | None:
        grip, force = self._grip, now.fingers[0].force
        across = math.hypot(*(dot(force, each) for each in grip.across))
        squeeze = sum(_pressed(finger) for finger in now.fingers[1:])
        if squeeze < grip.least_squeeze:
            found, least = f"{squeeze:.3g} N", f"at least {grip.least_squeeze:.3g} N"
            return Violation("squeeze of the tool, all fingers together", found, least, Cause.GRIP)
        holds = grip.friction * squeeze
        if across <= grip.load * holds:
            return None
        most = f"{grip.load * holds:.3g} N, {100.0 * grip.load:.3g} % of what a squeeze of {squeeze:.3g} N holds"
        return Violation("load across the grip of the tool", f"{across:.3g} N", most, Cause.GRIP)

    def _gave_way(self, now: Observation) -> Violation | None:
        tool, arm = now.fingers[0], now.arm
        if not tool.believed or tool.contact.normal_force < self._grip.least_force:
            self._following = False
            return None
        if not self._following:
            self._watch.start(NORMAL)
            self._moved, self._following = 0.0, True
        else:
            at = rotate(arm.rotation_base_tip, as_vector(tool.contact.centroid))
            velocity = add(arm.velocity_base_tip, cross(arm.angular_velocity_base_tip, at))
            normal = rotate(arm.rotation_base_tip, as_vector(tool.contact.normal))
            self._moved += dot(velocity, normal) * (arm.time - self._arm_time)
        self._arm_time = arm.time
        gave_way = self._moved - self._grip.compliance * float(tool.contact.normal_force)
        if not self._watch.step((gave_way, 0.0, 0.0), EXACT):
            return None
        moved = f"{1e3 * norm(self._watch.moved):.2g} mm"
        return Violation("slip of the tool in the hand", moved, "none", Cause.GRIP)


def _pressed(finger: FingerObservation) -> float:
    force = float(finger.contact.normal_force)
    return force if force > 0.0 else 0.0  # not a number: it does not touch
