"""The report on a regulation of force."""

import math
from collections.abc import Iterator
from functools import partial

import numpy as np

from palpate.experiments.kit.recorded_periods import recorded_series
from palpate.experiments.regulate.figures import bode_figure, error_figure, step_figure
from palpate.experiments.regulate.quantities import margins, quantities
from palpate.experiments.regulate.response import FrequencyResponse
from palpate.experiments.regulate.result import RegulationResult
from palpate.experiments.regulate.words import asked, limits, outcome, settings, title
from palpate.reporting.data import TimeSeries
from palpate.reporting.report import Figures, FigureSource, Paragraph, QuantityTable, Report, Section, TextTable
from palpate.reporting.run_figures import computing, force_overview
from palpate.runtime import Ending

LEAST_GAIN_MARGIN = 2.0
"""Below it a loop is nearer to swinging than is usual (6 dB)."""


def regulation_report(regulation: RegulationResult) -> Report:
    """Return the report on a regulation."""
    tones = _tones(regulation)
    return Report(
        title=title(regulation),
        outcome=outcome(regulation),
        metrics=quantities(regulation),
        sections=(
            Section("Over time", (Figures(lambda: _over_time(regulation)),)),
            Section("Response", (Figures(lambda: _responses(regulation, tones)), TextTable(_tone_rows(tones)))),
            Section("What limits it", tuple(Paragraph(each) for each in limits(regulation.planned))),
            Section("Margins", (QuantityTable(margins(regulation.planned)),)),
            computing(regulation.run.timing),
        ),
        asked=asked(regulation.planned.config),
        advice=advice(regulation),
        settings=settings(regulation),
        footer="Forces that the surface exerts on the finger.",
        reached=regulation.run.ending is Ending.DONE,
    )


def advice(regulation: RegulationResult) -> tuple[str, ...]:
    """Return what to do after a regulation of force."""
    sentences, planned = list[str](), regulation.planned
    if regulation.guard_trips and not planned.config.identify:
        sentences.append(
            "Force control swung: repeat with --identify, which measures stiffness and delay of this contact."
        )
    margin = planned.parameters.gain.gain_margin
    if math.isfinite(margin) and margin < LEAST_GAIN_MARGIN:
        sentences.append(
            f"The gain margin of {margin:.2g} is small: a stiffer --assumed-stiffness lowers the gain."
        )
    if regulation.peak > planned.limits.force:
        sentences.append(
            "The force went beyond its limit: land more slowly (--landing-speed), or press with less."
        )
    return tuple(sentences)


def series_of(regulation: RegulationResult) -> TimeSeries:
    """Return what happened over time."""
    record, known = regulation.record, regulation.truth.known
    true = np.where(regulation.truth.touching, regulation.true_force, np.nan) if known else None
    return recorded_series(record, regulation.set_force, regulation.sensed_force, true)


def _tones(regulation: RegulationResult) -> dict[str, FrequencyResponse]:
    """The frequency responses, by force; the one that is judged first."""
    true = regulation.judged_tones if regulation.truth.known else None
    tones = {"true": true, "felt": regulation.felt_tones}
    return {name: response for name, response in tones.items() if response is not None}


def _tone_rows(tones: dict[str, FrequencyResponse]) -> list[tuple[str, str, str, str]]:
    return [
        (f"{name} force at {frequency:g} Hz", f"{gain:.3f}", "times", f"phase {phase:.0f} degrees")
        for name, response in list(tones.items())[:1]
        for frequency, gain, phase in zip(response.frequency, response.gain, response.phase_deg, strict=True)
    ]


def _over_time(regulation: RegulationResult) -> Iterator[FigureSource]:
    if len(regulation.record):
        series = series_of(regulation)
        yield partial(force_overview, series)
        yield partial(error_figure, series)


def _responses(regulation: RegulationResult, tones: dict[str, FrequencyResponse]) -> Iterator[FigureSource]:
    judged, felt = regulation.judged_steps, regulation.felt_steps
    if judged is not None:
        yield partial(step_figure, judged if regulation.truth.known else None, felt)
    if tones:
        yield partial(bode_figure, tones)
