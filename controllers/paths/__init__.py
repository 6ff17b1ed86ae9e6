"""Where the tip goes: strategies that decide leg by leg from what was felt."""

from palpate.controllers.paths.active import Active, ActiveSettings
from palpate.controllers.paths.contact_period import ContactPeriod
from palpate.controllers.paths.contour import Contour
from palpate.controllers.paths.features import FeatureLimits, FeatureWatch
from palpate.controllers.paths.follow import Follow, Path
from palpate.controllers.paths.goal import Goal, GoalError, StopReason
from palpate.controllers.paths.legs import Circuit, Hop, Leg, LegEnd, LegResult, SingleTouch, Stroke
from palpate.controllers.paths.marks import Mark, PathEvent
from palpate.controllers.paths.missed import TouchNoise
from palpate.controllers.paths.path_follower import PathFollower
from palpate.controllers.paths.plane import PathPlane, Point
from palpate.controllers.paths.raster import Raster
from palpate.controllers.paths.rows import RasterRows
from palpate.controllers.paths.spiral import Spiral
from palpate.controllers.paths.steering import EdgeSteering, LevelSteering, Steering, Turn
from palpate.controllers.paths.strategy import Strategy
from palpate.controllers.paths.taps import Taps, tap_grid
from palpate.controllers.paths.waypoints import Waypoints

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
