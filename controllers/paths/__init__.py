"""Where the tip goes: strategies that decide leg by leg from what was felt."""

from palpate.controllers.paths.active import Active, ActiveSettings, Goal, GoalError, StopReason
from palpate.controllers.paths.contour import Contour, EdgeSteering, LevelSteering, Turn
from palpate.controllers.paths.features import FeatureLimits, FeatureWatch
from palpate.controllers.paths.felt_rows import TouchNoise
from palpate.controllers.paths.follow import Follow, Path, Taps, tap_grid
from palpate.controllers.paths.path_follower import PathFollower
from palpate.controllers.paths.polygons import Raster, Spiral, Waypoints
from palpate.controllers.paths.rows import RasterRows
from palpate.controllers.paths.strategy import (
    Circuit,
    ContactPeriod,
    Hop,
    Leg,
    LegEnd,
    LegResult,
    Mark,
    PathEvent,
    PathPlane,
    Point,
    SingleTouch,
    Steering,
    Strategy,
    Stroke,
)

__all__ = [
    "Active",
    "ActiveSettings",
    "Circuit",
    "ContactPeriod",
    "Contour",
    "EdgeSteering",
    "FeatureLimits",
    "FeatureWatch",
    "Follow",
    "Goal",
    "GoalError",
    "Hop",
    "Leg",
    "LegEnd",
    "LegResult",
    "LevelSteering",
    "Mark",
    "Path",
    "PathEvent",
    "PathFollower",
    "PathPlane",
    "Point",
    "Raster",
    "RasterRows",
    "SingleTouch",
    "Spiral",
    "Steering",
    "StopReason",
    "Strategy",
    "Stroke",
    "Taps",
    "TouchNoise",
    "Turn",
    "Waypoints",
    "tap_grid",
]
