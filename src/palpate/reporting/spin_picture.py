"""Spin torque, and how much of the force is tangential, over time."""

import numpy as np
from matplotlib.figure import Figure

from palpate.mapping import TouchCloud
from palpate.reporting.data import FloatArray, TimeSeries
from palpate.reporting.envelope import envelope
from palpate.reporting.phases import shade
from palpate.reporting.style import (
    MEASURED,
    MILLI,
    TRUE,
    Picture,
    Width,
    dress,
    legend_above,
    new_figure,
)

GAP_PERIODS = 5.0
"""The line of the ratio is broken where contacts are further apart than this many median periods."""

LIGHTEST = 0.1
"""Below this share of the median normal force no ratio is drawn: while landing and lifting it is noise over
noise, and would set the scale."""


def spin_picture(series: TimeSeries, cloud: TouchCloud) -> Picture:
    """Return the picture of spin torque and force ratio over the whole run."""
    return Picture(
        title="Spin torque and friction",
        caption=(
            "Torque about the contact normal, and tangential over normal force, which while sliding is the "
            "coefficient of friction; contacts much lighter than usual are left out of the ratio."
        ),
        full=_draw(series, cloud, Width.FULL),
        narrow=_draw(series, cloud, Width.HALF),
    )


def _draw(series: TimeSeries, cloud: TouchCloud, width: Width) -> Figure:
    figure = new_figure(width, 4.2)
    spin, ratio = figure.subplots(2, 1, sharex=True)
    for axes in (spin, ratio):
        shade(axes, series)
    spin.plot(*envelope(series.time, MILLI * series.spin_torque), color=MEASURED, linewidth=0.8, label="measured")
    if series.true_spin_torque is not None:
        true = envelope(series.time, MILLI * series.true_spin_torque)
        spin.plot(*true, color=TRUE, linewidth=0.8, label="true")
    ratio.plot(*envelope(*_force_ratio(cloud)), color=MEASURED, linewidth=0.8, label="measured")
    ratio.set_ylim(bottom=0.0)
    dress(spin, x="", y="spin torque [mN m]")
    dress(ratio, x="time [s]", y="tangential / normal force")
    spin.margins(x=0.0)
    figure.align_ylabels()
    legend_above(figure, [spin], columns=9 if width is Width.FULL else 4)
    return figure


def _force_ratio(cloud: TouchCloud) -> tuple[FloatArray, FloatArray]:
    """Return time and |tangential| / normal force, with a NaN in each gap to break the line."""
    if not len(cloud):
        return cloud.time, cloud.time
    pushing = cloud.normal_force > LIGHTEST * max(float(np.median(cloud.normal_force)), 0.0)
    time = cloud.time[pushing]
    ratio = np.linalg.norm(cloud.tangential_force[pushing], axis=1) / cloud.normal_force[pushing]
    steps = np.diff(time)
    if len(steps) == 0:
        return time, ratio
    gaps = np.flatnonzero(steps > GAP_PERIODS * np.median(steps)) + 1
    return np.insert(time, gaps, time[gaps - 1]), np.insert(ratio, gaps, np.nan)
