"""Detail of a surface that rows are too far apart to show: normals notice it, and the length that was learned."""

import math

from palpate.estimation import Assumption, BrokenAssumption
from palpate.mapping.surface_map.model import SurfaceModel

RELIEF = 0.48
"""RMS height of a sine of three rows over their distance and the RMS of its slopes, 3 / (2 pi). Of arcs between
ridges as far apart as the rows, as of facets, it is 0.32."""

ROWS_OF_LENGTH = 1.5
"""A surface is sampled finely enough where its length is so many rows: heights then correlate by 0.9 from one row
to the next. Resolved shapes show 4 and more, textures of 1.2 rows 0.3 to 0.5."""

SAG = 1.0 / 8.0
"""Height of an arc between two rows, over curvature times the square of their distance."""

WIDENED = 1.3
"""Deviations are so much larger at least where the surface is finer than the rows: its length and height are then
learned from values that hardly tell, and the band of such maps held 0.88 to 0.92."""

NOTICED = 0.15
"""Relief between rows is noticed from so many deviations of a contact's noise on: with noise alone it is 0.03 at
most, over a sine of 0.03 mm in rows three to a period 0.22 to 0.35."""

LEAST_NOISE = 0.1
"""Of what was believed: without noise rounding and means over arcs would be noticed."""


def facet_height(model: SurfaceModel, believed: SurfaceModel, slope: float, patch: float, rows: float) -> float:
    """Return the standard deviation of relief between rows that normals show and heights do not [m].

    What keeps along a patch, but not from row to row, is no noise. Where it is noticed, what keeps for less is
    part of it. Tilts as large as was believed are the sensor's: those of its calibration keep for whole maps.

    Args:
        model: As it was learned.
        believed: Where learning began.
        slope: RMS of how far slopes that were felt are off those of the map.
        patch: Length of path across a patch [m].
        rows: Distance of rows [m].
    """
    tilt = max(model.tilt, slope)
    of_sensor = 0.0 if model is believed else believed.tilt  # what is stated counts as stated
    height = RELIEF * rows * math.sqrt(max(tilt**2 - of_sensor**2, 0.0))
    kept = height * math.exp(-0.5 * patch / model.tilt_length)
    return height if is_noticed(kept, model, believed) else kept


def is_noticed(height: float, model: SurfaceModel, believed: SurfaceModel) -> bool:
    """Return whether relief [m] is more than noise explains, as it was learned or believed."""
    noise = min(max(model.noise, LEAST_NOISE * believed.noise), believed.noise)
    return height > NOTICED * noise


def finer_than_rows(
    model: SurfaceModel, believed: SurfaceModel, rows: float, height: float
) -> tuple[BrokenAssumption, ...]:
    """Return that the surface has detail finer than the rows, if it seems so.

    Args:
        model: As it was learned.
        believed: Where learning began.
        rows: Distance of rows [m].
        height: From `facet_height` [m].
    """
    if model.length < ROWS_OF_LENGTH * rows and SAG * model.curvature * rows**2 > model.noise:
        found = f"the surface changes over {1e3 * model.length:.2g} mm, rows are {1e3 * rows:.2g} mm apart"
    elif is_noticed(height, model, believed):
        found = f"normals and heights disagree from row to row, as over a relief of {1e3 * height:.2g} mm"
    else:
        return ()
    remedy = f"the band is widened for it; lay rows closer than {1e3 * rows:.2g} mm to see it"
    return (BrokenAssumption(Assumption.RESOLVED, found, remedy),)
