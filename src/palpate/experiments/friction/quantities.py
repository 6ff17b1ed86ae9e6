"""Key metrics of a friction measurement, with intervals, and the reasons for bounds."""

from palpate.experiments.friction.result import FrictionResult
from palpate.experiments.friction.words import bound_reason, bound_words, no_spin_length
from palpate.friction.friction_file import FrictionEstimate, FrictionFile, How
from palpate.friction.rubbing.sliding import FrictionMeasured
from palpate.reporting.data import Quantity, interval_words, value_words
from palpate.robots.known_truth import time_name


def quantities(result: FrictionResult) -> tuple[Quantity, ...]:
    """Return the metrics that matter, most important first."""
    file, plan = result.file, result.plan
    run = (Quantity(time_name(result.cost), result.run.duration, "s"),)
    if file is None:
        return run
    true, verdict = plan.true_limit_surface, result.found.verdict
    together = "all loads together, " if len(file.loads) > 1 else ""
    note = f"{together}slipping at {1e3 * file.speed:.3g} mm/s" if file.friction.measured else ""
    metrics = [
        _figure(
            "friction mu", file.friction, plan.true_friction(file.speed), note=note, bound=_strokes_bound(result)
        ),
    ]
    if file.static_friction is not None:
        static = plan.plant.static_friction if plan.plant is not None and plan.truth_known else None
        metrics.append(_figure("static friction", file.static_friction, static, bound=_static_bound(result)))
    true_length, why = plan.true_spin_length(1.0), no_spin_length(result)
    if file.spin_length is None:
        truth = "" if true_length is None else f"; true {1e3 * true_length:.4g} mm at 1 N"
        metrics.append(Quantity("spin length e", "not found", "", f"{why}{truth}"))
        metrics += _torque(file)
    else:
        metrics.append(_figure("spin length e at 1 N", file.spin_length, true_length, "mm", 1e3, bound=why or ""))
        gamma, p = (None, None) if true is None else (true.load_exponent, true.norm_exponent)
        metrics.append(_figure("growth of e with load, gamma", file.load_exponent, gamma))
        metrics.append(_figure("norm exponent p", file.norm_exponent, p))
    curve = result.found.curve
    if curve is not None:
        slope = "see figure" if _varies(file) else "constant"
        creep = f"; crept at {', '.join(f'{1e3 * v:.2g}' for v in curve.creeping)} mm/s" if curve.creeping else ""
        metrics.append(Quantity("friction over speed", slope, "", f"{len(result.found.speeds)} speeds{creep}"))
    known = result.recognised
    if known is not None:
        metrics.append(
            Quantity("surface", known.material, "", f"by the library {plan.config.library}; {known.verdict}")
        )
    metrics.append(Quantity("verdict", "OK" if verdict.ok else "not OK", "", str(verdict)))
    return (*metrics, *run)


def _figure(
    name: str,
    found: FrictionEstimate,
    true: float | None,
    unit: str = "",
    factor: float = 1.0,
    note: str = "",
    bound: str = "it never slipped",
) -> Quantity:
    parts = []
    if found.measured:
        parts.append(interval_words(factor * found.value, factor * found.lower, factor * found.upper))
    elif found.how is How.BOUND:
        parts.append(f"{bound}: a lower bound")
    else:
        parts.append("assumed, not measured" + ("; --fit-exponents measures it" if name.endswith(" p") else ""))
    if note:
        parts.append(note)
    if true is not None:
        parts.append(f"true {factor * true:.4g}")
    value = value_words(factor * found.value, factor * found.lower, factor * found.upper)
    if found.how is How.BOUND:
        value = bound_words(factor * found.value)
    return Quantity(name, value, unit, "; ".join(parts))


def _strokes_bound(result: FrictionResult) -> str:
    """Why strokes gave no more than a bound; of several reasons that of who came nearest to slip."""
    reasons = {bound_reason(each.friction) for each in result.found.loads}
    return max(reasons, default="", key=len)


def _static_bound(result: FrictionResult) -> str:
    felt = [each for each in result.found.speeds if isinstance(each.friction, FrictionMeasured)]
    if any(each.friction.turns is not None for each in felt if isinstance(each.friction, FrictionMeasured)):
        return "it stuck and let go a few times only"
    return f"mu still rose at the slowest speed, {1e3 * min(each.speed for each in felt):.3g} mm/s"


def _torque(file: FrictionFile) -> list[Quantity]:
    """The largest mu e that was borne, where mu is not known."""
    known = [(at.torque_ratio, at.normal_force) for at in file.loads if at.torque_ratio is not None]
    if not known:
        return []
    ratio, force = max(known, key=lambda each: each[0].value)
    note = f"spin torque over normal force that was borne at {force:.3g} N"
    return [Quantity("mu e", bound_words(1e3 * ratio.value), "mm", note)]


def _varies(file: FrictionFile) -> bool:
    """Whether mu at one speed is another than at some other, beyond their intervals."""
    felt = [each.friction for each in file.speeds if each.friction.measured]
    return max(each.lower for each in felt) > min(each.upper for each in felt)
