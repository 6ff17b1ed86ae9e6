"""Where the tip goes: strategies that decide leg by leg from what was felt."""

from palpate.controllers.paths.active import Active, ActiveSettings
from palpate.controllers.paths.contour import Contour
from palpate.controllers.paths.features import FeatureLimits, FeatureWatch
from palpate.controllers.paths.felt import Felt
from palpate.controllers.paths.follow import Follow, Path
from palpate.controllers.paths.goal import Enough, Goal, Measure
from palpate.controllers.paths.legs import Circuit, Ended, Hop, Leg, LegEnd, Stroke, Touch
from palpate.controllers.paths.marks import Event, Mark
from palpate.controllers.paths.missed import TouchNoise
from palpate.controllers.paths.path_follower import PathFollower
from palpate.controllers.paths.plane import PathPlane, Point
from palpate.controllers.paths.raster import Raster
from palpate.controllers.paths.rows import Rows
from palpate.controllers.paths.spiral import Spiral
from palpate.controllers.paths.steering import EdgeSteering, LevelSteering, Steering, Turn
from palpate.controllers.paths.strategy import Strategy
from palpate.controllers.paths.taps import Taps, tap_grid
from palpate.controllers.paths.waypoints import Waypoints

__all__ = [
    "Active",
    "ActiveSettings",
    "Circuit",
    "Contour",
    "EdgeSteering",
    "Ended",
    "Enough",
    "Event",
    "FeatureLimits",
    "FeatureWatch",
    "Felt",
    "Follow",
    "Goal",
    "Hop",
    "Leg",
    "LegEnd",
    "LevelSteering",
    "Mark",
    "Measure",
    "Path",
    "PathFollower",
    "PathPlane",
    "Point",
    "Raster",
    "Rows",
    "Spiral",
    "Steering",
    "Strategy",
    "Stroke",
    "Taps",
    "Touch",
    "TouchNoise",
    "Turn",
    "Waypoints",
    "tap_grid",
]
