"""Which assumptions of a map its contacts contradict."""

from palpate.errors import FloatArray
from palpate.estimation import Assumption, BrokenAssumption, Verdict
from palpate.mapping.surface_map.learn import at_bounds
from palpate.mapping.surface_map.model import SurfaceModel

NAMED = 3
"""Outliers whose places are written out."""


def map_verdict(model: SurfaceModel, believed: SurfaceModel, outliers: FloatArray, felt: int) -> Verdict:
    """Return which assumptions did not hold.

    Args:
        model: As it was learned.
        believed: Where learning began.
        outliers: Contacts that were left out, shape (k, 3) [m].
        felt: Contacts, with them.
    """
    broken = list(at_bounds(model, believed))
    if len(outliers):
        broken.append(_outliers(outliers, felt))
    return Verdict(tuple(broken))


def _outliers(outliers: FloatArray, felt: int) -> BrokenAssumption:
    places = ", ".join("({:.1f}, {:.1f}, {:.1f})".format(*(1e3 * each)) for each in outliers[:NAMED])
    more = ", ..." if len(outliers) > NAMED else ""
    return BrokenAssumption(
        Assumption.NO_OUTLIERS,
        f"{len(outliers)} of {felt} contacts are far off their neighbours along the path, at {places}{more} mm",
        "the map is made of the others; look at the sensor's signal there",
    )
