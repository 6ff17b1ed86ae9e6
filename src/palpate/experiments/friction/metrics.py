"""Metrics of a friction measurement, the most important first; imports nothing heavy."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from operator import attrgetter
from typing import TYPE_CHECKING, Any

from palpate.experiments.kit.metric import Metric, MetricValue

if TYPE_CHECKING:
    from palpate.experiments.friction.result import FrictionResult
    from palpate.reporting.data import Quantity

_MILLI = 1e3

_MU, _E, _GAMMA, _P = "friction", "spin_length", "load_exponent", "norm_exponent"
"""Names of estimates in friction.yaml."""

_rubbed = attrgetter("file")


def _has(name: str) -> Callable[[Any], bool]:
    """Return the function to whether friction.yaml has an estimate."""
    return lambda result: result.file is not None and getattr(result.file, name) is not None


def _lacks_spin_length(result: "FrictionResult") -> bool:
    return result.file is not None and result.file.spin_length is None


def _true_mu(result: "FrictionResult") -> float | None:
    return None if result.file is None else result.plan.true_friction(result.file.speed)


def _true_static(result: "FrictionResult") -> float | None:
    plan = result.plan
    return plan.plant.static_friction if plan.plant is not None and plan.truth_known else None


def _true_e(result: "FrictionResult") -> float | None:
    return result.plan.true_spin_length(1.0)


def _true_exponent(name: str) -> Callable[[Any], Any]:
    return lambda result: getattr(result.plan.true_limit_surface, name, None)


def _true_words(true: float | None, factor: float, unit: str = "") -> str:
    return "" if true is None else f"true {factor * true:.4g}{unit}"


def _joined(*parts: str) -> str:
    return "; ".join(part for part in parts if part)


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
    true: Callable[[Any], float | None],
    remark: Callable[[Any], str],
    *,
    applies: Callable[[Any], bool],
    unit: str = "",
    shown_unit: str = "",
) -> Metric:
    """Return the metric of an estimate of friction.yaml: a row with its interval or reason, and the true value.

    Args:
        key: Key of the metric.
        meaning: Name for people.
        name: Name of the estimate in the file.
        true: Function to the true value.
        remark: Function to a remark: the reason of a bound or of an assumed value, or the kind of measurement.
        applies: Function to whether the run has the metric.
        unit: SI unit.
        shown_unit: Unit of the row.
    """
    found, factor = attrgetter(f"file.{name}"), _MILLI if shown_unit == "mm" else 1.0
    return _EstimateMetric(
        key,
        meaning,
        unit,
        lambda result: found(result).value,
        shown_unit,
        3,
        lambda result: _joined(remark(result), _true_words(true(result), factor)),
        lambda result: (found(result).lower, found(result).upper) if found(result).measured else None,
        applies=applies,
        bound=lambda result: found(result).how == "bound",
    )


def _unless_measured(name: str, reason: Callable[[Any], str]) -> Callable[[Any], str]:
    return lambda result: "" if getattr(result.file, name).measured else reason(result)


def _mu_remark(result: Any) -> str:
    file = result.file
    if not file.friction.measured:
        return f"{result.no_friction_reason}: a lower bound"
    return f"{'all loads together, ' if len(file.loads) > 1 else ''}slipping at {_MILLI * file.speed:.3g} mm/s"


def _against_truth(
    key: str,
    meaning: str,
    unit: str,
    name: str,
    true: Callable[[Any], float | None],
    value: Callable[[Any, Any], MetricValue],
) -> Metric:
    """Return the metric of a measured estimate and its true value; bounds and assumed values have none."""
    found = attrgetter(f"file.{name}")
    return Metric(
        key,
        meaning,
        unit,
        lambda result: value(found(result), true(result)),
        in_table=False,
        applies=lambda result: _has(name)(result) and found(result).measured and true(result) is not None,
    )


def _error(key: str, meaning: str, unit: str, name: str, true: Callable[[Any], float | None]) -> Metric:
    return _against_truth(key, meaning, unit, name, true, lambda found, truth: found.value - truth)


def _inside(key: str, meaning: str, name: str, true: Callable[[Any], float | None]) -> Metric:
    return _against_truth(key, meaning, "", name, true, lambda found, truth: found.lower <= truth <= found.upper)


def _part(key: str, meaning: str, unit: str, name: str, part: str) -> Metric:
    """Return the metric of a part of an estimate, for programs."""
    return Metric(key, meaning, unit, attrgetter(f"file.{name}.{part}"), in_table=False, applies=_has(name))


def _if_measured(key: str, meaning: str, name: str) -> Metric:
    """Return the metric of an exponent for programs; None where it was assumed."""
    found = attrgetter(f"file.{name}")
    return Metric(
        key,
        meaning,
        "",
        lambda result: found(result).value,
        in_table=False,
        applies=lambda result: result.file is not None and found(result).measured,
    )


def _torque_ratio(result: "FrictionResult") -> tuple[float, float] | None:
    """Return the largest torque ratio that was carried [m], and its normal force [N]; None without any."""
    loads = () if result.file is None else result.file.loads
    ratios = [(each.torque_ratio.value, each.normal_force) for each in loads if each.torque_ratio is not None]
    return max(ratios, default=None, key=lambda each: each[0])


def _over_speed(result: Any) -> str:
    """Return whether mu differs between two speeds by more than its intervals."""
    measured = [each.friction for each in result.file.speeds if each.friction.measured]
    varies = max(each.lower for each in measured) > min(each.upper for each in measured)
    return "see figure" if varies else "constant"


def _over_speed_note(result: Any) -> str:
    creeping = ", ".join(f"{_MILLI * speed:.2g}" for speed in result.found.curve.creeping)
    return _joined(f"{len(result.found.speeds)} speeds", f"crept at {creeping} mm/s" if creeping else "")


METRICS = (
    _error("mu_error", "mu found less true mu", "", _MU, _true_mu),
    _error("spin_length_error_m", "e found less true e", "m", _E, _true_e),
    _estimated("mu_found", "friction mu", _MU, _true_mu, _mu_remark, applies=_rubbed),
    _part("mu_lower", "lower end of mu's 95 % interval", "", _MU, "lower"),
    _part("mu_upper", "upper end of mu's 95 % interval", "", _MU, "upper"),
    _part("mu_how", "source of mu", "", _MU, "how.value"),
    Metric("mu_true", "true mu", "", _true_mu, in_table=False),
    _inside("mu_inside", "share of intervals that hold true mu", _MU, _true_mu),
    _estimated(
        "static_friction_found",
        "static friction",
        "static_friction",
        _true_static,
        _unless_measured("static_friction", lambda result: f"{result.no_static_friction_reason}: a lower bound"),
        applies=_has("static_friction"),
    ),
    _estimated(
        "spin_length_found_m",
        "spin length e at 1 N",
        _E,
        _true_e,
        _unless_measured(_E, lambda result: f"{result.no_spin_length_reason}: a lower bound"),
        applies=_has(_E),
        unit="m",
        shown_unit="mm",
    ),
    _part("spin_length_lower_m", "lower end of e's 95 % interval", "m", _E, "lower"),
    _part("spin_length_upper_m", "upper end of e's 95 % interval", "m", _E, "upper"),
    _part("spin_length_how", "source of e", "", _E, "how.value"),
    Metric("spin_length_true_m", "true e at 1 N", "m", _true_e, in_table=False),
    _inside("spin_length_inside", "share of intervals that hold true e", _E, _true_e),
    Metric(
        "spin_length_missing",
        "spin length e",
        "",
        lambda result: "not found",
        note=lambda result: _joined(
            result.no_spin_length_reason, _true_words(_true_e(result), _MILLI, " mm at 1 N")
        ),
        applies=_lacks_spin_length,
    ),
    _EstimateMetric(
        "torque_ratio_least_m",
        "mu e",
        "m",
        lambda result: (_torque_ratio(result) or (None,))[0],
        "mm",
        3,
        lambda result: (
            f"spin torque over normal force that was carried at {(_torque_ratio(result) or (0, 0))[1]:.3g} N"
        ),
        applies=_lacks_spin_length,
        bound=_lacks_spin_length,
    ),
    _estimated(
        "load_exponent_used",
        "growth of e with load, gamma",
        _GAMMA,
        _true_exponent(_GAMMA),
        _unless_measured(_GAMMA, lambda result: "assumed, not measured"),
        applies=_has(_E),
    ),
    _if_measured("load_exponent_found", "gamma, if it was measured", _GAMMA),
    _estimated(
        "norm_exponent_used",
        "norm exponent p",
        _P,
        _true_exponent(_P),
        _unless_measured(_P, lambda result: "assumed, not measured; --fit-exponents measures it"),
        applies=_has(_E),
    ),
    _if_measured("norm_exponent_found", "p, if it was measured", _P),
    Metric(
        "friction_over_speed",
        "friction over speed",
        "",
        _over_speed,
        note=_over_speed_note,
        applies=lambda result: result.found.curve is not None and result.file is not None,
    ),
    Metric(
        "surface",
        "surface",
        "",
        lambda result: result.recognised.material,
        note=lambda result: f"by the library {result.plan.config.library}; {result.recognised.verdict}",
        applies=attrgetter("recognised"),
    ),
    Metric(
        "verdict_ok",
        "assumptions held",
        "",
        attrgetter("found.verdict.ok"),
        note=lambda result: str(result.found.verdict),
        applies=_rubbed,
    ),
    Metric("lost", "times contact was lost", "", attrgetter("lost"), in_table=False),
    Metric("simulated_s", "time of the run", "s", attrgetter("run.duration")),
)
