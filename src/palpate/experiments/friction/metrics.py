"""Metrics of a friction measurement: for tables, sweeps and comparisons."""

from collections.abc import Callable
from typing import TYPE_CHECKING

from palpate.experiments.kit import Metric, MetricValue

if TYPE_CHECKING:  # commands import this module for --help, which must be quick
    from palpate.experiments.friction.result import FrictionResult
    from palpate.friction.friction_file import FrictionEstimate

Value = Callable[["FrictionResult"], MetricValue]


def _found(key: str, value: "Callable[[FrictionEstimate], MetricValue]") -> Value:
    """Of what friction.yaml has under a key; None if it has nothing."""

    def evaluated(result: "FrictionResult") -> MetricValue:
        found: FrictionEstimate | None = None if result.file is None else getattr(result.file, key)
        return None if found is None else value(found)

    return evaluated


def _number(key: str, end: str = "value") -> Value:
    return _found(key, lambda found: getattr(found, end))


def _measured(key: str) -> Value:
    return _found(key, lambda found: found.value if found.measured else None)


def _against(key: str, true: "Callable[[FrictionResult], float | None]", bounds: bool) -> Value:
    """Of what was measured, not bounded or assumed: its error, or whether its interval holds the truth."""

    def evaluated(result: "FrictionResult") -> MetricValue:
        found: FrictionEstimate | None = None if result.file is None else getattr(result.file, key)
        truth = true(result)
        if found is None or truth is None or not found.measured:
            return None
        return found.lower <= truth <= found.upper if bounds else found.value - truth

    return evaluated


def _true_mu(result: "FrictionResult") -> float | None:
    return None if result.file is None else result.plan.true_friction(result.file.speed)


def _true_e(result: "FrictionResult") -> float | None:
    return result.plan.true_spin_length(1.0)


MU, E = "friction", "spin_length"

METRICS = (
    Metric("mu_error", "mu found less true mu", "", _against(MU, _true_mu, bounds=False)),
    Metric("spin_length_error_m", "e found less true e", "m", _against(E, _true_e, bounds=False)),
    Metric("mu_found", "friction mu that was found", "", _number(MU)),
    Metric("mu_lower", "lower end of its 95 % interval", "", _number(MU, "lower")),
    Metric("mu_upper", "upper end of its 95 % interval", "", _number(MU, "upper")),
    Metric("mu_how", "how mu was found", "", _found(MU, lambda found: found.how.value)),
    Metric("mu_true", "true mu", "", _true_mu),
    Metric("mu_inside", "share of intervals that hold true mu", "", _against(MU, _true_mu, bounds=True)),
    Metric("spin_length_found_m", "spin length e at 1 N that was found", "m", _number(E)),
    Metric("spin_length_lower_m", "lower end of its 95 % interval", "m", _number(E, "lower")),
    Metric("spin_length_upper_m", "upper end of its 95 % interval", "m", _number(E, "upper")),
    Metric("spin_length_how", "how e was found", "", _found(E, lambda found: found.how.value)),
    Metric("spin_length_true_m", "true e at 1 N", "m", _true_e),
    Metric("spin_length_inside", "share of intervals that hold true e", "", _against(E, _true_e, bounds=True)),
    Metric("load_exponent_found", "growth of e with load, gamma", "", _measured("load_exponent")),
    Metric("norm_exponent_found", "norm exponent p", "", _measured("norm_exponent")),
    Metric("verdict_ok", "share of runs whose assumptions held", "", lambda result: result.found.verdict.ok),
    Metric("lost", "times contact was lost", "", lambda result: result.lost),
    Metric("simulated_s", "simulated time", "s", lambda result: result.run.duration),
)
