"""Numbers that can be taken from an observation and compared with a limit."""

from collections.abc import Callable
from dataclasses import dataclass

from palpate.runtime.data import Observation
from palpate.sensing.contact import ContactStatus
from palpate.spatial import ZERO, norm


@dataclass(frozen=True, slots=True)
class MonitoredQuantity:
    """A number with a name.

    Attributes:
        name: For people.
        unit: Of the number.
        of: Takes it from an observation; not finite counts as out of bounds.
    """

    name: str
    unit: str
    of: Callable[[Observation], float]


def _contact_force(now: Observation) -> float:
    largest = 0.0
    for finger in now.fingers:
        x, y, z, _, _, _ = finger.wrench
        size = norm((x, y, z))
        if not size <= largest:  # NaN comes through
            largest = size
    return largest


def _contact_moment(now: Observation) -> float:
    largest = 0.0
    for finger in now.fingers:
        _, _, _, x, y, z = finger.wrench
        size = norm((x, y, z))
        if not size <= largest:
            largest = size
    return largest


def _spin_torque(now: Observation) -> float:
    largest = 0.0
    for finger in now.fingers:
        if finger.contact.status is ContactStatus.OK:
            largest = max(largest, abs(finger.contact.spin_torque))
    return largest


def _grip_force(now: Observation) -> float:
    if now.hand is None:
        return 0.0
    pushed = [f.contact.normal_force for f in now.fingers if f.contact.status is ContactStatus.OK]
    return max(pushed, default=0.0)


def _tip_speed(now: Observation) -> float:
    return norm(now.arm.velocity_base_tip)


def _tip_turn(now: Observation) -> float:
    turn = now.arm.angular_velocity_base_tip
    return 0.0 if turn is ZERO else norm(turn)  # most robots never turn


CONTACT_FORCE = MonitoredQuantity("contact force", "N", _contact_force)
"""Of the finger that feels most."""

CONTACT_MOMENT = MonitoredQuantity("contact moment", "N m", _contact_moment)
"""About the origin of the sensor frame, of the finger that feels most; whether a contact explains it or not."""

SPIN_TORQUE = MonitoredQuantity("spin torque", "N m", _spin_torque)
"""Of the finger that is twisted most; fingers whose wrench no contact explains do not count."""

GRIP_FORCE = MonitoredQuantity("grip force", "N", _grip_force)
"""Normal force of the finger of a hand that presses most; 0 without a hand."""

TIP_SPEED = MonitoredQuantity("measured speed of the tip", "m/s", _tip_speed)
"""As the arm tells."""

TIP_TURN = MonitoredQuantity("measured angular speed of the tip", "rad/s", _tip_turn)
"""As the arm tells."""
