"""Texts of the report on friction: outcome and settings."""

from palpate.experiments.friction.library import library_path
from palpate.experiments.friction.plan import FrictionPlan
from palpate.experiments.friction.result import FrictionResult, listed
from palpate.experiments.friction.strokes import FreeAir
from palpate.experiments.kit.run_report import log_row
from palpate.friction.friction_file import How
from palpate.friction.rubbing.sliding import FrictionBound, FrictionMeasured
from palpate.friction.rubbing.twisting import SpinBound, SpinMeasured, SpinUncertainty
from palpate.robots.known_truth import NOT_KNOWN, cost_row
from palpate.runtime import Ending

LEAST_MOVED = 0.01
"""[mN] Of a sensor's zero that is worth a metric: a thousandth of its noise."""


def outcome(result: FrictionResult) -> str:
    """Return how it ended, and what could not be measured."""
    run, count = result.run, len(result.pairs)
    if run.ending is Ending.DONE:
        sentences = [f"Finished after {run.duration:.1f} s: {_rubs(count)} there and back; {run.rest}."]
    elif run.ending is Ending.TRIPPED:
        sentences = [f"Stopped by the supervisor after {_rubs(count)}: {run.why}; {run.rest}."]
    elif run.ending is Ending.LOST and not count:
        sentences = [f"Not finished: nothing was found where the surface was looked for; {run.rest}."]
    else:
        sentences = [
            f"Not finished ({run.ending.value}) after {run.duration:.1f} s and {_rubs(count)}; {run.rest}."
        ]
    if result.lost:
        times = "once" if result.lost == 1 else f"{result.lost} times"
        sentences.append(f"Contact was lost {times}.")
    sentences += _bounds(result)
    sentences += result.shortfalls
    if result.plan.left_out:
        speeds = ", ".join(f"{1e3 * speed:g}" for speed in result.plan.left_out)
        sentences.append(f"Strokes at {speeds} mm/s were left out: they would go too far on this object.")
    sentences += _sticking(result)
    sentences += [f"{each.finding[0].upper()}{each.finding[1:]}." for each in result.found.verdict.broken]
    return " ".join(sentences)


def bound_words(value: float) -> str:
    """Return a lower bound in words."""
    return f"at least {value:.3g}"


def no_spin_length(result: FrictionResult) -> str | None:
    """Return why e is not known, or no more than bounded, in words; None if it was measured."""
    spins = [each.spin for each in result.found.loads]
    if any(isinstance(spin, SpinMeasured) for spin in spins):
        return None
    if result.plan.wanted.most_spin == 0.0:
        return "the robot does not turn its tip"
    doubts = [spin.doubt for spin in spins if isinstance(spin, SpinBound)]
    if not doubts:
        return "no twist was done to its end"
    if SpinUncertainty.FRICTION_UNKNOWN in doubts:
        return "it slipped about the normal, but mu is unknown, and twists measure mu e only"
    if SpinUncertainty.SLID in doubts:
        return "the finger slid more than it spun"
    if result.file is not None and result.file.spin_length is None:
        return "it did not slip about the normal, as far as it turned, nor is it known how large mu may be"
    return "it did not slip about the normal, as far as it turned"


def bound_reason(friction: FrictionMeasured | FrictionBound) -> str:
    """Return why strokes gave no more than a bound, in words; "" if they gave more."""
    if isinstance(friction, FrictionMeasured):
        return ""
    return "it slipped too briefly, or in one direction only" if friction.partly else "it never slipped"


def _rubs(count: int) -> str:
    return "1 rub" if count == 1 else f"{count} rubs"


def _sticking(result: FrictionResult) -> list[str]:
    frictions = [(each.load, each.friction) for each in result.found.loads]
    if any(isinstance(each, FrictionMeasured) and each.stick_slip for _, each in frictions):
        return ["It stuck and slipped by turns: mu is the kinetic one."]
    at = [
        f"{1e3 * each.speed:g}"
        for each in result.found.speeds
        if isinstance(each.friction, FrictionMeasured) and each.friction.stick_slip
    ]
    if at:
        return [f"At {listed(at)} mm/s it stuck and slipped by turns."]
    few = any(isinstance(each, FrictionMeasured) and each.turns is not None for _, each in frictions)
    return ["It stuck and let go a few times: mu is what is between."] if few else []


def _bounds(result: FrictionResult) -> list[str]:
    file = result.file
    if file is None:
        return ["Nothing is known of its friction."]
    sentences = []
    if file.friction.how is How.BOUND:
        partly = any(
            isinstance(each.friction, FrictionBound) and each.friction.partly for each in result.found.loads
        )
        how = (
            "It began to slip along the surface, but not for long enough there and back to measure it"
            if partly
            else "It never slipped along the surface"
        )
        sentences.append(f"{how}: mu is at least {file.friction.value:.3g}, with no upper bound.")
    why = no_spin_length(result)
    if why is not None:
        known = "nothing is known of e" if file.spin_length is None else "its e is a lower bound"
        sentences.append(f"{why[0].upper()}{why[1:]}: {known}.")
    return sentences


def _millinewtons(air: FreeAir) -> str:
    moved = 1e3 * float(abs(air.moved[:3]).max())
    return f"{moved:.2f} mN" if moved >= LEAST_MOVED else f"less than {LEAST_MOVED:g} mN"


def settings(result: FrictionResult) -> tuple[tuple[str, str], ...]:
    """Return what was asked for, with units."""
    plan = result.plan
    config, wanted = plan.config, plan.wanted
    size = " x ".join(f"{1e3 * length:g}" for length in config.sizes)
    speeds = ", ".join(f"{1e3 * speed:g}" for speed in sorted({wanted.speed, *wanted.speeds}))
    air = result.air
    zero = "not felt" if air is None else f"taken off; it moved by {_millinewtons(air)}"
    return (
        ("object", f"{config.object}, {size} mm"),
        ("rubs by", rubs_by(plan) if plan.truth_known else NOT_KNOWN),
        ("loads", f"{', '.join(f'{load:g}' for load in wanted.loads)} N"),
        ("slip speeds", f"{speeds} mm/s"),
        ("strokes", f"{1e3 * wanted.travel:g} to {1e3 * wanted.most_travel:.3g} mm"),
        ("turns", f"up to {wanted.most_spin:g} rad/s" if wanted.most_spin else "none: this robot cannot"),
        ("contact stiffness", f"{config.stiffness / 1e3:g} kN/m"),
        ("sensor's zero", zero),
        ("landing speed", f"{1e3 * plan.parameters.landing_speed:.3g} mm/s"),
        ("robot", config.robot),
        ("seed", str(config.seed)),
        *_library(result),
        *cost_row(result.cost),
        ("control period", f"{1e3 * plan.ready.backend.period:g} ms"),
        *log_row(result.run),
    )


def rubs_by(plan: FrictionPlan) -> str:
    """Everything that the simulated surface rubs by, also what was left out."""
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


def _library(result: FrictionResult) -> tuple[tuple[str, str], ...]:
    path, known = library_path(result.plan.config), result.recognised
    if path is None:
        return ()
    return (("library", str(path) if known is None else f"{path}; {known.recognition.library.fingertip}"),)
