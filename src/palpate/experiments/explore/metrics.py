"""What an exploration is measured by, what matters most first; imports nothing heavy."""

from collections.abc import Callable
from typing import TYPE_CHECKING

from palpate.experiments.kit.metric import Metric, MetricValue

if TYPE_CHECKING:
    from palpate.experiments.explore.exploration import ExplorationResult
    from palpate.experiments.explore.explored_map import ExploredMap


def _of_map(
    value: "Callable[[ExploredMap], float]", *, true: bool = True
) -> "Callable[[ExplorationResult], MetricValue]":
    """From a metric of a map that claims something to one of the exploration; a `true` one needs the truth."""

    def found(exploration: "ExplorationResult") -> MetricValue:
        known = exploration.claimed_map
        return None if known is None or (true and not known.truth_known) else value(known)

    return found


def _shape(exploration: "ExplorationResult") -> str | None:
    shape = None if exploration.map is None else exploration.map.shape
    return None if shape is None or shape.kind is None else shape.kind.value


def _broken(exploration: "ExplorationResult") -> str | None:
    found = exploration.map
    return None if found is None else found.verdict.names


def _unsure(exploration: "ExplorationResult") -> str | None:
    shape = None if exploration.map is None else exploration.map.shape
    return None if shape is None else shape.verdict.names


def _tip(exploration: "ExplorationResult") -> str | None:
    check = exploration.tip
    return None if check is None else ", ".join(broken.assumption.name for broken in check.broken())


METRICS = (
    Metric("map_rms_m", "map to true surface, RMS", "m", _of_map(lambda found: found.rms)),
    Metric("force_rms_n", "true normal force, RMS error", "N", lambda found: found.force_rms),
    Metric("point_rms_m", "points to true surface, RMS", "m", lambda found: found.point_rms),
    Metric("map_band_m", "map's 95 % band, half its width", "m", _of_map(lambda found: found.band, true=False)),
    Metric("map_in_band", "share of errors inside that band", "", _of_map(lambda found: found.covered)),
    Metric("map_broken", "assumptions of the map that broke", "", _broken),
    Metric("tip_broken", "assumptions of the tip that broke", "", _tip),
    Metric("observed_share", "observed of the reachable", "", _of_map(lambda found: found.observed_share)),
    Metric("force_max_n", "largest force felt", "N", lambda found: found.assumptions.most_force),
    Metric("point_p99_m", "points to true surface, 99 %", "m", lambda found: found.point_p99),
    Metric("held_motion_m", "moved in the fingers, at most", "m", lambda found: found.held_motion),
    Metric("contacts", "contacts", "", lambda found: len(found.cloud)),
    Metric("marks", "marks", "", lambda found: len(found.marks)),
    Metric("shape", "shape", "", _shape),
    Metric("shape_broken", "assumptions of the shape that broke", "", _unsure),
    Metric("simulated_s", "simulated time", "s", lambda found: found.run.duration),
)
