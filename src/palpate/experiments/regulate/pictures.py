"""Pictures of force control: error while holding, step response, and a Bode plot."""

import math
from collections.abc import Mapping

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, NullFormatter

from palpate.experiments.regulate.response import SETTLED, FrequencyResponse, StepResponse
from palpate.reporting.data import TimeSeries
from palpate.reporting.lines import draw_true_and_felt
from palpate.reporting.phases import stretches
from palpate.reporting.style import (
    DASH_DOT,
    DASHED,
    GRID,
    INK,
    LIMIT,
    MEASURED,
    MILLI,
    QUIET,
    TRUE,
    WANTED,
    Picture,
    Width,
    legend_above,
    new_figure,
    style_axes,
)
from palpate.runtime.data import Phase

HALF_POWER_DB = -3.0103
"""20 log10(1 / sqrt 2)."""

CURVES = (TRUE, MEASURED)


def error_picture(series: TimeSeries) -> Picture | None:
    """Return the picture of the force's error while it is held, or None if it never was."""
    held = [(begin, end) for name, begin, end in stretches(series) if name == Phase.HOLD and end > begin]
    shown = np.zeros(len(series.time), dtype=np.bool_)
    for begin, end in held:
        shown |= (series.time >= begin) & (series.time < end)
    if not shown.any():
        return None
    return Picture(
        title="Force error while holding",
        caption=(
            "Felt and true force less the set one, while the profile was held; the nearer to zero the better."
        ),
        full=_error(series, shown, Width.FULL),
        narrow=_error(series, shown, Width.HALF),
    )


def _error(series: TimeSeries, shown: np.ndarray[tuple[int], np.dtype[np.bool_]], width: Width) -> Figure:
    figure = new_figure(width, 2.8)
    axes = figure.subplots()
    # broken lines where it is not held
    wanted = np.where(shown, series.set_force, np.nan)
    true = None if series.true_force is None else MILLI * (series.true_force - wanted)
    draw_true_and_felt(axes, series.time, true, MILLI * (series.measured_force - wanted))
    axes.axhline(0.0, color=WANTED, linewidth=1.0, linestyle=DASHED, label="set")
    times = series.time[shown]
    axes.set_xlim(float(times[0]), float(times[-1]) + 1e-9)
    style_axes(axes, x="time [s]", y="force error [mN]")
    legend_above(figure, [axes], columns=3)
    return figure


def step_picture(true: StepResponse | None, felt: StepResponse | None) -> Picture | None:
    """Return the picture of the mean step response, of true force, felt force or both; None if of neither."""
    judged = felt if true is None else true
    if judged is None:
        return None
    count = judged.count
    figure = new_figure(Width.HALF, 3.3)
    axes = figure.subplots()
    time = MILLI * judged.time
    axes.axhspan(1.0 - SETTLED, 1.0 + SETTLED, color=GRID, linewidth=0, label=f"within {100.0 * SETTLED:g} %")
    for row in judged.each:
        axes.plot(time, row, color=QUIET, linewidth=0.5, alpha=0.5)
    if felt is not None:
        axes.plot(time, felt.mean, color=MEASURED, linewidth=0.9, label="felt")
    if true is not None:
        axes.plot(time, true.mean, color=TRUE, linewidth=1.8, label="true")
    axes.axhline(1.0, color=WANTED, linewidth=1.0, linestyle=DASHED, label="set")
    if all(map(math.isfinite, judged.rise)):
        for at in judged.rise:
            axes.axvline(MILLI * at, color=INK, linewidth=0.7, linestyle=":")
    axes.margins(x=0.0)
    style_axes(axes, x="time since the step [ms]", y="share of the step")
    legend_above(figure, [axes], columns=4)
    return Picture(
        title="Step response",
        caption=(
            f"Mean of {count} step{'s' if count > 1 else ''} up and down, each scaled to go from 0 to 1; dotted: "
            "10 and 90 %, between which the rise is counted; thin: every single one. Quick, and within the band "
            "at once, is good."
        ),
        full=figure,
    )


def bode_picture(tones: Mapping[str, FrequencyResponse]) -> Picture:
    """Return the Bode plot of frequency responses; there is at least one, and the first is judged."""
    judged = next(iter(tones.values()))
    bandwidth = judged.bandwidth
    figure = new_figure(Width.HALF, 4.4)
    gain, phase = figure.subplots(2, 1, sharex=True)
    marks = ("o", "x")
    for i, (name, response) in enumerate(tones.items()):
        colour, mark = CURVES[i % 2], marks[i % 2]
        line = {"color": colour, "marker": mark, "markersize": 4.5, "linewidth": 1.4 - 0.5 * (i % 2)}
        gain.semilogx(response.frequency, 20.0 * np.log10(np.maximum(response.gain, 1e-6)), label=name, **line)
        phase.semilogx(response.frequency, response.phase_deg, **line)
    gain.axhline(HALF_POWER_DB, color=LIMIT, linewidth=1.0, linestyle=DASH_DOT, label="-3 dB")
    if bandwidth is not None:
        for axes in (gain, phase):
            axes.axvline(bandwidth, color=INK, linewidth=0.7, linestyle=":")
        beside = -6 if bandwidth > math.sqrt(judged.frequency[0] * judged.frequency[-1]) else 6
        gain.annotate(
            f"{bandwidth:.3g} Hz",
            (bandwidth, 0.06),
            xycoords=("data", "axes fraction"),
            xytext=(beside, 0),
            textcoords="offset points",
            ha="right" if beside < 0 else "left",
            fontsize=8.5,
            color=INK,
        )
    _style_frequency_axes(gain, "amplitude ratio [dB]", "")
    _style_frequency_axes(phase, "phase [degrees]", "frequency [Hz]")
    figure.align_ylabels()
    legend_above(figure, [gain], columns=3)
    width = "it does not fall below -3 dB" if bandwidth is None else f"-3 dB at {bandwidth:.3g} Hz"
    return Picture(
        title="Frequency response",
        caption=f"Amplitude and phase of the force against those of the set force, sine after sine: {width}. "
        "Level gain and a phase near zero up to high frequencies are good.",
        full=figure,
    )


def _style_frequency_axes(axes: Axes, y: str, x: str) -> None:
    style_axes(axes, x=x, y=y)
    axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axes.xaxis.set_minor_formatter(NullFormatter())
