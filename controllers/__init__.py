"""Pure step functions: Observation -> Command."""

from palpate.controllers.explore import ExploreController, ExploreParameters, live_parameters
from palpate.controllers.gains import ForceGain, force_gain, series_stiffness, tracking_delay
from palpate.controllers.normal_tracker import NormalTracker
from palpate.controllers.raster import PathFollower, Raster

__all__ = [
    "ExploreController",
    "ExploreParameters",
    "ForceGain",
    "NormalTracker",
    "PathFollower",
    "Raster",
    "force_gain",
    "live_parameters",
    "series_stiffness",
    "tracking_delay",
]
