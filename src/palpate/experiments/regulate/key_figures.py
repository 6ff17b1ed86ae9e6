"""The figures of the report on a regulation of force, and the margins that it had."""

import math

from palpate.controllers.surface_motion import StiffnessRange, stiffness_range
from palpate.experiments.regulate.plan import RegulationPlan
from palpate.experiments.regulate.response import RISE_FROM, RISE_TO, SETTLED, FrequencyResponse, StepResponse
from palpate.experiments.regulate.result import Regulation
from palpate.experiments.regulate.words import landing_words
from palpate.reporting.data import KeyFigure
from palpate.robots.known_truth import NOT_KNOWN, time_name

LEAST_SAMPLED_DELAY = 1.5
"""Periods of control: a delay below that, as identified on a contact that is led, has no sampled model."""

STABLE = "stable for a stiffness"
"""Of feedback and surface following together: the range of stiffness over its assumed value."""


def key_figures(regulation: Regulation) -> tuple[KeyFigure, ...]:
    """Return the figures that matter, most important first."""
    planned, config, result = regulation.planned, regulation.planned.config, regulation.run
    moving = config.profile in ("step", "sine")
    note = "what the set force changes by included" if moving else "first half second left out"
    judged = "true" if regulation.truth.known else "felt"
    figures = [
        KeyFigure("true force, RMS error", regulation.true_rms, "N", note, digits=3)
        if regulation.truth.known
        else KeyFigure("true force", NOT_KNOWN),
        KeyFigure("felt force, RMS error", regulation.sensed_rms, "N", digits=3),
        KeyFigure(
            "largest force of landing", regulation.landing_peak, "N", f"at {landing_words(planned)}", digits=3
        ),
        KeyFigure("largest force of the run", regulation.peak, "N", f"limit {planned.limits.force:g} N", digits=3),
    ]
    steps = regulation.judged_steps
    if steps is not None:
        figures = _step_figures(steps, judged) + figures
    tones = regulation.judged_tones
    if tones is not None:
        figures = _tone_figures(tones, judged) + figures
    error = round(regulation.sensor_error, 6) + 0.0  # of a perfect sensor, rounding errors are left; no -0
    return (
        *figures,
        KeyFigure("felt less true force at the end", error, "N", "what the sensor is off", 3),
        KeyFigure("contact", regulation.loss.value, "", _bounced(regulation.bounces)),
        KeyFigure("gain halved", regulation.guard_trips, "times", "because force control swung"),
        KeyFigure(time_name(regulation.cost), result.duration, "s"),
        KeyFigure(
            "real-time factor", result.real_time_factor, "", f"control at {1.0 / result.timing.period:g} Hz", 3
        ),
    )


def _bounced(times: int) -> str:
    return "" if times == 0 else f"bounced {times} time{'s' if times > 1 else ''} on landing"


def _step_figures(steps: StepResponse, judged: str) -> list[KeyFigure]:
    return [
        KeyFigure(
            "rise time",
            1e3 * steps.rise_time,
            "ms",
            f"from {100.0 * RISE_FROM:g} to {100.0 * RISE_TO:g} % of the mean step, {judged} force",
            digits=3,
        ),
        KeyFigure(
            "overshoot",
            100.0 * steps.overshoot,
            "%",
            f"beyond the step's height; worst step {100.0 * steps.largest_overshoot:.2g} %",
            digits=2,
        ),
        KeyFigure(
            "settling time",
            1e3 * steps.settling_time,
            "ms",
            f"until it stays within {100.0 * SETTLED:g} % of the step's height",
            digits=3,
        ),
    ]


def _tone_figures(tones: FrequencyResponse, judged: str) -> list[KeyFigure]:
    width, highest = tones.bandwidth, float(tones.frequency[-1])
    value: float | str = f"beyond {highest:g}" if width is None else width
    return [
        KeyFigure("bandwidth", value, "Hz", f"{judged} per set amplitude first below 0.707 (-3 dB)", digits=3),
        KeyFigure("largest amplitude ratio", tones.peak, "", digits=3),
    ]


def margins(planned: RegulationPlan) -> tuple[KeyFigure, ...]:
    """Return the margins of the force control."""
    gain, period, found = planned.parameters.gain, planned.period, planned.identified
    origin = "as identified" if found is not None else "as assumed"
    figures = [
        KeyFigure("stiffness of contact and robot", gain.stiffness / 1e3, "kN/m", origin),
        KeyFigure("delay", 1e3 * gain.delay, "ms", origin, digits=3),
        KeyFigure("force gain", 1e3 * gain.gain, "mm/s/N", f"k K T = {gain.loop_gain:.2g}", 3),
    ]
    contact = planned.contact
    if contact is not None:
        damped = contact.margins(gain)
        damping = 1e3 * contact.surface_damping_time
        figures += [
            KeyFigure(
                "gain margin",
                damped.gain_margin,
                "",
                "of feedback alone, on a surface that is not followed",
                3,
            ),
            KeyFigure("phase margin", damped.phase_margin_deg, "degrees", "of the model", digits=3),
            KeyFigure("modulus margin", damped.modulus_margin, "", "distance of the loop from instability", 3),
            KeyFigure("contact damping time", damping, "ms", origin, 3),
        ]
    if found is not None:
        figures += [
            KeyFigure("phase margin", found.phase_margin_deg, "degrees", "as measured", digits=3),
            KeyFigure("stiffness of what is touched", found.contact_stiffness / 1e3, "kN/m", "as identified"),
            KeyFigure("contact damping time", 1e3 * found.damping_time, "ms", "as identified", 3),
        ]
    if gain.delay >= LEAST_SAMPLED_DELAY * period:
        whole, halved = (stiffness_range(gain, planned.follow, period, share) for share in (1.0, 0.5))
        figures += [
            KeyFigure(STABLE, _range(whole), "times", "the assumed one; beyond, it oscillates"),
            KeyFigure("once it swung", _range(halved), "times", "likewise: it goes on with half of the gain"),
        ]
    return tuple(figures)


def _range(bears: StiffnessRange) -> str:
    most = "more than 10" if math.isinf(bears.stiffest) else f"{bears.stiffest:.2g}"
    return f"{bears.softest:.2g} to {most}"
