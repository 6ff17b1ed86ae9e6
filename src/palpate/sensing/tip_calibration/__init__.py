"""A fingertip calibrated by touching things that need no metrology: a plate, an edge, a ball."""

from palpate.sensing.tip_calibration.fit import TipFit, fit_tip
from palpate.sensing.tip_calibration.instrument import Instrument
from palpate.sensing.tip_calibration.plan import PlannedTouch, TouchPlan, candidate_touches, planned_touches
from palpate.sensing.tip_calibration.shapes import TipShape, tip_shape
from palpate.sensing.tip_calibration.targets import TargetKind, TouchTarget
from palpate.sensing.tip_calibration.touches import Touches
from palpate.sensing.tip_calibration.unknowns import TypedTip, Unknown, Unknowns

__all__ = [
    "Instrument",
    "PlannedTouch",
    "TargetKind",
    "TipFit",
    "TipShape",
    "TouchPlan",
    "TouchTarget",
    "Touches",
    "TypedTip",
    "Unknown",
    "Unknowns",
    "candidate_touches",
    "fit_tip",
    "planned_touches",
    "tip_shape",
]
