"""What keeps a robot and what it touches whole: limits, guards, reactions, and the supervisor over them."""

from palpate.runtime.supervision.bounds import Bound, Measure
from palpate.runtime.supervision.conditions import (
    Bounded,
    Condition,
    HealthySensors,
    InsideJointRange,
    InsideWorkspace,
    PossibleState,
    SensorsInRange,
    broken_by_bounds,
)
from palpate.runtime.supervision.finding import Cause, Trip, Violation
from palpate.runtime.supervision.fresh_samples import FreshSamples
from palpate.runtime.supervision.guard import Guard
from palpate.runtime.supervision.limits import Limits
from palpate.runtime.supervision.observed_row import RowLayout
from palpate.runtime.supervision.quantities import AtMost, Largest, MonitoredQuantity
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
    "Bound",
    "Bounded",
    "Cause",
    "Condition",
    "FreshSamples",
    "Guard",
    "HealthySensors",
    "Hold",
    "InsideJointRange",
    "InsideWorkspace",
    "Largest",
    "Limits",
    "Measure",
    "MonitoredQuantity",
    "PossibleState",
    "Reaction",
    "Retract",
    "RowLayout",
    "SensorsInRange",
    "Stop",
    "Supervisor",
    "Trip",
    "Violation",
    "broken_by_bounds",
    "guards_of",
]
