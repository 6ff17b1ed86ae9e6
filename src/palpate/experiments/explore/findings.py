"""Findings of an exploration: statements of its report and advice; imports nothing heavy."""

import shlex
from typing import TYPE_CHECKING

from palpate.experiments.kit.metric import Finding

if TYPE_CHECKING:
    from palpate.experiments.explore.exploration import ExplorationResult

_REPORTED_ZERO_SHARE = 0.01
"""Least shift of the zero, relative to the set force, that is reported."""

_WELL_OBSERVED_SHARE = 0.95
"""Observed share of the reachable surface at which a map counts as whole."""

_MIN_OBSERVED_SHARE = 0.5
"""Observed share of the reachable surface below which an exploration has missed its purpose."""

_DENSER = {
    "raster": "closer rows (--spacing) or --strategy active find more",
    "spiral": "closer turns (--spacing) or --strategy active find more",
    "taps": "closer taps (--spacing) find more",
    "SPENT": "more --time finds more",
    "REACHED": "a finer --accuracy finds more",
}
"""Options that find more, by strategy or by the reason for the end of an active exploration; a contour has
none."""


def explored_enough(result: "ExplorationResult") -> bool:
    """Return whether at least half of the reachable surface is observed; true where the surface is unknown."""
    return not result.coverage < _MIN_OBSERVED_SHARE


def _done(result: "ExplorationResult") -> bool:
    return result.run.ending.name == "DONE"


def _felt(result: "ExplorationResult") -> bool:
    return len(result.cloud) > 0


def _denser(result: "ExplorationResult") -> str:
    """Options that find more; "" without any."""
    reason = result.stop_reason
    return _DENSER.get(result.config.strategy if reason is None else reason.name, "") if _done(result) else ""


def _events(result: "ExplorationResult") -> set[str]:
    from palpate.experiments.explore.exploration import missed_marks

    return {mark.event.name for mark in missed_marks(result.marks)}


def _changes(result: "ExplorationResult") -> str:
    from palpate.experiments.kit.recorded_run import change_sentences

    return " ".join(change_sentences(result.changes, result.run.duration, "the sweep began"))


def _aim(result: "ExplorationResult") -> str:
    options = {"contour": "--center", "spiral": "--center and --radius"}
    aim = options.get(result.config.strategy, "--center, --width and --depth")
    return f"Nothing was felt: check where the object is, and {aim}; --dry-run shows where the tip would go."


def _other_height(result: "ExplorationResult") -> str:
    level = result.config.curve == "level"
    other = "at another height (--below)" if level else "at a constant height (--curve level)"
    return f"The contour did not close: begin elsewhere (--center), or go round {other}."


def _stiffness(result: "ExplorationResult") -> str:
    check = result.assumptions
    found = float(f"{check.stiffness:.2g}")
    return (
        f"Landing felt {1e-3 * found:g} kN/m, not the {1e-3 * check.assumed_stiffness:g} kN/m assumed: points may "
        f"be off by {1e3 * check.offset:.2g} mm; give --stiffness {found:g}."
    )


FINDINGS = (
    Finding(
        lambda result: _done(result) and not explored_enough(result),
        "That is less than half: it has not been explored.",
    ),
    Finding(lambda result: result.changes, _changes),
    Finding(
        lambda result: result.assumptions.zero_moved > _REPORTED_ZERO_SHARE * result.config.force,
        lambda result: (
            f"The sensor's zero moved by {result.assumptions.zero_moved:.2g} N during the run, and the force was "
            "off by as much; tare the sensor, let it warm up, or explore in shorter runs."
        ),
    ),
    Finding(lambda result: result.assumptions.stiffness_differs, _stiffness),
    Finding(
        lambda result: result.tip,
        lambda result: " ".join(f"Of the fingertip it is {each}." for each in result.tip),
    ),
    Finding(
        lambda result: result.map,
        lambda result: " ".join(f"Of the map it is {each}." for each in result.map.verdict.broken),
    ),
    Finding(lambda result: not _felt(result), remedy=_aim),
    Finding(lambda result: _felt(result) and "OPEN" in _events(result), remedy=_other_height),
    Finding(
        lambda result: _felt(result) and _events(result) - {"OPEN"} and "OPEN" not in _events(result),
        remedy="Places that could not be felt are in marks.csv, each with its reason.",
    ),
    Finding(
        lambda result: _felt(result) and _denser(result) and result.claimed_map is None,
        remedy=lambda result: (
            f"No surface is claimed, for contacts are too far apart or on one line: {_denser(result)}."
        ),
    ),
    Finding(
        lambda result: _denser(result) and result.claimed_map and result.coverage < _WELL_OBSERVED_SHARE,
        remedy=lambda result: (
            f"{100.0 * result.coverage:.0f} % of the reachable surface is observed: {_denser(result)}."
        ),
    ),
    Finding(
        lambda result: _felt(result) and result.claimed_map,
        remedy=lambda result: (
            "To compare the map with a model of the object: palpate compare "
            f"{shlex.quote(str(result.config.out / 'contacts.ply'))} part.stl, both in metres."
        ),
    ),
)
"""Findings in the order of the report."""
