"""Spin torque, and how much of the force is tangential, over time."""

import numpy as np

from palpate.errors import FloatArray
from palpate.mapping import TouchCloud
from palpate.reporting.data import TimeSeries
from palpate.reporting.lines import true_and_felt
from palpate.reporting.marks import Line, unnamed
from palpate.reporting.phases import phase_spans
from palpate.reporting.picture import TIME, Axis, Panel, Picture

MILLI = 1e3

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
    true = None if series.true_spin_torque is None else MILLI * series.true_spin_torque
    spin = true_and_felt(series.time, true, MILLI * series.spin_torque)
    ratio = Line(*_force_ratio(cloud), width=1.2)
    spans = phase_spans(series)
    return Picture(
        title="Spin torque and friction",
        caption=(
            "Torque about the contact normal, and tangential over normal force, which while sliding is the "
            "coefficient of friction; contacts much lighter than usual are left out of the ratio. Torques far "
            f"below {LEAST_SPIN:g} mN m are rounding. Felt torque on the true one, and an even ratio, "
            f"are good."
        ),
        panels=(
            Panel((*spans, *spin), TIME, Axis("spin torque", "mN m", span=2.0 * LEAST_SPIN), height=240),
            Panel((*unnamed(spans), ratio), TIME, Axis("tangential / normal force", low=0.0), height=200),
        ),
        wide=True,
    )


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
