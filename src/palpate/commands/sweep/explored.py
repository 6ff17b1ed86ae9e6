"""Explorations for sweeps: see `palpate.commands.sweep.swept.Carrier`."""

import numpy as np

from palpate.commands.sweep.carried import found_in, sinks_of
from palpate.commands.sweep.swept import Found
from palpate.experiments.explore.config import ExploreConfig
from palpate.experiments.explore.plan import plan
from palpate.experiments.explore.pressing import prepared
from palpate.experiments.explore.run import Attempt, Exploration, write_exploration
from palpate.experiments.kit.figure import Figure, FigureValue, number

FIGURES = (
    Figure("map_rms_m", "map to true surface, RMS", "m"),
    Figure("map_band_m", "map's 95 % band, half its width", "m"),
    Figure("map_in_band", "share of errors inside that band"),
    Figure("observed_share", "observed of the reachable"),
    Figure("force_rms_n", "true normal force, RMS error", "N"),
    Figure("force_max_n", "largest force felt", "N"),
    Figure("point_rms_m", "points to true surface, RMS", "m"),
    Figure("point_p99_m", "points to true surface, 99 %", "m"),
    Figure("contacts", "contacts"),
    Figure("marks", "marks"),
    Figure("shape", "shape"),
    Figure("simulated_s", "simulated time", "s"),
)
MERITS = ("map_rms_m", "force_rms_n", "point_rms_m")
SECONDS = 0.15


def duration_of(config: ExploreConfig) -> float:
    """Plan a run and return about how long it is, simulated [s]."""
    return plan(config).expected_duration


def carry_out(config: ExploreConfig, keep: bool) -> Found:
    """Explore."""
    planned = prepared(plan(config))
    attempt = Attempt(planned)
    exploration = attempt.found(attempt.run((), sinks_of(planned, keep)))
    if keep:
        write_exploration(exploration, config.out)
    return found_in(exploration.run, figures_of(exploration))


def figures_of(exploration: Exploration) -> dict[str, FigureValue]:
    """Return the figures of an exploration."""
    found, error = exploration.map, np.abs(exploration.point_error)
    known = error.size > 0 and bool(np.isfinite(error).all())
    claimed = found is not None and bool(found.claimed.any())
    told: dict[str, FigureValue] = {
        "force_rms_n": number(exploration.force_rms),
        "force_max_n": number(exploration.account.most_force),
        "point_rms_m": number(exploration.point_rms),
        "point_p99_m": number(float(np.percentile(error, 99.0))) if known else None,
        "contacts": len(exploration.cloud),
        "marks": len(exploration.marks),
        "simulated_s": number(exploration.run.duration),
    }
    if found is not None and claimed:
        told["map_band_m"] = number(float(np.median(found.mesh.band()[found.claimed])))
        if found.truth_known:
            told |= {
                "map_rms_m": number(found.rms),
                "map_in_band": number(found.covered),
                "observed_share": number(found.observed_share),
            }
    if found is not None and found.shape is not None:
        told["shape"] = None if found.shape.kind is None else found.shape.kind.value
    return told
