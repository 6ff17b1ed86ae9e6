"""Report on the friction of a surface: outcome, tables at each load and speed, figures and settings."""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from palpate.experiments.friction.figures import Interval, friction_figures, frictions, lengths, speeds
from palpate.experiments.friction.plan import FrictionPlan
from palpate.experiments.friction.recognition import library_path, recognition_section
from palpate.experiments.friction.result import FrictionResult
from palpate.experiments.kit.experiment import ExperimentDefaults
from palpate.experiments.kit.metric import NOT_KNOWN
from palpate.experiments.kit.recorded_periods import recorded_series
from palpate.experiments.kit.run_report import log_row, report_of
from palpate.reporting.data import interval_words, value_words
from palpate.reporting.figure import Figure
from palpate.reporting.report import Figures, Report, Section, TextTable
from palpate.reporting.run_figures import force_overview
from palpate.robots.known_truth import cost_of, cost_row
from palpate.runtime import Ending

_MIN_ZERO_DRIFT = 0.01
"""Smallest drift of a sensor's zero that is shown as a number [mN]: a thousandth of its noise."""

_OVER_TIME = (
    "Normal force estimated by touch and set normal force of the rubs, above the speed of the fingertip; the "
    "ground shows the controller's phase. A force at its set value is good."
)
"""Caption of the forces over time; unlike other reports', they lack the simulated force."""


def friction_report(experiment: ExperimentDefaults, result: FrictionResult) -> Report:
    """Return the report."""
    config, wanted = result.plan.config, result.plan.wanted
    loads = ", ".join(f"{load:g}" for load in wanted.loads)
    known, over_speed = result.recognised, speeds(result)
    return report_of(
        experiment,
        result,
        title=f"Friction of a {config.object} by touch",
        outcome=_ending(result),
        sections=(
            *(() if known is None else (recognition_section(result, known),)),
            Section("What was felt", (Figures(lambda: friction_figures(result)),)),
            Section(
                "At each load",
                (
                    TextTable(
                        [
                            *_rows(frictions(result), "mu", "N", 1.0),
                            *_rows(lengths(result), "e", "N", 1.0, "mm", 1e3),
                        ]
                    ),
                ),
            ),
            # a single speed stands among the loads
            Section(
                "At each speed",
                (TextTable(_rows(over_speed, "mu", "mm/s", 1e3) if len(over_speed) > 1 else []),),
            ),
            Section("Over time", (Figures(lambda: _over_time(result)),)),
        ),
        asked=f"to rub a {config.object} with {loads} N at {1e3 * wanted.speed:g} mm/s, carried by {config.robot}",
        settings=_settings(result),
        footer=(
            "Loads that the surface exerts on the finger. Intervals hold the true value in 95 of 100 runs; they "
            "cover calibration and drift of the sensor too."
        ),
        reached=result.run.ending is Ending.DONE and result.found.verdict.ok,
    )


def _ending(result: FrictionResult) -> str:
    run, count = result.run, len(result.pairs)
    rubs = "1 rub" if count == 1 else f"{count} rubs"
    if run.ending is Ending.DONE:
        return f"Finished after {run.duration:.1f} s: {rubs} there and back; {run.rest}."
    if run.ending is Ending.TRIPPED:
        return f"Stopped by the supervisor after {rubs}: {run.why}; {run.rest}."
    if run.ending is Ending.LOST and not count:
        return f"Not finished: nothing was found at the expected place of the surface; {run.rest}."
    return f"Not finished ({run.ending.value}) after {run.duration:.1f} s and {rubs}; {run.rest}."


def _rows(
    intervals: Sequence[Interval], name: str, at_unit: str, at_factor: float, unit: str = "", factor: float = 1.0
) -> list[tuple[str, str, str, str]]:
    """Return a row per interval: name, value, unit and interval.

    Args:
        intervals: Intervals to show.
        name: Name of the quantity.
        at_unit: Shown unit of load or speed.
        at_factor: Factor from the SI unit to `at_unit`.
        unit: Shown unit of the quantity.
        factor: Factor from the SI unit to `unit`.
    """
    rows = []
    for each in intervals:
        true = "" if each.true is None else f"; true {factor * each.true:.4g}"
        if each.bound:
            value = f"at least {factor * each.value:.3g}"
            note = f"{each.reason or 'it never slipped'}: a lower bound"
        else:
            scaled = factor * each.value, factor * each.lower, factor * each.upper
            value, note = value_words(*scaled), interval_words(*scaled)
        rows.append((f"{name} at {at_factor * each.at:.3g} {at_unit}", value, unit, note + true))
    return rows


def _over_time(result: FrictionResult) -> Iterator[Figure | None]:
    record = result.record
    if not len(record):
        return
    setpoint = np.full(len(record), np.nan)
    for pair in result.pairs:
        for stroke in pair.pair.both:
            inside = (record.time >= stroke.time[0]) & (record.time <= stroke.time[-1])
            setpoint[inside] = pair.rub.normal_force
    forces = force_overview(recorded_series(record, setpoint))
    yield None if forces is None else replace(forces, caption=_OVER_TIME)


def _settings(result: FrictionResult) -> tuple[tuple[str, str], ...]:
    plan, air = result.plan, result.air
    config, wanted = plan.config, plan.wanted
    size = " x ".join(f"{1e3 * length:g}" for length in config.sizes)
    slip_speeds = ", ".join(f"{1e3 * speed:g}" for speed in sorted({wanted.speed, *wanted.speeds}))
    zero = "not measured"
    if air is not None:
        drift = 1e3 * float(abs(air.moved[:3]).max())
        shown = f"{drift:.2f} mN" if drift >= _MIN_ZERO_DRIFT else f"less than {_MIN_ZERO_DRIFT:g} mN"
        zero = f"subtracted; it drifted by {shown}"
    path, known = library_path(config), result.recognised
    library = () if path is None else (("library", str(path)),)
    if path is not None and known is not None:
        library = (("library", f"{path}; {known.recognition.library.fingertip}"),)
    return (
        ("object", f"{config.object}, {size} mm"),
        ("simulated friction", friction_words(plan) if plan.truth_known else NOT_KNOWN),
        ("loads", f"{', '.join(f'{load:g}' for load in wanted.loads)} N"),
        ("slip speeds", f"{slip_speeds} mm/s"),
        ("strokes", f"{1e3 * wanted.travel:g} to {1e3 * wanted.most_travel:.3g} mm"),
        ("turns", f"up to {wanted.most_spin:g} rad/s" if wanted.most_spin else "none: this robot cannot"),
        ("contact stiffness", f"{config.stiffness / 1e3:g} kN/m"),
        ("sensor's zero", zero),
        ("landing speed", f"{1e3 * plan.parameters.landing_speed:.3g} mm/s"),
        ("robot", config.robot),
        ("seed", str(config.seed)),
        *library,
        *cost_row(cost_of(plan.ready.backend)),
        ("control period", f"{1e3 * plan.ready.backend.period:g} ms"),
        *log_row(result.run),
    )


def friction_words(plan: FrictionPlan) -> str:
    """Return the complete friction law of the simulated surface, effects outside the estimates included."""
    config, plant = plan.config, plan.plant
    if plant is None:
        return (
            f"MuJoCo's friction: mu {config.friction:g}, e {1e3 * config.spin_length:g} mm at all loads, p 2 "
            "(an ellipse)"
        )
    mu = f"mu {plant.kinetic_friction:g}"
    if plant.static_friction > plant.kinetic_friction:
        mu += f" ({plant.static_friction:g} at rest, Stribeck speed {1e3 * plant.stribeck_speed:g} mm/s)"
    if plant.viscous_friction:
        mu += f", growing by {plant.viscous_friction:g} per m/s"
    return (
        f"the friction plant: {mu}, e at 1 N {1e3 * plant.spin_length:g} mm, gamma {plant.load_exponent:g}, "
        f"p {plant.norm_exponent:g}, skin stiffness {plant.stiffness / 1e3:g} kN/m"
    )
