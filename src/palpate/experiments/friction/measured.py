"""mu and e at each load and speed with their intervals, as tables and figures show them."""

from collections.abc import Sequence
from dataclasses import dataclass

from palpate.experiments.friction.result import FrictionResult
from palpate.experiments.friction.words import bound_reason, bound_words
from palpate.friction.friction_file import FrictionEstimate, How
from palpate.reporting.data import interval_words, value_words


@dataclass(frozen=True, slots=True)
class Interval:
    """A number with its 95 % interval, or a lower bound.

    Attributes:
        at: Where: a load [N] or a speed [m/s].
        value: As measured; the bound itself if it is one.
        lower: End of the interval.
        upper: The other; infinite for a bound.
        true: As it is simulated, if that is known.
        bound: Whether it is a lower bound.
        why: Of a bound: why it is no more, in words.
    """

    at: float
    value: float
    lower: float
    upper: float
    true: float | None = None
    bound: bool = False
    why: str = ""


def frictions(result: FrictionResult) -> tuple[Interval, ...]:
    """Return mu at each load [N], at the main speed."""
    if result.file is None:
        return ()
    true = result.plan.true_friction(result.file.speed)
    return tuple(
        _of(at.normal_force, at.friction, true, bound_reason(each.friction))
        for at, each in zip(result.file.loads, result.found.loads, strict=True)
    )


def lengths(result: FrictionResult) -> tuple[Interval, ...]:
    """Return e [m] at each load [N] at which the tip slipped about the normal."""
    return tuple(
        _of(at.normal_force, at.spin_length, result.plan.true_spin_length(at.normal_force))
        for at in (() if result.file is None else result.file.loads)
        if at.spin_length is not None
    )


def speeds(result: FrictionResult) -> tuple[Interval, ...]:
    """Return mu at each speed [m/s], at one load."""
    if result.file is None:
        return ()
    return tuple(
        _of(each.speed, each.friction, result.plan.true_friction(each.speed), bound_reason(at.friction))
        for each, at in zip(result.file.speeds, result.found.speeds, strict=True)
    )


def table_rows(
    intervals: Sequence[Interval], name: str, at_unit: str, at_factor: float, unit: str = "", factor: float = 1.0
) -> list[tuple[str, str, str, str]]:
    """Return name, value, unit and interval of each.

    Args:
        intervals: To show.
        name: Of the quantity.
        at_unit: Of where it was measured, as shown.
        at_factor: From SI to that.
        unit: Of the quantity, as shown.
        factor: From SI to that.
    """
    rows = []
    for each in intervals:
        true = "" if each.true is None else f"; true {factor * each.true:.4g}"
        if each.bound:
            value, note = bound_words(factor * each.value), f"{each.why or 'it never slipped'}: a lower bound"
        else:
            of_it = factor * each.value, factor * each.lower, factor * each.upper
            value, note = value_words(*of_it), interval_words(*of_it)
        rows.append((f"{name} at {at_factor * each.at:.3g} {at_unit}", value, unit, note + true))
    return rows


def _of(at: float, found: FrictionEstimate, true: float | None, why: str = "") -> Interval:
    return Interval(at, found.value, found.lower, found.upper, true, found.how is How.BOUND, why)
