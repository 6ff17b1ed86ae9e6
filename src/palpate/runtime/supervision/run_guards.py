"""The guards that every run has, and what they measure.

A new one takes a limit in `palpate.runtime.supervision.limits`, and a measure and a line of `guards_of` in here.
"""

from palpate.runtime.data import Observation
from palpate.runtime.supervision.conditions import (
    AtMost,
    FreshSamples,
    HealthySensors,
    InsideJointRange,
    InsideWorkspace,
    MonitoredQuantity,
    PossibleState,
    SensorsInRange,
)
from palpate.runtime.supervision.finding import Cause
from palpate.runtime.supervision.guard import Guard
from palpate.runtime.supervision.limits import Limits
from palpate.runtime.supervision.reactions import Retract, Stop
from palpate.sensing.contact import ContactStatus
from palpate.spatial import ZERO, norm

OVERSHOOT = 1.1
"""By which factor the measured speed may exceed the commanded one's limit: servos overshoot, sensors are noisy."""

LONGEST_ARM = 1.0
"""[m] of a contact force about the sensor: no finger is so long; mN m for N m make it a thousandfold."""

RELIEF = 0.1
"""A finger that felt too much is pressed, and backs off, as long as it feels more than this share of the limit:
less than what a surface that follows it presses with before the tip responds."""


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


def _lever_arm(now: Observation) -> str:
    for finger in now.fingers:
        force, moment = norm(finger.wrench[:3]), norm(finger.wrench[3:])
        if moment > LONGEST_ARM * force > 0.0:
            return f"; {moment / force:.3g} m is no arm of {force:.3g} N on a finger: does the sensor give N m?"
    return ""


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


CONTACT_FORCE = MonitoredQuantity("contact force", "N", _contact_force, Cause.FORCE)
"""Of the finger that feels most."""

CONTACT_MOMENT = MonitoredQuantity("contact moment", "N m", _contact_moment, Cause.FORCE, _lever_arm)
"""About the origin of the sensor frame, of the finger that feels most; whether a contact explains it or not."""

SPIN_TORQUE = MonitoredQuantity("spin torque", "N m", _spin_torque, Cause.FORCE)
"""Of the finger that is twisted most; fingers whose wrench no contact explains do not count."""

GRIP_FORCE = MonitoredQuantity("grip force", "N", _grip_force, Cause.FORCE)
"""Normal force of the finger of a hand that presses most; 0 without a hand."""

TIP_SPEED = MonitoredQuantity("measured speed of the tip", "m/s", _tip_speed, Cause.MOTION)
"""As the arm reports it."""

TIP_TURN = MonitoredQuantity("measured angular speed of the tip", "rad/s", _tip_turn, Cause.MOTION)
"""As the arm reports it."""


def guards_of(limits: Limits) -> tuple[Guard, ...]:
    """Return the guards that every run has; the first ones vouch for the numbers that the others compare."""
    joints = (Guard(InsideJointRange(limits.joint_lower, limits.joint_upper)),) if limits.joint_lower else ()
    out_of_it = (Retract(RELIEF * limits.force), Stop())
    return (
        Guard(FreshSamples(limits.sample_age)),
        Guard(PossibleState()),
        Guard(HealthySensors()),
        Guard(SensorsInRange(), reaction=out_of_it),
        Guard(AtMost(CONTACT_FORCE, limits.force), reaction=out_of_it),
        Guard(AtMost(CONTACT_MOMENT, limits.moment), reaction=out_of_it),
        Guard(AtMost(SPIN_TORQUE, limits.spin_torque), reaction=out_of_it),
        Guard(AtMost(GRIP_FORCE, limits.grip_force)),
        Guard(AtMost(TIP_SPEED, OVERSHOOT * limits.speed)),
        Guard(AtMost(TIP_TURN, OVERSHOOT * limits.angular_speed)),
        Guard(InsideWorkspace(limits.workspace_lower, limits.workspace_upper)),
        *joints,
    )
