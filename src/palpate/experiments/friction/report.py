"""The report on the friction of a surface."""

import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from palpate.errors import FloatArray
from palpate.experiments.friction.figures import (
    length_figure,
    speed_figure,
    stroke_figure,
    surface_figure,
)
from palpate.experiments.friction.measured import frictions, lengths, speeds, table_rows
from palpate.experiments.friction.plan import FILE_NAME
from palpate.experiments.friction.quantities import quantities
from palpate.experiments.friction.recognised import recognition_section
from palpate.experiments.friction.result import FrictionResult
from palpate.experiments.friction.slip_points import slip_points
from palpate.experiments.friction.stroke_curves import stroke_curves
from palpate.experiments.friction.summary import measured_lengths
from palpate.experiments.friction.words import outcome, settings
from palpate.experiments.kit.recorded_periods import recorded_series
from palpate.reporting.figure import Figure
from palpate.reporting.report import Figures, FigureSource, Report, Section, TextTable
from palpate.reporting.run_figures import computing, force_overview
from palpate.runtime import Ending

CURVE_POINTS = 80
"""Of mu over speed, along the fitted curve."""

WIDE = 0.2
"""An interval whose half is more than this share of its value is worth another measurement."""

OVER_TIME = (
    "Normal force found by touch, and asked for while it rubbed, above the speed of the fingertip; the ground "
    "shows what the controller was doing. Good is a force that stays at what was asked for."
)
"""Caption of the forces over time: unlike other reports', they are shown without the simulation's."""


def friction_report(result: FrictionResult) -> Report:
    """Return the report."""
    config, wanted = result.plan.config, result.plan.wanted
    loads = ", ".join(f"{load:g}" for load in wanted.loads)
    known, over_speed = result.recognised, speeds(result)
    return Report(
        title=f"Friction of a {config.object} by touch",
        outcome=outcome(result),
        metrics=quantities(result),
        sections=(
            *(() if known is None else (recognition_section(result, known),)),
            Section("What was felt", (Figures(lambda: _felt(result)),)),
            Section(
                "At each load",
                (
                    TextTable(
                        [
                            *table_rows(frictions(result), "mu", "N", 1.0),
                            *table_rows(lengths(result), "e", "N", 1.0, "mm", 1e3),
                        ]
                    ),
                ),
            ),
            # a single one stands among the loads
            Section(
                "At each speed",
                (TextTable(table_rows(over_speed, "mu", "mm/s", 1e3) if len(over_speed) > 1 else []),),
            ),
            Section("Over time", (Figures(lambda: _over_time(result)),)),
            computing(result.run.timing),
        ),
        asked=f"to rub a {config.object} with {loads} N at {1e3 * wanted.speed:g} mm/s, carried by {config.robot}",
        advice=tuple(_advice(result)),
        settings=settings(result),
        footer=(
            "Loads that the surface exerts on the finger. Intervals are to hold the true value in 95 of 100 runs: "
            "they count calibration and drift of the sensor too."
        ),
        reached=result.run.ending is Ending.DONE and result.found.verdict.ok,
    )


def _advice(result: FrictionResult) -> Iterator[str]:
    if result.file is None:
        yield "Nothing was rubbed: check where the surface is, and repeat."
        return
    for broken in result.found.verdict.broken:
        yield f"{broken.remedy[0].upper()}{broken.remedy[1:]}."
    found = result.file.friction
    if not math.isfinite(found.upper):
        yield "It never slipped for long enough: longer strokes (--most-travel) or less load measure mu."
    elif found.upper - found.lower > 2.0 * WIDE * found.value:
        yield "The interval of mu is wide: --repeats 3, or larger --loads, narrow it."
    yield f"To hold an object by what was found: palpate grasp --friction-file {FILE_NAME}."


def _felt(result: FrictionResult) -> Iterator[FigureSource]:
    points, file = slip_points(result), result.file
    creeping = file is not None and any(each.creeping for each in file.speeds)
    bent = result.plan.config.object == "sphere"
    yield lambda: stroke_figure(stroke_curves(result), frictions(result), bent=bent)
    yield lambda: None if points is None else surface_figure(points)
    yield lambda: length_figure(lengths(result), _growth(result))
    yield lambda: speed_figure(speeds(result), _curve(result), creeping=creeping)


def _growth(result: FrictionResult) -> tuple[float, float] | None:
    """C [m] and gamma of the line through e over the load, if there is one."""
    file = result.file
    if file is None or file.spin_length is None or len(measured_lengths(result.found.loads)) < 2:
        return None
    return file.spin_length.value, file.load_exponent.value


def _curve(result: FrictionResult) -> FloatArray | None:
    """Speeds [m/s] and mu of the curve through them, shape (2, n); None without one."""
    curve, felt = result.found.curve, result.found.speeds
    if curve is None:
        return None
    v = np.geomspace(0.8 * felt[0].speed, 1.25 * felt[-1].speed, CURVE_POINTS)
    return np.stack([v, [curve.friction_at(speed) for speed in v.tolist()]])


def _over_time(result: FrictionResult) -> Iterator[Figure | None]:
    record = result.record
    if not len(record):
        return
    wanted = np.full(len(record), np.nan)
    for pair in result.pairs:
        for stroke in pair.pair.both:
            inside = (record.time >= stroke.time[0]) & (record.time <= stroke.time[-1])
            wanted[inside] = pair.rub.normal_force
    forces = force_overview(recorded_series(record, wanted))
    yield None if forces is None else replace(forces, caption=OVER_TIME)
