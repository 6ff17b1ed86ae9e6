"""Metrics of a friction measurement, the most important first; imports nothing heavy."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from palpate.experiments.kit.metric import Metric, MetricValue

if TYPE_CHECKING:
    from palpate.experiments.friction.result import FrictionResult
    from palpate.friction.friction_file import FrictionEstimate
    from palpate.reporting.data import Quantity

    Truth = Callable[[FrictionResult], float | None]
    Text = Callable[[FrictionResult], str]

_MILLI = 1e3


def _true_mu(result: "FrictionResult") -> float | None:
    return None if result.file is None else result.plan.true_friction(result.file.speed)


def _true_static(result: "FrictionResult") -> float | None:
    plan = result.plan
    return plan.plant.static_friction if plan.plant is not None and plan.truth_known else None


def _true_e(result: "FrictionResult") -> float | None:
    return result.plan.true_spin_length(1.0)


def _true_exponent(name: str) -> "Truth":
    def true(result: "FrictionResult") -> float | None:
        surface = result.plan.true_limit_surface
        return None if surface is None else getattr(surface, name)

    return true


def _estimate(result: "FrictionResult", name: str) -> "FrictionEstimate | None":
    return None if result.file is None else getattr(result.file, name)


def _of_estimate(name: str, value: "Callable[[FrictionEstimate], MetricValue]") -> Callable[[Any], MetricValue]:
    """Return a function of an estimate of friction.yaml; None if the file lacks the estimate."""

    def evaluated(result: "FrictionResult") -> MetricValue:
        found = _estimate(result, name)
        return None if found is None else value(found)

    return evaluated


def _against_truth(
    name: str, true: "Truth", value: "Callable[[FrictionEstimate, float], MetricValue]"
) -> Callable[[Any], MetricValue]:
    """Return a function of a measured estimate and its true value; None for a bound or an assumed value."""

    def evaluated(result: "FrictionResult") -> MetricValue:
        found, truth = _estimate(result, name), true(result)
        return None if found is None or truth is None or not found.measured else value(found, truth)

    return evaluated


def _error(found: "FrictionEstimate", true: float) -> float:
    return found.value - true


def _inside(found: "FrictionEstimate", true: float) -> bool:
    return found.lower <= true <= found.upper


@dataclass(frozen=True, slots=True)
class _EstimateMetric(Metric):
    """Metric of an estimate; the row of a lower bound reads "at least".

    Attributes:
        bound: Function from the result to whether the value is a lower bound.
    """

    bound: Callable[[Any], bool] = bool

    def row(self, result: Any) -> "Quantity | None":
        """Return the row of the report; None if there is nothing to show."""
        row = Metric.row(self, result)
        return replace(row, value=f"at least {row.text}") if row is not None and self.bound(result) else row


def _estimated(
    key: str,
    meaning: str,
    name: str,
    true: "Truth",
    unit: str = "",
    shown_unit: str = "",
    reason: "Text | None" = None,
    remark: "Text | None" = None,
    applies: Callable[[Any], bool] = lambda result: True,
) -> Metric:
    """Return the metric of an estimate of friction.yaml: a row with its interval or reason, and the true value.

    Args:
        key: Key of the metric.
        meaning: Name for people.
        name: Name of the estimate in the file.
        true: Function to the true value.
        unit: SI unit.
        shown_unit: Unit of the row.
        reason: Function to the reason of a lower bound.
        remark: Function to a further remark.
        applies: Function to whether the run has the metric.
    """
    factor = _MILLI if shown_unit == "mm" else 1.0

    def is_bound(result: "FrictionResult") -> bool:
        found = _estimate(result, name)
        return found is not None and found.how == "bound"

    def note(result: "FrictionResult") -> str:
        truth = true(result)
        parts = (
            f"{reason(result)}: a lower bound" if reason is not None and is_bound(result) else "",
            "" if remark is None else remark(result),
            "" if truth is None else f"true {factor * truth:.4g}",
        )
        return "; ".join(part for part in parts if part)

    def interval(result: "FrictionResult") -> tuple[float, float] | None:
        found = _estimate(result, name)
        return None if found is None or not found.measured else (found.lower, found.upper)

    value = _of_estimate(name, lambda found: found.value)
    return _EstimateMetric(
        key, meaning, unit, value, shown_unit, 3, note, interval, applies=applies, bound=is_bound
    )


def _mu_remark(result: "FrictionResult") -> str:
    file = result.file
    if file is None or not file.friction.measured:
        return ""
    return f"{'all loads together, ' if len(file.loads) > 1 else ''}slipping at {_MILLI * file.speed:.3g} mm/s"


def _assumed(name: str, remedy: str = "") -> "Text":
    """Return the remark on an exponent: whether it was assumed, and how to measure it."""

    def remark(result: "FrictionResult") -> str:
        found = _estimate(result, name)
        return "" if found is None or found.measured else f"assumed, not measured{remedy}"

    return remark


def _no_spin_length(result: "FrictionResult") -> bool:
    return result.file is not None and result.file.spin_length is None


def _no_spin_length_note(result: "FrictionResult") -> str:
    true = _true_e(result)
    return result.no_spin_length_reason + ("" if true is None else f"; true {_MILLI * true:.4g} mm at 1 N")


def _spins(result: "FrictionResult") -> bool:
    return result.file is not None and result.file.spin_length is not None


def _torque_ratio(result: "FrictionResult") -> tuple[float, float] | None:
    """Return the largest torque ratio that was carried [m], and its normal force [N]; None without any."""
    loads = () if result.file is None else result.file.loads
    ratios = [(each.torque_ratio.value, each.normal_force) for each in loads if each.torque_ratio is not None]
    return max(ratios, default=None, key=lambda each: each[0])


def _torque_ratio_note(result: "FrictionResult") -> str:
    found = _torque_ratio(result)
    return "" if found is None else f"spin torque over normal force that was carried at {found[1]:.3g} N"


def _over_speed(result: "FrictionResult") -> str | None:
    """Return whether mu differs between two speeds by more than its intervals; None without a speed curve."""
    if result.found.curve is None or result.file is None:
        return None
    measured = [each.friction for each in result.file.speeds if each.friction.measured]
    varies = max(each.lower for each in measured) > min(each.upper for each in measured)
    return "see figure" if varies else "constant"


def _over_speed_note(result: "FrictionResult") -> str:
    creeping = () if result.found.curve is None else result.found.curve.creeping
    crept = f"; crept at {', '.join(f'{_MILLI * speed:.2g}' for speed in creeping)} mm/s" if creeping else ""
    return f"{len(result.found.speeds)} speeds{crept}"


def _surface(result: "FrictionResult") -> str | None:
    return None if result.recognised is None else result.recognised.material


def _surface_note(result: "FrictionResult") -> str:
    known = result.recognised
    return "" if known is None else f"by the library {result.plan.config.library}; {known.verdict}"


def _lower(found: "FrictionEstimate") -> float:
    return found.lower


def _upper(found: "FrictionEstimate") -> float:
    return found.upper


def _how(found: "FrictionEstimate") -> str:
    return found.how.value


def _value_if_measured(found: "FrictionEstimate") -> float | None:
    return found.value if found.measured else None


_MU, _E, _GAMMA, _P = "friction", "spin_length", "load_exponent", "norm_exponent"


def _hidden(key: str, meaning: str, unit: str, value: Callable[[Any], MetricValue]) -> Metric:
    """Return a metric for programs, without a row of its own."""
    return Metric(key, meaning, unit, value, in_table=False)


METRICS = (
    _hidden("mu_error", "mu found less true mu", "", _against_truth(_MU, _true_mu, _error)),
    _hidden("spin_length_error_m", "e found less true e", "m", _against_truth(_E, _true_e, _error)),
    _estimated(
        "mu_found",
        "friction mu",
        _MU,
        _true_mu,
        reason=lambda result: result.no_friction_reason,
        remark=_mu_remark,
    ),
    _hidden("mu_lower", "lower end of mu's 95 % interval", "", _of_estimate(_MU, _lower)),
    _hidden("mu_upper", "upper end of mu's 95 % interval", "", _of_estimate(_MU, _upper)),
    _hidden("mu_how", "source of mu", "", _of_estimate(_MU, _how)),
    _hidden("mu_true", "true mu", "", _true_mu),
    _hidden("mu_inside", "share of intervals that hold true mu", "", _against_truth(_MU, _true_mu, _inside)),
    _estimated(
        "static_friction",
        "static friction",
        "static_friction",
        _true_static,
        reason=lambda result: result.no_static_friction_reason,
    ),
    _estimated(
        "spin_length_found_m",
        "spin length e at 1 N",
        _E,
        _true_e,
        "m",
        "mm",
        reason=lambda result: result.no_spin_length_reason,
    ),
    _hidden("spin_length_lower_m", "lower end of e's 95 % interval", "m", _of_estimate(_E, _lower)),
    _hidden("spin_length_upper_m", "upper end of e's 95 % interval", "m", _of_estimate(_E, _upper)),
    _hidden("spin_length_how", "source of e", "", _of_estimate(_E, _how)),
    _hidden("spin_length_true_m", "true e at 1 N", "m", _true_e),
    _hidden("spin_length_inside", "share of intervals that hold true e", "", _against_truth(_E, _true_e, _inside)),
    Metric(
        "spin_length_missing",
        "spin length e",
        "",
        lambda result: "not found",
        note=_no_spin_length_note,
        applies=_no_spin_length,
    ),
    _EstimateMetric(
        "torque_ratio_least_m",
        "mu e",
        "m",
        lambda result: (_torque_ratio(result) or (None,))[0],
        "mm",
        3,
        _torque_ratio_note,
        applies=_no_spin_length,
        bound=_no_spin_length,
    ),
    _estimated(
        "load_exponent",
        "growth of e with load, gamma",
        _GAMMA,
        _true_exponent(_GAMMA),
        remark=_assumed(_GAMMA),
        applies=_spins,
    ),
    _hidden("load_exponent_found", "gamma, if it was measured", "", _of_estimate(_GAMMA, _value_if_measured)),
    _estimated(
        "norm_exponent",
        "norm exponent p",
        _P,
        _true_exponent(_P),
        remark=_assumed(_P, "; --fit-exponents measures it"),
        applies=_spins,
    ),
    _hidden("norm_exponent_found", "p, if it was measured", "", _of_estimate(_P, _value_if_measured)),
    Metric("friction_over_speed", "friction over speed", "", _over_speed, note=_over_speed_note),
    Metric("surface", "surface", "", _surface, note=_surface_note),
    Metric(
        "verdict_ok",
        "assumptions held",
        "",
        lambda result: result.found.verdict.ok,
        note=lambda result: str(result.found.verdict),
        applies=lambda result: result.file is not None,
    ),
    _hidden("lost", "times contact was lost", "", lambda result: result.lost),
    Metric("simulated_s", "time of the run", "s", lambda result: result.run.duration),
)
