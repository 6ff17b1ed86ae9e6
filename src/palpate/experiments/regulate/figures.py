"""Figures of force control: error while holding, step response, and a Bode plot."""

import math
from collections.abc import Mapping

import numpy as np

from palpate.experiments.regulate.response import SETTLED, FrequencyResponse, StepResponse
from palpate.reporting.data import TimeSeries
from palpate.reporting.figure import Axis, Figure, Panel
from palpate.reporting.marks import Band, Dash, Line, Rule, Span
from palpate.reporting.run_figures import stretches, true_and_felt
from palpate.runtime.data import Phase
from palpate.runtime.palette import BOUND, FELT, GRID_COLOUR, QUIET_COLOUR, SET, TRUTH

MILLI = 1e3

HALF_POWER_DB = -3.0103
"""20 log10(1 / sqrt 2)."""

LEAST_GAIN = 1e-6
"""Of amplitudes on a scale of decibels."""

COLOURS = {"true": TRUTH, "felt": FELT}
WIDTHS = {"true": 2.5, "felt": 1.2}
"""[px], so that both are seen where they agree."""


def error_figure(series: TimeSeries) -> Figure | None:
    """Return the figure of the force's error while it is held, or None if it never was."""
    held = [(begin, end) for name, begin, end in stretches(series) if name == Phase.HOLD and end > begin]
    if not held:
        return None
    shown = np.zeros(len(series.time), dtype=np.bool_)
    for begin, end in held:
        shown |= (series.time >= begin) & (series.time < end)
    wanted = np.where(shown, series.set_force, np.nan)  # lines are broken where it is not held
    true = None if series.true_force is None else MILLI * (series.true_force - wanted)
    lines = true_and_felt(series.time, true, MILLI * (series.measured_force - wanted))
    return Figure(
        title="Force error while holding",
        caption=(
            "Felt and true force less the set one, while the profile was held; the nearer to zero the better."
        ),
        panels=(
            Panel(
                (*lines, Rule(0.0, "set", SET, dash=Dash.DASHED, upright=False)),
                Axis("time", "s", held[0][0], held[-1][1], run_time=True),
                Axis("force error", "mN"),
            ),
        ),
        wide=True,
    )


def step_figure(true: StepResponse | None, felt: StepResponse | None) -> Figure | None:
    """Return the figure of the mean step response, of true force, felt force or both; None if of neither."""
    judged = felt if true is None else true
    if judged is None:
        return None
    time, count = MILLI * judged.time, judged.count
    each = Band(time, judged.each.min(axis=0), judged.each.max(axis=0), "single steps", QUIET_COLOUR)
    means = (("true", true), ("felt", felt))
    lines = (Line(time, it.mean, name, COLOURS[name], WIDTHS[name]) for name, it in means if it is not None)
    rise = (Rule(MILLI * at, dash=Dash.DOTTED) for at in judged.rise if all(map(math.isfinite, judged.rise)))
    return Figure(
        title="Step response",
        caption=(
            f"Mean of {count} step{'s' if count > 1 else ''} up and down, each scaled to go from 0 to 1, and "
            "between which limits the single ones are; dotted: 10 and 90 %, between which the rise is counted. "
            "Quick, and within the band at once, is good."
        ),
        panels=(
            Panel(
                (
                    Span(
                        1.0 - SETTLED, 1.0 + SETTLED, f"within {100.0 * SETTLED:g} %", GRID_COLOUR, upright=False
                    ),
                    each,
                    *lines,
                    Rule(1.0, "set", SET, dash=Dash.DASHED, upright=False),
                    *rise,
                ),
                Axis("time since the step", "ms"),
                Axis("share of the step"),
                height=360,
            ),
        ),
    )


def bode_figure(tones: Mapping[str, FrequencyResponse]) -> Figure:
    """Return the Bode plot of frequency responses ("true", "felt"); there is at least one, the first is judged."""
    bandwidth = next(iter(tones.values())).bandwidth
    frequency = Axis("frequency", "Hz", logarithmic=True)
    gain, phase = [], []
    for name, response in tones.items():
        colour, thick = COLOURS[name], WIDTHS[name]
        decibels = 20.0 * np.log10(np.maximum(response.gain, LEAST_GAIN))
        gain.append(Line(response.frequency, decibels, name, colour, thick, points=True))
        phase.append(Line(response.frequency, response.phase_deg, "", colour, thick, points=True))
    at = () if bandwidth is None else (Rule(bandwidth, dash=Dash.DOTTED),)
    width = "it does not fall below -3 dB" if bandwidth is None else f"-3 dB (dotted) at {bandwidth:.3g} Hz"
    return Figure(
        title="Frequency response",
        caption=f"Amplitude and phase of the force against those of the set force, sine after sine: {width}. "
        "Level gain and a phase near zero up to high frequencies are good.",
        panels=(
            Panel(
                (*gain, Rule(HALF_POWER_DB, "-3 dB", BOUND, dash=Dash.DASH_DOT, upright=False), *at),
                frequency,
                Axis("amplitude ratio", "dB"),
                height=240,
            ),
            Panel((*phase, *at), frequency, Axis("phase", "degrees"), height=220),
        ),
    )
