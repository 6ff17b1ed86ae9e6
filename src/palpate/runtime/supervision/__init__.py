"""What keeps a robot and what it touches whole: limits, guards, reactions, and the supervisor over them."""

from palpate.runtime.supervision.conditions import (
    AtMost,
    Condition,
    FreshSamples,
    HealthySensors,
    InsideJointRange,
    InsideWorkspace,
    MonitoredQuantity,
    PossibleState,
    SensorsInRange,
)
from palpate.runtime.supervision.finding import Cause, Trip, Violation
from palpate.runtime.supervision.guard import Guard
from palpate.runtime.supervision.limits import Limits
from palpate.runtime.supervision.reactions import Hold, Reaction, Retract, Stop
from palpate.runtime.supervision.run_guards import (
    CONTACT_FORCE,
    CONTACT_MOMENT,
    GRIP_FORCE,
    SPIN_TORQUE,
    TIP_SPEED,
    TIP_TURN,
    guards_of,
)
from palpate.runtime.supervision.supervisor import Supervisor

__all__ = [
    "CONTACT_FORCE",
    "CONTACT_MOMENT",
    "GRIP_FORCE",
    "SPIN_TORQUE",
    "TIP_SPEED",
    "TIP_TURN",
    "AtMost",
    "Cause",
    "Condition",
    "FreshSamples",
    "Guard",
    "HealthySensors",
    "Hold",
    "InsideJointRange",
    "InsideWorkspace",
    "Limits",
    "MonitoredQuantity",
    "PossibleState",
    "Reaction",
    "Retract",
    "SensorsInRange",
    "Stop",
    "Supervisor",
    "Trip",
    "Violation",
    "guards_of",
]
