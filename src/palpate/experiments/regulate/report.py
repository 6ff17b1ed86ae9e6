"""Report on a force regulation: outcome, figures, limits of the control, margins and settings."""

import math
from collections.abc import Iterator, Mapping
from functools import partial

import numpy as np

from palpate.controllers.guarded_approach import Loss
from palpate.controllers.surface_motion import stiffness_range
from palpate.experiments.kit.experiment import ExperimentDefaults
from palpate.experiments.kit.metric import NOT_KNOWN
from palpate.experiments.kit.recorded_periods import recorded_series
from palpate.experiments.kit.recorded_run import change_rows, change_sentences
from palpate.experiments.kit.run_report import log_row, report_of
from palpate.experiments.regulate.config import FROM_FILES, MOUNT_DAMPING_RATIO, RegulateConfig
from palpate.experiments.regulate.plan import RegulationPlan
from palpate.experiments.regulate.response import SETTLING_BAND, FrequencyResponse, StepResponse
from palpate.experiments.regulate.result import RegulationResult
from palpate.reporting.data import Quantity, TimeSeries
from palpate.reporting.figure import Axis, Figure, Panel
from palpate.reporting.marks import Band, Dash, Line, Rule, Span
from palpate.reporting.report import Figures, FigureSource, Paragraph, QuantityTable, Report, Section, TextTable
from palpate.reporting.run_figures import force_overview, stretches, true_and_felt
from palpate.robots.known_truth import cost_of, cost_row
from palpate.runtime import Ending
from palpate.runtime.data import Phase
from palpate.runtime.palette import BOUND, FELT, GRID_COLOUR, QUIET_COLOUR, SET, TRUTH

_MILLI = 1e3

_HALF_POWER_DB = -3.0103
"""Amplitude ratio of half power, 20 log10(1 / sqrt 2) [dB]."""

_MIN_GAIN = 1e-6
"""Smallest amplitude ratio on a scale of decibels."""

_SERVO_HALF_POWER = math.sqrt(math.sqrt(2.0) - 1.0)
"""Ratio of the half-power frequency to w of a critically damped servo, 1 / (1 + s / w)^2, whose lag is 2 / w."""

_MAX_STIFFNESS_FACTOR = 3.0
"""Largest error factor of the stiffness at which steps overshoot by at most 10 %; see `STEP_IN_DELAYS`."""

_MIN_SAMPLED_DELAY = 1.5
"""Least delay with a sampled model [control periods]; a delay identified on a moving contact may be shorter."""

_LINES = {"true": (TRUTH, 2.5), "felt": (FELT, 1.2)}
"""Colour and width [px] of a force's line; the widths differ so that both are visible where they agree."""

_TITLES = {
    "constant": "A constant force",
    "step": "Steps of force",
    "ramp": "A ramp of force",
    "sine": "Sines of force",
}

_SURFACES = {
    "sine": "a {} that moves up and down",
    "soft": "a soft {}",
    "yielding": "a {} that yields",
    "leaving": "a {} that leaves",
    "missing": "a {} that is not there",
}

CONTACT_SENTENCES = {
    Loss.UNMADE: "contact was never made",
    Loss.NEVER: "contact was never lost",
    Loss.FOUND: "contact was lost once, sought, and found again",
    Loss.MISSING: "nothing was found at the expected place of the surface, and the tip stopped",
    Loss.BOUNCING: "the tip bounced on every landing, never settled, and gave up",
    Loss.GONE: "contact was lost, one slow search over a few millimetres found no surface, and the tip stopped",
}
"""Contact history of a run as a clause of the outcome."""


def regulation_report(experiment: ExperimentDefaults, regulation: RegulationResult) -> Report:
    """Return the report on a regulation."""
    planned, config, run = regulation.planned, regulation.planned.config, regulation.run
    surface = _SURFACES.get(config.surface)
    where = config.described if surface is None else surface.format(config.object)
    tones = _tones(regulation)
    speed = Quantity("real-time factor", run.real_time_factor, "", f"control at {1.0 / run.timing.period:g} Hz", 3)
    return report_of(
        experiment,
        regulation,
        title=f"{_TITLES[config.profile]} on {where}",
        outcome=" ".join(
            (
                _ending(regulation),
                *change_sentences(regulation.changes, run.duration, "anything was held"),
            )
        ),
        sections=(
            Section("Over time", (QuantityTable((speed,)), Figures(lambda: _over_time(regulation)))),
            Section("Response", (Figures(lambda: _responses(regulation, tones)), TextTable(_tone_rows(tones)))),
            Section("What limits it", tuple(map(Paragraph, limits(planned)))),
            Section("Margins", (QuantityTable(margins(planned)),)),
        ),
        asked=(
            f"a {config.profile} force of {config.force:g} N on {config.thing} (surface: {config.surface}), with "
            f"the tip's motion: {config.motion}; carried by {config.robot}"
        ),
        settings=_settings(regulation),
        footer="Forces that the surface exerts on the finger.",
        reached=run.ending is Ending.DONE,
    )


def _ending(regulation: RegulationResult) -> str:
    run, contact = regulation.run, CONTACT_SENTENCES[regulation.loss]
    if run.ending is Ending.DONE:
        return f"Finished after {run.duration:.1f} s: {contact}; {run.rest}."
    if run.ending is Ending.TRIPPED:
        return f"Stopped by the supervisor: {run.why}; {run.rest}."
    if run.ending is Ending.LOST:
        return f"Not finished after {run.duration:.1f} s: {contact}; {run.rest}."
    return f"Not finished ({run.ending.value}) after {run.duration:.1f} s; {run.rest}."


def limits(planned: RegulationPlan) -> tuple[str, ...]:
    """Return the limits of how fast the force follows its profile, a paragraph each."""
    parameters, gain = planned.parameters, planned.parameters.gain
    servo = _SERVO_HALF_POWER / (math.pi * planned.ready.response)
    lag, delay, time_constant = (_MILLI * x for x in (planned.ready.response, gain.delay, parameters.step_time))
    feedback = gain.gain * gain.stiffness / (2.0 * math.pi)
    steps = (
        f"Steps: the set force changes with a time constant of {time_constant:.3g} ms, "
        f"{parameters.step_time / gain.delay:.2g} delays, because the stiffness is only assumed. Steps on a fixed "
        f"surface then overshoot by less than 10 %, even if the stiffness is off by a factor of "
        f"{_MAX_STIFFNESS_FACTOR:g}. With --identify they are as fast as the loop."
        if parameters.step_time
        else f"Steps: the set force changes as fast as the loop, whose delay is {delay:.3g} ms."
    )
    return (
        "Sines and ramps: the rate of the set force is fed forward, as the velocity rate / stiffness. The servos "
        f"limit the bandwidth: their lag of {lag:.3g} ms halves the power at {servo:.2g} Hz. A wrong stiffness or "
        "damping costs some of it, and so does an object on a mount. Quicker servos raise it.",
        steps,
        f"Feedback rejects unexpected disturbances below {feedback:.2g} Hz, which is gain times stiffness / 2 pi. "
        f"Two things bound it: the delay of {delay:.3g} ms, and the contact's damping, which acts on a loop with "
        "delay like more stiffness. Less delay raises it.",
    )


def margins(planned: RegulationPlan) -> tuple[Quantity, ...]:
    """Return the margins of the force control."""
    gain, period, found, contact = planned.parameters.gain, planned.period, planned.identified, planned.contact
    origin = "as identified" if found is not None else "as assumed"
    rows = [
        Quantity("stiffness of contact and robot", gain.stiffness / 1e3, "kN/m", origin),
        Quantity("delay", _MILLI * gain.delay, "ms", origin, 3),
        Quantity("force gain", _MILLI * gain.gain, "mm/s/N", f"k K T = {gain.loop_gain:.2g}", 3),
    ]
    if contact is not None:
        damped = contact.margins(gain)
        rows += [
            Quantity("gain margin", damped.gain_margin, "", "of feedback alone, on a surface at rest", 3),
            Quantity("phase margin", damped.phase_margin_deg, "degrees", "of the model", 3),
            Quantity("modulus margin", damped.modulus_margin, "", "distance of the loop from instability", 3),
            Quantity("contact damping time", _MILLI * contact.surface_damping_time, "ms", origin, 3),
        ]
    if found is not None:
        rows += [
            Quantity("phase margin", found.phase_margin_deg, "degrees", "as measured", 3),
            Quantity("stiffness of the touched object", found.contact_stiffness / 1e3, "kN/m", "as identified"),
            Quantity("contact damping time", _MILLI * found.damping_time, "ms", "as identified", 3),
        ]
    if gain.delay >= _MIN_SAMPLED_DELAY * period:
        for name, share, note in (
            ("stable for a stiffness", 1.0, "the assumed one; beyond, it oscillates"),
            ("once the gain is halved", 0.5, "the assumed one"),
        ):
            stable = stiffness_range(gain, planned.follow, period, share)
            most = "more than 10" if math.isinf(stable.stiffest) else f"{stable.stiffest:.2g}"
            rows.append(Quantity(name, f"{stable.softest:.2g} to {most}", "times", note))
    return tuple(rows)


def _settings(regulation: RegulationResult) -> tuple[tuple[str, str], ...]:
    planned, config = regulation.planned, regulation.planned.config
    parameters, axis = planned.parameters, planned.parameters.axis
    known = regulation.truth.known
    rubs = f"{config.friction:g}, {_MILLI * config.spin_length:g} mm"
    return (
        ("object", f"{config.thing}, {config.surface}{_surface_motion(config)}"),
        ("profile", f"{config.profile}{_profile(config)}"),
        ("duration of the profile", f"{parameters.duration:g} s"),
        ("motion along the surface", _motion(config)),
        ("force along", "the contact's normal" if axis is None else " ".join(f"{x:.3g}" for x in axis)),
        ("contact stiffness, simulated", f"{config.true_stiffness / 1e3:g} kN/m" if known else NOT_KNOWN),
        ("friction, spin length, simulated", rubs if known else NOT_KNOWN),
        ("sensor", f"{type(planned.ready.finger).__name__}, drift {config.drift:g} N/min, seed {config.seed}"),
        ("landing speed", f"{_MILLI * parameters.landing_speed:.3g} mm/s"),
        ("robot", config.robot),
        *cost_row(cost_of(planned.ready.backend)),
        *change_rows(regulation.changes),
        ("control period", f"{_MILLI * planned.period:g} ms"),
        *log_row(regulation.run),
    )


def _surface_motion(config: RegulateConfig) -> str:
    if config.surface == "sine":
        return f" of {_MILLI * config.surface_amplitude:g} mm, up to {_MILLI * config.surface_speed:g} mm/s"
    if config.surface == "yielding":
        return (
            f" on a mount of {config.mount_stiffness / 1e3:g} kN/m, damping ratio {MOUNT_DAMPING_RATIO:g}, "
            f"{config.mount_mass:g} kg"
        )
    if config.surface == "leaving":
        return f" after {config.leave_time:g} s at {_MILLI * config.surface_speed:g} mm/s"
    return ""


def _profile(config: RegulateConfig) -> str:
    if config.profile == "constant":
        return f", {config.force:g} N"
    if config.profile == "sine":
        tones = ", ".join(f"{frequency:g}" for frequency in config.frequencies)
        return f", {config.force:g} N with {config.swung:g} N at {tones} Hz"
    return f", {config.force:g} to {config.greatest:g} N"


def _motion(config: RegulateConfig) -> str:
    if config.motion == "still":
        return "none"
    if config.motion in FROM_FILES:
        return f"{config.motion} of {config.motion_file}"
    return f"{config.motion} of {_MILLI * config.motion_size:g} mm, up to {_MILLI * config.motion_speed:g} mm/s"


def _tones(regulation: RegulationResult) -> dict[str, FrequencyResponse]:
    """Return the frequency responses by force; the judged force first."""
    true = regulation.judged_tones if regulation.truth.known else None
    tones = {"true": true, "felt": regulation.felt_tones}
    return {name: response for name, response in tones.items() if response is not None}


def _tone_rows(tones: Mapping[str, FrequencyResponse]) -> list[tuple[str, str, str, str]]:
    return [
        (f"{name} force at {frequency:g} Hz", f"{gain:.3f}", "times", f"phase {phase:.0f} degrees")
        for name, response in list(tones.items())[:1]
        for frequency, gain, phase in zip(response.frequency, response.gain, response.phase_deg, strict=True)
    ]


# --- figures ---


def _over_time(regulation: RegulationResult) -> Iterator[FigureSource]:
    if len(regulation.record):
        series = series_of(regulation)
        yield partial(force_overview, series)
        yield partial(error_figure, series)


def _responses(regulation: RegulationResult, tones: Mapping[str, FrequencyResponse]) -> Iterator[FigureSource]:
    true = regulation.judged_steps if regulation.truth.known else None
    yield partial(step_figure, true, regulation.felt_steps)
    if tones:
        yield partial(bode_figure, tones)


def series_of(regulation: RegulationResult) -> TimeSeries:
    """Return forces and phases over time."""
    known = regulation.truth.known
    true = np.where(regulation.truth.touching, regulation.true_force, np.nan) if known else None
    return recorded_series(regulation.record, regulation.set_force, regulation.sensed_force, true)


def error_figure(series: TimeSeries) -> Figure | None:
    """Return the figure of the force error during the profile; None if the profile never ran."""
    held = [(begin, end) for name, begin, end in stretches(series) if name == Phase.HOLD and end > begin]
    if not held:
        return None
    shown = np.zeros(len(series.time), dtype=np.bool_)
    for begin, end in held:
        shown |= (series.time >= begin) & (series.time < end)
    setpoint = np.where(shown, series.set_force, np.nan)  # lines are broken outside the profile
    true = None if series.true_force is None else _MILLI * (series.true_force - setpoint)
    lines = true_and_felt(series.time, true, _MILLI * (series.measured_force - setpoint))
    return Figure(
        title="Force error while holding",
        caption="Felt and true force less the set force, while the profile ran; close to zero is good.",
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
    """Return the figure of the mean step response of true force, felt force or both; None without both."""
    judged = felt if true is None else true
    if judged is None:
        return None
    time, count = _MILLI * judged.time, judged.count
    each = Band(time, judged.each.min(axis=0), judged.each.max(axis=0), "single steps", QUIET_COLOUR)
    responses = {name: response for name, response in (("true", true), ("felt", felt)) if response is not None}
    lines = (Line(time, response.mean, name, *_LINES[name]) for name, response in responses.items())
    rise = (Rule(_MILLI * at, dash=Dash.DOTTED) for at in judged.rise if all(map(math.isfinite, judged.rise)))
    low, high, band = 1.0 - SETTLING_BAND, 1.0 + SETTLING_BAND, f"within {100.0 * SETTLING_BAND:g} %"
    return Figure(
        title="Step response",
        caption=(
            f"Mean of {count} step{'s' if count > 1 else ''} up and down, each scaled to go from 0 to 1, and the "
            "range of the single steps; dotted: 10 and 90 %, the ends of the rise time. A quick rise that stays "
            "within the band is good."
        ),
        panels=(
            Panel(
                (
                    Span(low, high, band, GRID_COLOUR, upright=False),
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
    """Return the Bode plot of frequency responses ("true", "felt"): at least one, the judged one first."""
    bandwidth = next(iter(tones.values())).bandwidth
    frequency = Axis("frequency", "Hz", logarithmic=True)
    gain, phase = [], []
    for name, response in tones.items():
        decibels = 20.0 * np.log10(np.maximum(response.gain, _MIN_GAIN))
        gain.append(Line(response.frequency, decibels, name, *_LINES[name], points=True))
        phase.append(Line(response.frequency, response.phase_deg, "", *_LINES[name], points=True))
    at = () if bandwidth is None else (Rule(bandwidth, dash=Dash.DOTTED),)
    width = "it does not fall below -3 dB" if bandwidth is None else f"-3 dB (dotted) at {bandwidth:.3g} Hz"
    return Figure(
        title="Frequency response",
        caption=f"Amplitude ratio and phase of the force against the set force, one point per sine: {width}. "
        "A level gain and a phase near zero up to high frequencies are good.",
        panels=(
            Panel(
                (*gain, Rule(_HALF_POWER_DB, "-3 dB", BOUND, dash=Dash.DASH_DOT, upright=False), *at),
                frequency,
                Axis("amplitude ratio", "dB"),
                height=240,
            ),
            Panel((*phase, *at), frequency, Axis("phase", "degrees"), height=220),
        ),
    )
