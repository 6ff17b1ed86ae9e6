"""Findings of a friction measurement: statements and remedies; imports nothing heavy."""

from typing import TYPE_CHECKING

from palpate.experiments.kit.metric import Finding

if TYPE_CHECKING:
    from palpate.experiments.friction.result import FrictionResult

WIDE_INTERVAL = 0.2
"""Half width of the interval of mu, relative to mu, above which another measurement is advised."""


def _sentence(text: str) -> str:
    """Return a clause as a sentence."""
    return f"{text[0].upper()}{text[1:]}."


def _bounded(result: "FrictionResult") -> bool:
    return result.file is not None and result.file.friction.how == "bound"


def _bounded_sentence(result: "FrictionResult") -> str:
    assert result.file is not None
    partly = any(getattr(each.friction, "partly", False) for each in result.found.loads)
    how = (
        "It began to slip along the surface, but not for long enough there and back to measure mu"
        if partly
        else "It never slipped along the surface"
    )
    return f"{how}: mu is at least {result.file.friction.value:.3g}, with no upper bound."


def _wide(result: "FrictionResult") -> bool:
    if result.file is None or not result.file.friction.measured:
        return False
    mu = result.file.friction
    return mu.upper - mu.lower > 2.0 * WIDE_INTERVAL * mu.value


def _no_spin_length(result: "FrictionResult") -> bool:
    return result.file is not None and bool(result.no_spin_length_reason)


def _no_spin_length_sentence(result: "FrictionResult") -> str:
    unknown = result.file is None or result.file.spin_length is None
    known = "nothing is known of e" if unknown else "its e is a lower bound"
    return _sentence(f"{result.no_spin_length_reason}: {known}")


def _left_out_sentence(result: "FrictionResult") -> str:
    speeds = ", ".join(f"{1e3 * speed:g}" for speed in result.plan.left_out)
    return f"Strokes at {speeds} mm/s were left out: they would go too far on this object."


def _sticking(result: "FrictionResult") -> str:
    """Return the statement on stick-slip; "" without any."""
    from palpate.experiments.friction.estimate import listed, slipped

    at_loads, at_speeds = slipped(result.found.loads), result.found.speeds
    if any(each.stick_slip for each in at_loads):
        return "It alternately stuck and slipped: mu is the kinetic one."
    speeds = [f"{1e3 * at.speed:g}" for at in at_speeds if any(each.stick_slip for each in slipped([at]))]
    if speeds:
        return f"At {listed(speeds)} mm/s it alternately stuck and slipped."
    few = any(each.turns is not None for each in at_loads)
    return "It stuck and let go a few times: mu is measured between these times." if few else ""


FINDINGS = (
    Finding(
        lambda result: result.lost,
        lambda result: f"Contact was lost {'once' if result.lost == 1 else f'{result.lost} times'}.",
    ),
    Finding(
        lambda result: result.file is None,
        "Nothing is known of its friction.",
        "Nothing was rubbed: check where the surface is, and repeat.",
    ),
    Finding(
        _bounded,
        _bounded_sentence,
        "It never slipped for long enough: longer strokes (--most-travel) or less load measure mu.",
    ),
    Finding(_wide, remedy="The interval of mu is wide: --repeats 3, or larger --loads, narrow it."),
    Finding(_no_spin_length, _no_spin_length_sentence),
    Finding(lambda result: result.shortfalls, lambda result: " ".join(result.shortfalls)),
    Finding(lambda result: result.plan.left_out, _left_out_sentence),
    Finding(_sticking, _sticking),
    Finding(
        lambda result: result.found.verdict.broken,
        lambda result: " ".join(_sentence(each.finding) for each in result.found.verdict.broken),
        lambda result: " ".join(_sentence(each.remedy) for each in result.found.verdict.broken),
    ),
    Finding(
        lambda result: result.file is not None,
        remedy="To hold an object with this friction: palpate grasp --friction-file friction.yaml.",
    ),
)
