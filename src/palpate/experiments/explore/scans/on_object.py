"""Where a configuration leads on its object."""

import math

from palpate.controllers import Raster
from palpate.controllers.paths import ActiveSettings, Goal, GoalError, Spiral, Turn, tap_grid
from palpate.experiments.explore.config import ExploreConfig
from palpate.experiments.explore.contour import drop, predicted_contour
from palpate.experiments.explore.fit import region_on
from palpate.experiments.explore.scans.active import ActiveScan
from palpate.experiments.explore.scans.beyond import missed_places, predicted_path, predicted_rows
from palpate.experiments.explore.scans.contour import ContourScan
from palpate.experiments.explore.scans.raster import RasterScan
from palpate.experiments.explore.scans.scan import Scan
from palpate.experiments.explore.scans.spiral import SpiralScan
from palpate.experiments.explore.scans.taps import TapScan
from palpate.sim import SceneObject


def scan_on(target: SceneObject, config: ExploreConfig) -> Scan:
    """Return what a configuration wants, as it fits the object.

    Raises:
        InvalidValueError: It does not; the message names what would fit.
    """
    if config.strategy == "contour":
        predicted = predicted_contour(target, config)
        edge, turn = config.curve == "edge", Turn.LEFT if config.turn == "left" else Turn.RIGHT
        return ContourScan(predicted, edge, turn, min(config.tip), 0.0 if edge else drop(target, config))
    region = region_on(target, config)
    match config.strategy:
        case "raster":
            rows = Raster(region.width, region.depth, config.gap, region.center)
            return RasterScan(region, config.gap, predicted_rows(target, config, rows))
        case "spiral":
            turns = Spiral(0.5 * region.width, config.gap, region.center)
            return SpiralScan(region, config.gap, predicted_path(target, config, turns.corners()))
        case "taps":
            taps = tap_grid(region.width, region.depth, config.gap, region.center)
            return TapScan(region, config.gap, missed_places(target, config, taps))
        case "active":
            measure = GoalError.RMS if config.measure == "rms" else GoalError.LARGEST
            time = math.inf if config.time is None else config.time
            goal = Goal(config.wanted_error, measure, area=config.area, time=time)
            ends = Raster(region.width, region.depth, min(ActiveSettings().prior, region.depth), region.center)
            return ActiveScan(region, goal, missed_places(target, config, ends.corners()))
