"""What the report on several runs side by side says."""

import math
import shlex
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from palpate.commands.compare.report_data import ComparedFigure, ComparisonReport, Curve, Overlay, Spreads
from palpate.commands.compare.runs_compared import ComparedRun, changed_fields, common_fields
from palpate.errors import FloatArray
from palpate.experiments.explore.plan import ExplorationPlan
from palpate.experiments.friction.plan import FrictionPlan
from palpate.experiments.grasp.plan import GraspPlan
from palpate.experiments.kit.option_words import has_unit, option_unit, option_words
from palpate.runtime import Phase

MILLI, MICRO = 1e3, 1e6

WORK: dict[type, tuple[Phase, str]] = {
    ExplorationPlan: (Phase.SCAN, "while it slid along the surface"),
    FrictionPlan: (Phase.SCAN, "while it rubbed"),
    GraspPlan: (Phase.HOLD, "while it was held"),
}
"""Of each kind of plan the phase that it is all about, and its words; of any other it is HOLD."""

REST = (Phase.HOLD, "while the force was held")

DASHES = (
    " Dashed, what was asked for: the nearer a line to its dashes the better, whatever force a run was asked for."
)

LIGHTEST = 0.1
"""Below this share of the median force no ratio of forces is taken: landing and lifting are noise over noise."""


def comparison_report(runs: Sequence[ComparedRun], out: Path) -> ComparisonReport:
    """Return the report on two or more runs of the same experiment.

    Args:
        runs: Each another one.
        out: Folder that the report goes to.
    """
    changed = changed_fields(runs)
    names = tuple(run.name for run in runs)
    figures = compared_figures(runs)
    return ComparisonReport(
        title=f"{', '.join(names[:-1])} and {names[-1]}, side by side",
        asked=f"to compare {len(runs)} runs of {runs[0].kind.command}; differences are to the first, {names[0]}",
        outcome=outcome(runs, figures),
        names=names,
        differences=tuple(
            (name, _unit(runs, name, values), *(option_words(value) for value in values))
            for name, values in changed
        ),
        figures=figures,
        overlays=_overlays(runs),
        spreads=_spreads(runs),
        advice=_advice(len(changed)),
        repeat=(
            (
                "The same again:",
                shlex.join(["palpate", "compare", *(str(run.place) for run in runs), "--out", str(out)]),
            ),
        ),
        settings=tuple(
            (name, f"{option_words(value)} {_unit(runs, name, (value,))}".rstrip())
            for name, value in common_fields(runs)
        )
        + tuple((f"log of {run.name}", str(run.log.path)) for run in runs),
    )


def outcome(runs: Sequence[ComparedRun], figures: Sequence[ComparedFigure]) -> str:
    """Return in a sentence or two what came out."""
    changed = len(changed_fields(runs))
    said = [f"{changed} option{' was' if changed == 1 else 's were'} asked differently."]
    first = next((f for f in figures if all(isinstance(v, float) and math.isfinite(v) for v in f.values)), None)
    if first is not None:
        each = ", ".join(f"{shown} in {run.name}" for shown, run in zip(first.shown, runs, strict=True))
        unit = f" [{first.unit}]" if first.unit else ""
        said.append(f"{first.name[:1].upper()}{first.name[1:]}{unit}: {each}.")
    return " ".join(said)


def compared_figures(runs: Sequence[ComparedRun]) -> tuple[ComparedFigure, ...]:
    """Return the figures of each run, most important first; those that no run has are left out."""
    phase, while_ = WORK.get(type(runs[0].planned), REST)
    error = "felt normal force off the set one, RMS"
    found = [
        _figure(runs, "points to true surface, RMS", "mm", lambda run: MILLI * _rms(run.points), "less is better"),
        _figure(
            runs,
            error,
            "N",
            lambda run: _rms(_at(run, phase, run.felt - run.set_force)),
            f"{while_}; less is better",
        ),
        _figure(
            runs,
            "commanded grip, mean",
            "N",
            lambda run: _mean(_at(run, phase, run.commanded_grip)),
            f"{while_}; less is gentler, as long as nothing slips",
        ),
        _figure(runs, "felt normal force, mean", "N", lambda run: _mean(_at(run, phase, run.felt)), while_),
        _figure(
            runs,
            "largest force felt",
            "N",
            lambda run: float(run.felt.max()),
            "of the whole run; limits stop a run",
        ),
        _figure(
            runs,
            "tangential over normal force, median",
            "",
            lambda run: _ratio(run, phase),
            f"{while_}; where it slides this is the coefficient of friction",
        ),
        _figure(
            runs,
            "way of the tip",
            "mm",
            lambda run: MILLI * float(np.linalg.norm(np.diff(run.records[0].position, axis=0), axis=1).sum()),
            "shorter is quicker",
        ),
        _figure(
            runs, "time of the run", "s", lambda run: float(run.time[-1]), "from its first period to its last"
        ),
    ]
    known = [f for f in found if any(isinstance(v, str) or math.isfinite(v) for v in f.values)]
    return (*known, ComparedFigure("how it ended", "", tuple(run.ending for run in runs)))


def _figure(
    runs: Sequence[ComparedRun], name: str, unit: str, value: Callable[[ComparedRun], float], note: str
) -> ComparedFigure:
    return ComparedFigure(name, unit, tuple(value(run) for run in runs), note)


def _overlays(runs: Sequence[ComparedRun]) -> tuple[Overlay, ...]:
    felt = [Curve(i, run.time, np.where(run.felt > 0.0, run.felt, np.nan)) for i, run in enumerate(runs)]
    asked = [Curve(i, run.time, run.set_force, asked=True) for i, run in enumerate(runs)]
    asked = [curve for curve in asked if np.isfinite(curve.y).any()]
    mean = ", the mean over the fingers" if len(runs[0].records) > 1 else ""
    drawn = [
        Overlay(
            "Normal force over time",
            f"Normal force that was felt{mean}, from the beginning of each run on.{DASHES if asked else ''}",
            "time [s]",
            "normal force [N]",
            (*felt, *asked),
        )
    ]
    grips = [Curve(i, run.time, run.commanded_grip) for i, run in enumerate(runs)]
    if any(np.isfinite(curve.y).any() for curve in grips):
        drawn.append(
            Overlay(
                "Grip over time",
                "Grip that was commanded, the mean over the fingers. The lower the gentler, as long as the object "
                "neither slips nor spins; how it ended stands above.",
                "time [s]",
                "commanded grip [N]",
                tuple(grips),
            )
        )
    return tuple(drawn)


def _spreads(runs: Sequence[ComparedRun]) -> tuple[Spreads, ...]:
    if not any(len(run.points) for run in runs):
        return ()
    return (
        Spreads(
            "Errors of the surface",
            "Signed distances of the touched points from the true surface, positive outside, as shares of each "
            "run's points. Narrow and about zero is good; what is further off is counted at the rim.",
            "error of the points [µm]",
            tuple(MICRO * run.points for run in runs),
        ),
    )


def _advice(changed: int) -> tuple[str, ...]:
    if changed == 0:
        return (
            "Nothing was asked differently: what differs is chance, or another version; palpate log info tells.",
        )
    if changed == 1:
        return (
            "One thing was asked differently: to see chance apart from it, repeat with other seeds (palpate "
            "sweep).",
        )
    return (
        f"{changed} things were asked differently: to see what each of them does, change one at a time (palpate "
        "sweep).",
    )


def _at(run: ComparedRun, phase: Phase, values: FloatArray) -> FloatArray:
    return np.asarray(values[run.records[0].phase == phase.value])


def _ratio(run: ComparedRun, phase: Phase) -> float:
    """Tangential over normal force of the first finger while it worked; NaN of a hand, which does not slide."""
    if len(run.records) > 1:
        return math.nan
    record = next(iter(run.records))
    kept = (record.phase == phase.value) & record.touching
    normal = record.normal_force[kept]
    if not len(normal):
        return math.nan
    pushing = normal > LIGHTEST * max(float(np.nanmedian(normal)), 0.0)
    along = np.linalg.norm(record.tangential_force[kept], axis=1)
    return float(np.nanmedian(along[pushing] / normal[pushing])) if pushing.any() else math.nan


def _rms(values: FloatArray) -> float:
    finite = values[np.isfinite(values)]
    return float(np.sqrt(np.mean(np.square(finite)))) if len(finite) else math.nan


def _mean(values: FloatArray) -> float:
    finite = values[np.isfinite(values)]
    return float(finite.mean()) if len(finite) else math.nan


def _unit(runs: Sequence[ComparedRun], name: str, values: Sequence[object]) -> str:
    return option_unit(runs[0].kind.experiment, name) if any(map(has_unit, values)) else ""
