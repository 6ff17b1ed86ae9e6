"""Metrics of an exploration, the most important first; imports nothing heavy."""

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from palpate.experiments.kit.metric import Metric

if TYPE_CHECKING:
    from palpate.experiments.explore.exploration import ExplorationResult
    from palpate.experiments.explore.explored_map import ExploredMap, LayerSummary


def _of_map(value: "Callable[[ExploredMap], Any]") -> "Callable[[ExplorationResult], Any]":
    """Return a function of the result from one of its map, if that claims a surface; None if it claims none."""
    return lambda result: None if result.claimed_map is None else value(result.claimed_map)


_claims = _of_map(lambda found: True)
_claims_and_knows = _of_map(lambda found: found.truth_known)


def _knows_or_robot(result: "ExplorationResult") -> bool:
    """Whether the points have an error, or a robot hides it; False if a simulated finger felt nothing."""
    return len(result.cloud) > 0 or not result.truth.known


def _set_force(result: "ExplorationResult") -> str:
    config, force = result.config, result.set_force[result.scanning]
    if config.force_swing:
        return f"set {config.force:g} N ± {config.force_swing:g} N"
    if not len(force) or force.min() == force.max():
        return f"set {config.force:g} N"
    return f"set {force.min():g} to {force.max():g} N, changed while it ran"


def _observed(result: "ExplorationResult") -> float | None:
    found = result.map
    return None if found is None or found.is_line or not found.truth_known else found.observed_share


def _reachable(result: "ExplorationResult") -> str:
    return "" if result.map is None else f"of {1e4 * result.map.reachable.area.sum():.3g} cm²"


def _goal(result: "ExplorationResult") -> Any:
    """Goal of an active exploration; None of others."""
    return result.plan.scan.goal


def _marks(result: "ExplorationResult") -> str:
    from palpate.experiments.explore.exploration import marks_text

    return marks_text(result.marks)


def _shape(result: "ExplorationResult") -> str | None:
    shape = None if result.map is None else result.map.shape
    return None if shape is None or shape.kind is None else shape.kind.value


def _shape_note(result: "ExplorationResult") -> str:
    """Size of a shape that has only one, with its 95 % band."""
    shape = None if result.map is None else result.map.shape
    if shape is None or shape.fit is None:
        return "too little was felt" if result.map is not None and result.map.felt_little else ""
    sizes = shape.fit.shape.SIZES
    if len(sizes) != 1:
        return ""
    return f"{sizes[0]} {1e3 * float(shape.fit.shape.sizes[0]):.5g} ± {1e3 * float(shape.sizes_band[0]):.2g} mm"


def _layer_metric(
    key: str, meaning: str, layer: str, unit: str, shown_unit: str = "", scale: float = 1.0
) -> Metric:
    """Return the metric of a layer's median; `scale` is the factor from SI to the shown unit."""

    def summary(result: "ExplorationResult") -> "LayerSummary | None":
        return None if result.map is None else result.map.layer(layer)

    def value(result: "ExplorationResult") -> float | None:
        found = summary(result)
        return None if found is None else found.median

    def note(result: "ExplorationResult") -> str:
        found = summary(result)
        return "" if found is None else f"± {scale * found.sd:.2g}, on {100.0 * found.share:.0f} %"

    return Metric(key, meaning, unit, value, shown_unit, note=note)


METRICS = (
    Metric(
        "map_rms_m",
        "map to true surface, RMS",
        "m",
        _of_map(lambda found: found.rms),
        "mm",
        note=_of_map(lambda found: f"{int(found.claimed.sum())} vertices"),
        needs_truth=True,
        applies=_claims,
    ),
    Metric(
        "force_rms_n",
        "true normal force, RMS error",
        "N",
        lambda result: result.force_rms,
        note=_set_force,
        needs_truth=True,
    ),
    Metric(
        "point_rms_m",
        "points to true surface, RMS",
        "m",
        lambda result: result.point_rms,
        "mm",
        needs_truth=True,
        applies=_knows_or_robot,
    ),
    Metric(
        "map_band_m",
        "half of the map's 95 % band",
        "m",
        _of_map(lambda found: found.band),
        "mm",
        note="random errors and budget",
    ),
    Metric(
        "map_in_band",
        "true errors inside that band",
        "",
        _of_map(lambda found: found.covered),
        "%",
        note="target 95 %",
        needs_truth=True,
        applies=_claims_and_knows,
    ),
    Metric(
        "map_broken",
        "broken assumptions of the map",
        "",
        lambda result: None if result.map is None else result.map.verdict.names,
        in_table=False,
    ),
    Metric(
        "tip_broken",
        "broken assumptions of the tip",
        "",
        lambda result: None if result.tip is None else ", ".join(each.assumption.name for each in result.tip),
        in_table=False,
    ),
    Metric("observed_share", "observed of the reachable", "", _observed, "%", note=_reachable),
    Metric(
        "force_max_n",
        "largest force felt",
        "N",
        lambda result: result.assumptions.most_force,
        note=lambda result: f"limit {result.plan.limits.force:g} N",
    ),
    Metric(
        "point_p99_m",
        "points to true surface, 99 %",
        "m",
        lambda result: result.point_p99,
        "mm",
        needs_truth=True,
        applies=lambda result: result.truth.known and len(result.cloud) > 0,
    ),
    Metric(
        "map_max_m",
        "map to true surface, largest",
        "m",
        _of_map(lambda found: found.largest_error),
        "mm",
        needs_truth=True,
        applies=_claims_and_knows,
    ),
    Metric(
        "accuracy_m",
        "target accuracy of the map",
        "m",
        lambda result: _goal(result).error,
        "mm",
        note=lambda result: "RMS error" if _goal(result).measure.name == "RMS" else "largest error",
        applies=_goal,
    ),
    Metric(
        "held_motion_m",
        "moved in the fingers, at most",
        "m",
        lambda result: result.held_motion,
        "mm",
        note="object, or end of the tool, by elastic contacts and slip, seen from the fingers that hold it",
        needs_truth=True,
        applies=lambda result: result.held_motion is not None,
    ),
    Metric("contacts", "contacts", "", lambda result: len(result.cloud)),
    Metric("marks", "marks", "", lambda result: len(result.marks), note=_marks),
    Metric(
        "map_kind",
        "map",
        "",
        lambda result: "a line" if result.map is not None and result.map.is_line else None,
        note="claims no surface",
    ),
    _layer_metric("stiffness_n_per_m", "stiffness of the object", "stiffness", "N/m", "kN/m", 1e-3),
    _layer_metric("curvature_mean_per_m", "mean curvature of the map", "curvature_mean", "1/m"),
    Metric("shape", "shape, if it is clear", "", _shape, in_table=False),
    Metric(
        "shape_found",
        "shape",
        "",
        lambda result: None if result.map is None else result.map.shape_name,
        note=_shape_note,
    ),
    Metric(
        "shape_broken",
        "broken assumptions of the shape",
        "",
        lambda result: None if result.map is None or result.map.shape is None else result.map.shape.verdict.names,
        in_table=False,
    ),
    Metric("simulated_s", "time of the run", "s", lambda result: result.run.duration),
)
