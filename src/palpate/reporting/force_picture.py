"""Normal force and speed over time."""

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from palpate.reporting.data import TimeSeries
from palpate.reporting.envelope import envelope
from palpate.reporting.lines import draw_true_and_felt
from palpate.reporting.phases import scan_window, shade, within
from palpate.reporting.style import (
    DASHED,
    MILLI,
    QUIET,
    WANTED,
    Picture,
    Width,
    legend_above,
    new_figure,
    style_axes,
)


def force_overview(series: TimeSeries) -> Picture | None:
    """Return the picture of normal force and speed over the whole run; None if nothing was felt."""
    felt = (series.measured_force, series.true_force)
    if not any(np.isfinite(force).any() for force in felt if force is not None):
        return None
    return Picture(
        title="Normal force over the run",
        caption=(
            "Normal force found by touch, in the simulation (where known) and asked for, above the speed "
            "of the fingertip; the ground shows what the controller was doing. The nearer the true force "
            "to the set "
            "one the better."
        ),
        full=_overview(series, Width.FULL),
        narrow=_overview(series, Width.HALF),
    )


def force_zoom(series: TimeSeries) -> Picture | None:
    """Return the picture of normal force while scanning, or None if nothing was scanned."""
    if scan_window(series) is None or not len(within(series, series.measured_force)):
        return None
    return Picture(
        title="Normal force while scanning",
        caption="The same forces while scanning, on a scale that shows every deviation from the set value: "
        "the smaller the better.",
        full=_zoom(series, Width.FULL),
        narrow=_zoom(series, Width.HALF),
    )


def _overview(series: TimeSeries, width: Width) -> Figure:
    figure = new_figure(width, 4.2)
    force, speed = figure.subplots(2, 1, sharex=True, height_ratios=[3, 1])
    for axes in (force, speed):
        shade(axes, series)
    _draw_forces(force, series, np.ones(len(series.time), dtype=np.bool_))
    speed.plot(*envelope(series.time, MILLI * series.speed), color=QUIET, linewidth=0.9)
    speed.set_ylim(bottom=0.0)
    style_axes(force, x="", y="normal force [N]")
    style_axes(speed, x="time [s]", y="speed [mm/s]")
    force.margins(x=0.0)
    figure.align_ylabels()
    legend_above(figure, [force], columns=9 if width is Width.FULL else 4)
    return figure


def _zoom(series: TimeSeries, width: Width) -> Figure:
    figure = new_figure(width, 3.0)
    axes = figure.subplots()
    window = scan_window(series)
    begin, end = window if window is not None else (series.time[0], series.time[-1])
    shade(axes, series, begin, end)
    _draw_forces(axes, series, (series.time >= begin) & (series.time <= end))
    axes.set_xlim(begin, end)
    shown = [within(series, series.measured_force), within(series, series.set_force)]
    if series.true_force is not None:
        shown.append(within(series, series.true_force))
    values = np.concatenate(shown)
    margin = 0.08 * max(float(np.ptp(values)), 1e-3 * float(np.abs(values).max()), 1e-6)
    axes.set_ylim(values.min() - margin, values.max() + margin)
    style_axes(axes, x="time [s]", y="normal force [N]")
    legend_above(figure, [axes], columns=9 if width is Width.FULL else 4)
    return figure


def _draw_forces(axes: Axes, series: TimeSeries, shown: npt.NDArray[np.bool_]) -> None:
    time = series.time[shown]
    true = None if series.true_force is None else series.true_force[shown]
    draw_true_and_felt(axes, time, true, series.measured_force[shown])
    wanted = envelope(time, series.set_force[shown])
    axes.plot(*wanted, color=WANTED, linewidth=1.2, linestyle=DASHED, label="set")
