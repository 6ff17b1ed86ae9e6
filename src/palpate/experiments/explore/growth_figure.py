"""Growth of the map: observed area and standard deviations over path length, time and contacts."""

import numpy as np

from palpate.experiments.explore.map_growth import MapGrowth
from palpate.reporting.figure import Axis, Figure, Panel
from palpate.reporting.marks import Dash, Line
from palpate.runtime.palette import FELT, INK_COLOUR

MILLI, MICRO, AREA = 1e3, 1e6, 1e4
"""Per m, and cm^2 per m^2."""

HEIGHT = 210
"""Of a panel [px]."""


def growth_figure(growth: MapGrowth) -> Figure:
    """Return area and standard deviations over path length, time and contacts."""
    curve = growth.curve
    scales = (
        (Axis("path length", "mm", low=0.0), MILLI * curve.path_length),
        (Axis("time", "s", low=0.0), curve.time),
        (Axis("contacts", low=0.0), curve.contacts),
    )
    area, deviation = Axis("observed area", "cm²", low=0.0), Axis("sd", "µm", low=0.0)
    return Figure(
        title="Growth of the map",
        caption=(
            f"In the end {AREA * curve.area[-1]:.3g} cm² are observed, half of them to "
            f"±{MICRO * curve.middle[-1]:.3g} µm, 95 % to ±{MICRO * curve.tail[-1]:.3g} µm or better (one "
            "standard deviation). All moments use the noise and surface model learned from the whole run. A "
            "growing area and falling deviations are good; where both are flat, the rest of the run told little."
        ),
        panels=(
            *(
                Panel((Line(x, AREA * curve.area, colour=FELT, points=True),), axis, area, height=HEIGHT)
                for axis, x in scales
            ),
            *(
                Panel(
                    (
                        Line(x, MICRO * curve.tail, "95 % of the area", INK_COLOUR, dash=Dash.DOTTED, points=True),
                        Line(x, MICRO * curve.middle, "median", INK_COLOUR, points=True),
                    ),
                    axis,
                    deviation,
                    height=HEIGHT,
                )
                for axis, x in scales
            ),
        ),
        columns=len(scales),
        wide=True,
    )


def heading(growth: MapGrowth, moment: int) -> str:
    """Return how far the run was at a moment, and what was known by then, as text."""
    curve = growth.curve
    whole = float(curve.path_length[-1])
    share = float(curve.path_length[moment]) / whole if whole > 0.0 else 1.0
    done = f"{100.0 * share:.0f} % of the path, {curve.time[moment]:.1f} s"
    if not curve.area.any():
        return done
    sd = curve.middle[moment]
    known = f", sd {MICRO * sd:.3g} µm" if np.isfinite(sd) else ""
    return f"{done}: {AREA * curve.area[moment]:.3g} cm²{known}"
