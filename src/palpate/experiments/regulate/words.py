"""Texts of the report on a force regulation: heading, outcome, limits, settings."""

import math

from palpate.controllers.guarded_approach import Loss
from palpate.experiments.kit.recorded_run import change_rows, change_sentences
from palpate.experiments.kit.run_report import log_row
from palpate.experiments.regulate.config import FROM_FILES, MOUNT_DAMPING_RATIO, RegulateConfig
from palpate.experiments.regulate.plan import RegulationPlan
from palpate.experiments.regulate.result import RegulationResult
from palpate.robots.known_truth import NOT_KNOWN, cost_row
from palpate.runtime import Ending

SERVO_HALF_POWER = math.sqrt(math.sqrt(2.0) - 1.0)
"""1 / (1 + s / w)^2 has half of its power at this times w: a servo that is critically damped, of lag 2 / w."""

WRONG_BY = 3.0
"""Largest error factor of the stiffness at which steps overshoot by at most 10 %; see `STEP_IN_DELAYS`."""

DRIFTED = 5.0
"""Felt and true force differ if by more than so many standard errors, and by a hundredth of the set force."""

WORDS = {
    Loss.UNMADE: "contact was never made",
    Loss.NEVER: "contact was never lost",
    Loss.FOUND: "contact was lost once, sought, and found again",
    Loss.MISSING: "nothing was found where the surface was looked for, and the tip stopped",
    Loss.BOUNCING: "the tip bounced on landing again and again, never settled, and gave up",
    Loss.GONE: (
        "contact was lost, one slow search over a few millimetres found nothing to stay on, and the tip stopped"
    ),
}


def title(regulation: RegulationResult) -> str:
    """Return the heading."""
    config = regulation.planned.config
    what = {
        "constant": "A constant force",
        "step": "Steps of force",
        "ramp": "A ramp of force",
        "sine": "Sines of force",
    }[config.profile]
    where = {
        "still": config.described,
        "sine": f"a {config.object} that moves up and down",
        "soft": f"a soft {config.object}",
        "yielding": f"a {config.object} that yields",
        "leaving": f"a {config.object} that leaves",
        "missing": f"a {config.object} that is not there",
    }[config.surface]
    return f"{what} on {where}"


def asked(config: RegulateConfig) -> str:
    """Return what was asked for."""
    return (
        f"a {config.profile} force of {config.force:g} N on {config.thing} (surface: {config.surface}), while "
        f"the tip's motion is: {config.motion}; carried by {config.robot}"
    )


def outcome(regulation: RegulationResult) -> str:
    """Return how it ended, and what is wrong with the metrics if anything is."""
    result, limit = regulation.run, regulation.planned.limits.force
    if result.ending is Ending.DONE:
        sentences = [f"Finished after {result.duration:.1f} s: {WORDS[regulation.loss]}; {result.rest}."]
    elif result.ending is Ending.TRIPPED:
        sentences = [f"Stopped by the supervisor: {result.why}; {result.rest}."]
    elif result.ending is Ending.LOST:
        sentences = [f"Not finished after {result.duration:.1f} s: {WORDS[regulation.loss]}; {result.rest}."]
    else:
        sentences = [f"Not finished ({result.ending.value}) after {result.duration:.1f} s; {result.rest}."]
    sentences += change_sentences(regulation.changes, result.duration, "anything was held")
    if regulation.peak > limit:
        force = "true" if regulation.truth.known else "felt"
        sentences.append(f"The {force} force went up to {regulation.peak:.3g} N, beyond the limit of {limit:g} N.")
    if regulation.every > 1:
        sentences.append(
            f"Metrics are of every {regulation.every}th period, without responses: there is no whole log to read "
            "the others from."
        )
    if regulation.guard_trips:
        share = 0.5**regulation.guard_trips
        sentences.append(
            f"Force control swung, and went on with {share:g} of its gain: stiffness or delay are not what was "
            "assumed; --identify finds them."
        )
    if _drifted(regulation):
        sentences.append(
            f"At the end the sensor showed {regulation.sensor_error:+.3f} N that was not there: what was held is "
            "what it showed, not the true force."
        )
    return " ".join(sentences)


def _drifted(regulation: RegulationResult) -> bool:
    if not regulation.truth.known:
        return False
    error, standard = regulation.sensor_error, regulation.sums.sensor_error_deviation
    return bool(abs(error) > max(DRIFTED * standard, 0.01 * regulation.planned.config.force))


def limits(planned: RegulationPlan) -> tuple[str, ...]:
    """Return what bounds how fast the force follows, one sentence or two each."""
    parameters, gain = planned.parameters, planned.parameters.gain
    servo = SERVO_HALF_POWER / (math.pi * planned.ready.response)
    lag = 1e3 * planned.ready.response
    delay, feedback = 1e3 * gain.delay, gain.gain * gain.stiffness / (2.0 * math.pi)
    sentences = [
        "Sines and ramps: the rate of the set force is fed forward, as the velocity rate / stiffness. So they are "
        f"followed as far as the servos go, whose lag of {lag:.3g} ms halves the power at {servo:.2g} Hz; a "
        "stiffness or damping that is not as assumed costs some of that, and so does what moves on a mount. "
        "Quicker servos raise it."
    ]
    if parameters.step_time:
        sentences.append(
            f"Steps: the set force goes over with a time constant of {1e3 * parameters.step_time:.3g} ms, "
            f"{parameters.step_time / gain.delay:.2g} delays, because the stiffness is only assumed: so steps on "
            f"what is fixed overshoot by less than 10 % though it be off by a factor of {WRONG_BY:g}. With "
            "--identify they are taken as fast as the loop."
        )
    else:
        sentences.append(f"Steps: the set force goes over as fast as the loop, whose delay is {delay:.3g} ms.")
    sentences.append(
        "Unexpected disturbances are rejected by feedback below "
        f"{feedback:.2g} Hz, which is gain times stiffness / 2 pi. The delay of {delay:.3g} ms bounds it, and the "
        "contact's damping, which acts on a loop with delay as more stiffness does; less delay raises it."
    )
    return tuple(sentences)


def settings(regulation: RegulationResult) -> tuple[tuple[str, str], ...]:
    """Return what was asked for, with units."""
    planned = regulation.planned
    config, sensor = planned.config, planned.ready.finger
    axis = planned.parameters.axis
    return (
        ("object", f"{config.thing}, {config.surface}{_course(config.surface, planned)}"),
        ("profile", f"{config.profile}{_profile(planned)}"),
        ("to be held for", f"{planned.parameters.duration:g} s"),
        ("moved along the surface", _motion(planned)),
        ("force along", "the contact's normal" if axis is None else " ".join(f"{x:.3g}" for x in axis)),
        *_simulated_contact(regulation),
        ("sensor", f"{type(sensor).__name__}, drift {config.drift:g} N/min, seed {config.seed}"),
        ("landing speed", landing_words(planned)),
        ("robot", config.robot),
        *cost_row(regulation.cost),
        *change_rows(regulation.changes),
        ("control period", f"{1e3 * planned.period:g} ms"),
        *log_row(regulation.run),
    )


def landing_words(planned: RegulationPlan) -> str:
    """Return how fast it lands."""
    return f"{1e3 * planned.parameters.landing_speed:.3g} mm/s"


def _simulated_contact(regulation: RegulationResult) -> tuple[tuple[str, str], ...]:
    """What nobody knows on a robot."""
    config = regulation.planned.config
    stiffness, rubs = (
        f"{config.true_stiffness / 1e3:g} kN/m",
        f"{config.friction:g}, {1e3 * config.spin_length:g} mm",
    )
    if not regulation.truth.known:
        return (("contact stiffness, friction, spin length", NOT_KNOWN),)
    return (("contact stiffness, simulated", stiffness), ("friction, spin length", rubs))


def _course(surface: str, planned: RegulationPlan) -> str:
    config = planned.config
    if surface == "sine":
        return f" of {1e3 * config.surface_amplitude:g} mm, up to {1e3 * config.surface_speed:g} mm/s"
    if surface == "yielding":
        return (
            f" on a mount of {config.mount_stiffness / 1e3:g} kN/m, damping ratio {MOUNT_DAMPING_RATIO:g}, "
            f"{config.mount_mass:g} kg"
        )
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
    if config.motion == "still":
        return "not at all"
    if config.motion in FROM_FILES:
        return f"{config.motion} of {config.motion_file}"
    return f"{config.motion} of {1e3 * config.motion_size:g} mm, up to {1e3 * config.motion_speed:g} mm/s"
