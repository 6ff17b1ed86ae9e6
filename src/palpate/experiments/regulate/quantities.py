"""The metrics of the report on a regulation of force, and the margins that it had."""

import math

from palpate.controllers.surface_motion import StiffnessRange, stiffness_range
from palpate.experiments.regulate.plan import RegulationPlan
from palpate.experiments.regulate.response import RISE_FROM, RISE_TO, SETTLED, FrequencyResponse, StepResponse
from palpate.experiments.regulate.result import RegulationResult
from palpate.experiments.regulate.words import landing_words
from palpate.reporting.data import Quantity
from palpate.robots.known_truth import NOT_KNOWN, time_name

LEAST_SAMPLED_DELAY = 1.5
"""Periods of control: a delay below that, as identified on a contact that is led, has no sampled model."""

STABLE = "stable for a stiffness"
"""Of feedback and surface following together: the range of stiffness over its assumed value."""


def quantities(regulation: RegulationResult) -> tuple[Quantity, ...]:
    """Return the metrics that matter, most important first."""
    planned, config, result = regulation.planned, regulation.planned.config, regulation.run
    moving = config.profile in ("step", "sine")
    note = "what the set force changes by included" if moving else "first half second left out"
    judged = "true" if regulation.truth.known else "felt"
    metrics = [
        Quantity("true force, RMS error", regulation.true_rms, "N", note, digits=3)
        if regulation.truth.known
        else Quantity("true force", NOT_KNOWN),
        Quantity("felt force, RMS error", regulation.sensed_rms, "N", digits=3),
        Quantity(
            "largest force of landing", regulation.landing_peak, "N", f"at {landing_words(planned)}", digits=3
        ),
        Quantity("largest force of the run", regulation.peak, "N", f"limit {planned.limits.force:g} N", digits=3),
    ]
    steps = regulation.judged_steps
    if steps is not None:
        metrics = _step_metrics(steps, judged) + metrics
    tones = regulation.judged_tones
    if tones is not None:
        metrics = _tone_metrics(tones, judged) + metrics
    error = round(regulation.sensor_error, 6) + 0.0  # of a perfect sensor, rounding errors are left; no -0
    return (
        *metrics,
        Quantity("felt less true force at the end", error, "N", "what the sensor is off", 3),
        Quantity("contact", regulation.loss.value, "", _bounced(regulation.bounces)),
        Quantity("gain halved", regulation.guard_trips, "times", "because force control swung"),
        Quantity(time_name(regulation.cost), result.duration, "s"),
        Quantity(
            "real-time factor", result.real_time_factor, "", f"control at {1.0 / result.timing.period:g} Hz", 3
        ),
    )


def _bounced(times: int) -> str:
    return "" if times == 0 else f"bounced {times} time{'s' if times > 1 else ''} on landing"


def _step_metrics(steps: StepResponse, judged: str) -> list[Quantity]:
    return [
        Quantity(
            "rise time",
            1e3 * steps.rise_time,
            "ms",
            f"from {100.0 * RISE_FROM:g} to {100.0 * RISE_TO:g} % of the mean step, {judged} force",
            digits=3,
        ),
        Quantity(
            "overshoot",
            100.0 * steps.overshoot,
            "%",
            f"beyond the step's height; worst step {100.0 * steps.largest_overshoot:.2g} %",
            digits=2,
        ),
        Quantity(
            "settling time",
            1e3 * steps.settling_time,
            "ms",
            f"until it stays within {100.0 * SETTLED:g} % of the step's height",
            digits=3,
        ),
    ]


def _tone_metrics(tones: FrequencyResponse, judged: str) -> list[Quantity]:
    width, highest = tones.bandwidth, float(tones.frequency[-1])
    value: float | str = f"beyond {highest:g}" if width is None else width
    return [
        Quantity("bandwidth", value, "Hz", f"{judged} per set amplitude first below 0.707 (-3 dB)", digits=3),
        Quantity("largest amplitude ratio", tones.peak, "", digits=3),
    ]


def margins(planned: RegulationPlan) -> tuple[Quantity, ...]:
    """Return the margins of the force control."""
    gain, period, found = planned.parameters.gain, planned.period, planned.identified
    origin = "as identified" if found is not None else "as assumed"
    metrics = [
        Quantity("stiffness of contact and robot", gain.stiffness / 1e3, "kN/m", origin),
        Quantity("delay", 1e3 * gain.delay, "ms", origin, digits=3),
        Quantity("force gain", 1e3 * gain.gain, "mm/s/N", f"k K T = {gain.loop_gain:.2g}", 3),
    ]
    contact = planned.contact
    if contact is not None:
        damped = contact.margins(gain)
        damping = 1e3 * contact.surface_damping_time
        metrics += [
            Quantity(
                "gain margin",
                damped.gain_margin,
                "",
                "of feedback alone, on a surface that is not followed",
                3,
            ),
            Quantity("phase margin", damped.phase_margin_deg, "degrees", "of the model", digits=3),
            Quantity("modulus margin", damped.modulus_margin, "", "distance of the loop from instability", 3),
            Quantity("contact damping time", damping, "ms", origin, 3),
        ]
    if found is not None:
        metrics += [
            Quantity("phase margin", found.phase_margin_deg, "degrees", "as measured", digits=3),
            Quantity("stiffness of what is touched", found.contact_stiffness / 1e3, "kN/m", "as identified"),
            Quantity("contact damping time", 1e3 * found.damping_time, "ms", "as identified", 3),
        ]
    if gain.delay >= LEAST_SAMPLED_DELAY * period:
        whole, halved = (stiffness_range(gain, planned.follow, period, share) for share in (1.0, 0.5))
        metrics += [
            Quantity(STABLE, _range(whole), "times", "the assumed one; beyond, it oscillates"),
            Quantity("once it swung", _range(halved), "times", "likewise: it goes on with half of the gain"),
        ]
    return tuple(metrics)


def _range(bears: StiffnessRange) -> str:
    most = "more than 10" if math.isinf(bears.stiffest) else f"{bears.stiffest:.2g}"
    return f"{bears.softest:.2g} to {most}"
