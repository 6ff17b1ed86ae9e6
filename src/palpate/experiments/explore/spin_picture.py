"""Spin torque, and how much of the force is tangential, over time."""

import numpy as np
from matplotlib.figure import Figure

from palpate.errors import FloatArray
from palpate.mapping import TouchCloud
from palpate.reporting.data import TimeSeries
from palpate.reporting.envelope import envelope
from palpate.reporting.lines import draw_true_and_felt
from palpate.reporting.phases import shade
from palpate.reporting.style import (
    MEASURED,
    MILLI,
    Picture,
    Width,
    legend_above,
    new_figure,
    style_axes,
)

GAP_PERIODS = 5.0
"""The line of the ratio is broken where contacts are further apart than this many median periods."""

LIGHTEST = 0.1
"""Below this share of the median normal force no ratio is drawn: while landing and lifting it is noise over
noise, and would set the scale."""


LEAST_SPIN = 0.01
"""The scale of torque spans at least plus and minus this [mN m]; fine sensors resolve no less (ATI Nano17
SI-12-0.12: 1/64 mN m)."""


def spin_picture(series: TimeSeries, cloud: TouchCloud) -> Picture:
    """Return the picture of spin torque and force ratio over the whole run."""
    return Picture(
        title="Spin torque and friction",
        caption=(
            "Torque about the contact normal, and tangential over normal force, which while sliding is the "
            "coefficient of friction; contacts much lighter than usual are left out of the ratio. Torques far "
            f"below {LEAST_SPIN:g} mN m are rounding. Felt torque on the true one, and an even ratio, "
            f"are good."
        ),
        full=_draw(series, cloud, Width.FULL),
        narrow=_draw(series, cloud, Width.HALF),
    )


def _draw(series: TimeSeries, cloud: TouchCloud, width: Width) -> Figure:
    figure = new_figure(width, 4.2)
    spin, ratio = figure.subplots(2, 1, sharex=True)
    for axes in (spin, ratio):
        shade(axes, series)
    true = None if series.true_spin_torque is None else MILLI * series.true_spin_torque
    draw_true_and_felt(spin, series.time, true, MILLI * series.spin_torque)
    low, high = spin.get_ylim()
    spin.set_ylim(min(low, -LEAST_SPIN), max(high, LEAST_SPIN))
    ratio.plot(*envelope(*_force_ratio(cloud)), color=MEASURED, linewidth=0.8, label="felt")
    ratio.set_ylim(bottom=0.0)
    style_axes(spin, x="", y="spin torque [mN m]")
    style_axes(ratio, x="time [s]", y="tangential / normal force")
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
