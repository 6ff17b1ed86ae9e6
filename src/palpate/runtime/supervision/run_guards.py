"""The guards that every run has, and what they measure.

A new one takes a limit in `palpate.runtime.supervision.limits`, and a measure and a line of `guards_of` in here.
"""

from collections.abc import Iterable

from palpate.runtime.data import Observation
from palpate.runtime.supervision.conditions import (
    HealthySensors,
    InsideJointRange,
    InsideWorkspace,
    PossibleState,
    SensorsInRange,
)
from palpate.runtime.supervision.finding import Cause
from palpate.runtime.supervision.fresh_samples import FreshSamples
from palpate.runtime.supervision.guard import Guard
from palpate.runtime.supervision.limits import Limits
from palpate.runtime.supervision.observed_row import (
    EXPLAINED,
    FORCE,
    MOMENT,
    NORMAL_FORCE,
    SPIN,
    TURN,
    VELOCITY,
    RowLayout,
)
from palpate.runtime.supervision.quantities import AtMost, Largest, MonitoredQuantity
from palpate.runtime.supervision.reactions import Retract, Stop
from palpate.spatial import norm

OVERSHOOT = 1.1
"""By which factor the measured speed may exceed the commanded one's limit: servos overshoot, sensors are noisy."""

LONGEST_ARM = 1.0
"""[m] of a contact force about the sensor: no finger is so long; mN m for N m make it a thousandfold."""

RELIEF = 0.1
"""A finger that felt too much is pressed, and backs off, as long as it feels more than this share of the limit:
less than what a surface that follows it presses with before the tip responds."""


def _lever_arm(now: Observation) -> str:
    for finger in now.fingers:
        force, moment = norm(finger.wrench[:3]), norm(finger.wrench[3:])
        if moment > LONGEST_ARM * force > 0.0:
            return f"; {moment / force:.3g} m is no arm of {force:.3g} N on a finger: does the sensor give N m?"
    return ""


def _of_hand(row: RowLayout, part: int) -> Iterable[int]:
    return row.each_finger(part) if row.hand_joints >= 0 else ()


CONTACT_FORCE = MonitoredQuantity("contact force", "N", Largest(lambda row: row.each_finger(FORCE)), Cause.FORCE)
"""Of the finger that feels most."""

CONTACT_MOMENT = MonitoredQuantity(
    "contact moment", "N m", Largest(lambda row: row.each_finger(MOMENT)), Cause.FORCE, _lever_arm
)
"""About the origin of the sensor frame, of the finger that feels most; whether a contact explains it or not."""

SPIN_TORQUE = MonitoredQuantity(
    "spin torque",
    "N m",
    Largest(lambda row: row.each_finger(SPIN), vectors=False, where=lambda row: row.each_finger(EXPLAINED)),
    Cause.FORCE,
)
"""Of the finger that is twisted most; fingers whose wrench no contact explains do not count."""

GRIP_FORCE = MonitoredQuantity(
    "grip force",
    "N",
    Largest(lambda row: _of_hand(row, NORMAL_FORCE), vectors=False, where=lambda row: _of_hand(row, EXPLAINED)),
    Cause.FORCE,
)
"""Normal force of the finger of a hand that presses most; 0 without a hand."""

TIP_SPEED = MonitoredQuantity("measured speed of the tip", "m/s", Largest(lambda _: (VELOCITY,)), Cause.MOTION)
"""As the arm reports it."""

TIP_TURN = MonitoredQuantity(
    "measured angular speed of the tip", "rad/s", Largest(lambda _: (TURN,)), Cause.MOTION
)
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
