"""What the report on a regulation of force says."""

import math

import numpy as np

from palpate.controllers.force_law import DirectForce
from palpate.controllers.regulate import Loss
from palpate.controllers.surface_motion import StiffnessRange, stiffness_range
from palpate.experiments.regulate import Regulation
from palpate.experiments.regulate_plan import RegulationPlan
from palpate.experiments.regulate_response import RISE_FROM, RISE_TO, SETTLED, FrequencyResponse, StepResponse
from palpate.reporting import KeyFigure, TimeSeries
from palpate.reporting.regulation_data import BodeCurve, RegulationReport, StepCurves
from palpate.runtime import Ending

LEAST_SAMPLED_DELAY = 1.5
"""Periods of control: a delay below that, as identified on a contact that is led, has no sampled model."""

DRIFTED = 5.0
"""Sensed and true force differ if by more than so many standard errors, and by a hundredth of the set force."""

WORDS = {
    Loss.NEVER: "contact was never lost",
    Loss.FOUND: "contact was lost once, sought, and found again",
    Loss.MISSING: "nothing was found where the surface was looked for, and the tip stopped",
    Loss.BOUNCING: "the tip bounced on landing again and again, never settled, and gave up",
    Loss.GONE: (
        "contact was lost, one slow search over a few millimetres found nothing to stay on, and the tip stopped"
    ),
}


def regulation_report(regulation: Regulation) -> RegulationReport:
    """Return the report on a regulation."""
    record = regulation.record
    sensed, true = regulation.sensed_force, regulation.true_force
    curves, tones = _steps(regulation), regulation.tones(true)
    return RegulationReport(
        title=title(regulation),
        outcome=outcome(regulation),
        summary=key_figures(regulation),
        margins=margins(regulation.planned),
        settings=settings(regulation),
        series=TimeSeries(
            time=record.time,
            phase=[str(phase) for phase in record.phase],
            measured_force=sensed,
            set_force=regulation.set_force,
            spin_torque=np.where(record.touching, record.spin_torque, np.nan),
            speed=np.linalg.norm(record.velocity, axis=1),
            true_force=np.where(regulation.truth.touching, true, np.nan),
        ),
        timing=regulation.run.timing,
        steps=curves,
        tones=tuple(
            BodeCurve(name, answer.frequency, answer.gain, answer.phase_deg)
            for name, answer in (("true", tones), ("sensed", regulation.tones(_filled(sensed))))
            if answer is not None
        ),
        bandwidth=None if tones is None else tones.bandwidth,
    )


def title(regulation: Regulation) -> str:
    """Return the heading."""
    config = regulation.planned.config
    what = {
        "constant": "A constant force",
        "step": "Steps of force",
        "ramp": "A ramp of force",
        "sine": "Sines of force",
    }[config.profile]
    where = {
        "still": f"a still {config.object}",
        "sine": f"a {config.object} that moves up and down",
        "soft": f"a soft {config.object}",
        "leaving": f"a {config.object} that leaves",
        "missing": f"a {config.object} that is not there",
    }[config.surface]
    return f"{what} on {where}"


def outcome(regulation: Regulation) -> str:
    """Return how it ended, and what is wrong with the figures if anything is."""
    result, limit = regulation.run, regulation.planned.limits.force
    rest = "the robot is at rest" if result.stopped else "THE ROBOT DID NOT COME TO REST"
    if result.ending is Ending.DONE:
        said = [f"Finished after {result.duration:.1f} s: {WORDS[regulation.loss]}; {rest}."]
    elif result.ending is Ending.TRIPPED:
        said = [f"Stopped by the supervisor: {result.trip}; {rest}."]
    elif result.ending is Ending.LOST:
        said = [f"Not finished after {result.duration:.1f} s: {WORDS[regulation.loss]}; {rest}."]
    else:
        said = [f"Not finished ({result.ending.value}) after {result.duration:.1f} s; {rest}."]
    if regulation.peak > limit:
        said.append(f"The true force went up to {regulation.peak:.3g} N, beyond the limit of {limit:g} N.")
    if regulation.guard_trips:
        share = 0.5**regulation.guard_trips
        said.append(
            f"Force control swung, and went on with {share:g} of its gain: stiffness or delay are not what was "
            "assumed; --identify finds them."
        )
    if _drifted(regulation):
        said.append(
            f"At the end the sensor showed {regulation.sensor_error:+.3f} N that was not there: what was held is "
            "what it showed, not the true force."
        )
    return " ".join(said)


def _drifted(regulation: Regulation) -> bool:
    error = regulation.sensor_error
    counted = regulation.counted
    noise = np.nanstd((regulation.sensed_force - regulation.true_force)[counted]) if counted.any() else 0.0
    standard = noise / math.sqrt(max(1.0, float(counted.sum())))
    return bool(abs(error) > max(DRIFTED * standard, 0.01 * regulation.planned.config.force))


def key_figures(regulation: Regulation) -> tuple[KeyFigure, ...]:
    """Return the figures that matter, most important first."""
    planned, config, result = regulation.planned, regulation.planned.config, regulation.run
    moving = config.profile in ("step", "sine")
    note = "what the set force changes by included" if moving else "first half second left out"
    figures = [
        KeyFigure("true force, RMS error", regulation.true_rms, "N", note, digits=3),
        KeyFigure("sensed force, RMS error", regulation.sensed_rms, "N", digits=3),
        KeyFigure("largest force of landing", regulation.landing_peak, "N", f"at {_speed(planned)}", digits=3),
        KeyFigure("largest force of the run", regulation.peak, "N", f"limit {planned.limits.force:g} N", digits=3),
    ]
    steps = regulation.steps(regulation.true_force)
    if steps is not None:
        figures = _step_figures(steps) + figures
    tones = regulation.tones(regulation.true_force)
    if tones is not None:
        figures = _tone_figures(tones) + figures
    error = round(regulation.sensor_error, 6)  # of a perfect sensor, rounding errors are left
    return (
        *figures,
        KeyFigure("sensed less true force at the end", error, "N", "what the sensor is off", 3),
        KeyFigure("contact", regulation.loss.value, "", _bounced(regulation.bounces)),
        KeyFigure("gain halved", regulation.guard_trips, "times", "because force control swung"),
        KeyFigure("simulated time", result.duration, "s"),
        KeyFigure(
            "real-time factor", result.real_time_factor, "", f"control at {1.0 / result.timing.period:g} Hz", 3
        ),
    )


def _speed(planned: RegulationPlan) -> str:
    return f"{1e3 * planned.parameters.landing_speed:.3g} mm/s"


def _bounced(times: int) -> str:
    return "" if times == 0 else f"bounced {times} time{'s' if times > 1 else ''} on landing"


def _step_figures(steps: StepResponse) -> list[KeyFigure]:
    return [
        KeyFigure(
            "rise time", 1e3 * steps.rise_time, "ms", f"{100.0 * RISE_FROM:g} to {100.0 * RISE_TO:g} %", digits=3
        ),
        KeyFigure(
            "overshoot",
            100.0 * steps.overshoot,
            "%",
            f"worst step {100.0 * steps.largest_overshoot:.2g} %",
            digits=2,
        ),
        KeyFigure("settling time", 1e3 * steps.settling_time, "ms", f"to within {100.0 * SETTLED:g} %", digits=3),
    ]


def _tone_figures(tones: FrequencyResponse) -> list[KeyFigure]:
    width, highest = tones.bandwidth, float(tones.frequency[-1])
    value: float | str = f"beyond {highest:g}" if width is None else width
    return [
        KeyFigure("bandwidth", value, "Hz", "amplitude ratio 0.707 (-3 dB)", digits=3),
        KeyFigure("largest amplitude ratio", tones.peak, "", digits=3),
    ]


def margins(planned: RegulationPlan) -> tuple[KeyFigure, ...]:
    """Return the margins of the force control."""
    gain, period, found = planned.parameters.gain, planned.period, planned.identified
    origin = "as identified" if found is not None else "as assumed"
    figures = [
        KeyFigure("stiffness of contact and robot", gain.stiffness / 1e3, "kN/m", origin),
        KeyFigure("delay", 1e3 * gain.delay, "ms", origin, digits=3),
        KeyFigure(
            "force gain", 1e3 * gain.gain, "mm/s/N", f"loop gain {gain.loop_gain:.2g}, unstable from 1.57", 3
        ),
        KeyFigure(
            "gain margin", gain.gain_margin, "", "the stiffness may be so many times what it was taken for", 3
        ),
    ]
    if found is not None:
        figures.append(KeyFigure("phase margin", found.phase_margin_deg, "degrees", "as measured", digits=3))
        figures.append(KeyFigure("contact stiffness", found.contact_stiffness / 1e3, "kN/m", "as identified"))
        figures.append(KeyFigure("contact damping time", 1e3 * found.damping_time, "ms", "as identified", 3))
    else:
        figures.append(KeyFigure("phase margin", gain.phase_margin_deg, "degrees", "of the model", digits=3))
    if gain.delay >= LEAST_SAMPLED_DELAY * period:
        sampled = DirectForce(gain).margins(period)
        figures.append(
            KeyFigure(
                "modulus margin", sampled.modulus_margin, "", "distance of the sampled loop from instability", 3
            )
        )
        bears = stiffness_range(gain, planned.follow, period)
        figures.append(
            KeyFigure("true per assumed stiffness", _range(bears), "", "for which following the surface is stable")
        )
    return tuple(figures)


def _range(bears: StiffnessRange) -> str:
    most = "more than 10" if math.isinf(bears.stiffest) else f"{bears.stiffest:.2g}"
    return f"{bears.softest:.2g} to {most}"


def settings(regulation: Regulation) -> tuple[tuple[str, str], ...]:
    """Return what was asked for, with units."""
    planned = regulation.planned
    config, sensor = planned.config, planned.ready.finger
    axis = planned.parameters.axis
    kept = regulation.run.recording
    return (
        ("object", f"{config.object}, {config.surface}{_course(config.surface, planned)}"),
        ("profile", f"{config.profile}{_profile(planned)}"),
        ("held for", f"{planned.parameters.duration:g} s"),
        ("moved along the surface", _motion(planned)),
        ("force along", "the contact's normal" if axis is None else " ".join(f"{x:.3g}" for x in axis)),
        ("contact stiffness", f"{config.true_stiffness / 1e3:g} kN/m"),
        ("friction, spin length", f"{config.friction:g}, {1e3 * config.spin_length:g} mm"),
        ("sensor", f"{type(sensor).__name__}, drift {config.drift:g} N/min, seed {config.seed}"),
        ("landing speed", _speed(planned)),
        ("robot", config.robot),
        ("simulated scene", str(regulation.cost)),
        ("control period", f"{1e3 * planned.period:g} ms"),
        *((("log", str(kept)),) if kept is not None and kept.path is not None else ()),
    )


def _course(surface: str, planned: RegulationPlan) -> str:
    config = planned.config
    if surface == "sine":
        return f" of {1e3 * config.surface_amplitude:g} mm, up to {1e3 * config.surface_speed:g} mm/s"
    if surface == "leaving":
        return f" after {config.leave_time:g} s at {1e3 * config.surface_speed:g} mm/s"
    return ""


def _profile(planned: RegulationPlan) -> str:
    config = planned.config
    if config.profile == "constant":
        return f", {config.force:g} N"
    if config.profile == "sine":
        tones = ", ".join(f"{frequency:g}" for frequency in config.frequencies)
        return f", {config.force:g} N with {config.swung:g} N at {tones} Hz"
    return f", {config.force:g} to {config.greatest:g} N"


def _motion(planned: RegulationPlan) -> str:
    config = planned.config
    if config.motion in ("still", "table"):
        return "not at all" if config.motion == "still" else f"as {config.motion_file} says"
    return f"{config.motion} of {1e3 * config.motion_size:g} mm, up to {1e3 * config.motion_speed:g} mm/s"


def _steps(regulation: Regulation) -> StepCurves | None:
    true = regulation.steps(regulation.true_force)
    if true is None:
        return None
    sensed = regulation.steps(_filled(regulation.sensed_force))
    return StepCurves(true.time, None if sensed is None else sensed.mean, true.mean, true.each, true.rise, SETTLED)


def _filled(force: np.ndarray[tuple[int], np.dtype[np.float64]]) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    """A force that is not felt is none."""
    return np.nan_to_num(force, nan=0.0)
