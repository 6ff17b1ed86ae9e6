"""Guards: a condition, how long it may be broken, and what is done then (guarded motion)."""

from dataclasses import dataclass, field

from palpate.errors import not_negative
from palpate.runtime.supervision.conditions import (
    AtMost,
    Condition,
    FiniteState,
    FreshSamples,
    HealthySensors,
    InsideJointRange,
    InsideWorkspace,
    SensorsInRange,
)
from palpate.runtime.supervision.limits import Limits
from palpate.runtime.supervision.measures import (
    CONTACT_FORCE,
    CONTACT_MOMENT,
    GRIP_FORCE,
    SPIN_TORQUE,
    TIP_SPEED,
    TIP_TURN,
)
from palpate.runtime.supervision.reactions import Reaction, Retract, Stop

OVERSHOOT = 1.1
"""By which factor the measured speed may exceed the commanded one's limit: servos overshoot, sensors are noisy."""

RELIEF = 0.1
"""A finger that felt too much is pressed, and backs off, as long as it feels more than this share of the limit:
less than what a surface that follows it presses with before the tip responds."""


@dataclass(frozen=True, slots=True)
class Guard:
    """Trips when a condition is broken for long enough.

    Attributes:
        condition: What should hold.
        duration: How long it may be broken without a break [s].
        reaction: What is done then, one stage after the other; at its end the robot stands still.
    """

    condition: Condition
    duration: float = 0.0
    reaction: tuple[Reaction, ...] = field(default_factory=lambda: (Stop(),))

    def __post_init__(self) -> None:
        not_negative("guard duration", self.duration, "s")


def guards_of(limits: Limits) -> tuple[Guard, ...]:
    """Return the guards that every run has; the first ones vouch for the numbers that the others compare."""
    joints = (Guard(InsideJointRange(limits.joint_lower, limits.joint_upper)),) if limits.joint_lower else ()
    out_of_it = (Retract(RELIEF * limits.force), Stop())
    return (
        Guard(FreshSamples(limits.sample_age)),
        Guard(FiniteState()),
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
