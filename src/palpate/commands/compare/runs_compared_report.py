"""The report on several runs side by side."""

import math
import shlex
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from palpate.commands.compare.compared_metric import ComparedMetric
from palpate.commands.compare.run_figures import Curve, bars_figure, overlay_figure, spread_figure
from palpate.commands.compare.runs_compared import ComparedRun, changed_fields, common_fields
from palpate.errors import FloatArray
from palpate.experiments.kit.comparable import FeltMap
from palpate.experiments.kit.metric import metrics_of
from palpate.experiments.kit.option_words import has_unit, option_words
from palpate.experiments.kit.options import specs_of
from palpate.mapping import Knowledge
from palpate.mapping.mesh_metrics import MeshMetrics
from palpate.reporting.figure import Axis, Figure, Space
from palpate.reporting.marks import Colouring, ColourScale
from palpate.reporting.report import Figures, Paragraph, Report, Section, TextTable
from palpate.reporting.solids import Surface
from palpate.runtime import Phase

SHOWN_PERCENT = 99.0
"""Colours span this share of the differences, so that a few outliers do not hide the rest."""

LEAST_SHOWN = 0.1
"""Colours span this share of both bands at least: what is less is nothing."""

LEAST_COMMON = 0.02
"""Share of the first map from which on two are of the same region: below, it is a rim that they share."""

MICRO = 1e6


@dataclass(frozen=True, slots=True, eq=False)
class MapDifference:
    """Another map less the first one, at the vertices of the first.

    Attributes:
        height: Along the normal, positive where the other lies further out; NaN where not both claim the surface,
            shape (n,) [m].
        band: Both half-widths of 95 % bands together, shape (n,) [m].
    """

    height: FloatArray
    band: FloatArray

    @classmethod
    def of(cls, first: FeltMap, other: FeltMap) -> "MapDifference":
        """Return the difference; what the other says between its own vertices is exact, not interpolated."""
        there = other.surface.query(first.mesh.vertices)
        both = there.observed & (first.mesh.knowledge == Knowledge.OBSERVED)
        return cls(np.where(both, -there.distance, np.nan), first.mesh.band() + there.band())

    @property
    def common(self) -> FloatArray:
        """The heights that are known, shape (k,) [m]."""
        return self.height[np.isfinite(self.height)]

    @property
    def words(self) -> str:
        """How large it is, and on which share of what is common both bands allow it."""
        rms = MICRO * float(np.sqrt(np.mean(self.common**2)))
        within = 100.0 * float(np.mean(np.abs(self.height) <= self.band, where=np.isfinite(self.height)))
        return f"{rms:.3g} µm RMS, {within:.0f} % within both bands"


def difference_figure(maps: Sequence[FeltMap | None], names: Sequence[str]) -> Figure | None:
    """Return every later map less the first run's; None where no two are of the same region."""
    first = maps[0]
    if first is None:
        return None
    others = zip(names[1:], maps[1:], strict=True)
    each = [(name, MapDifference.of(first, other)) for name, other in others if other is not None]
    found = [(name, one) for name, one in each if len(one.common) > LEAST_COMMON * len(one.height)]
    if not found:
        return None
    told = "; ".join(f"{name}: {one.words}" for name, one in found)
    return Figure(
        title="Difference of the maps",
        caption=f"The map of {names[0]}, coloured by how much further out the other one lies; grey where not both "
        f"know the surface. {told}. Where it is more than both 95 % bands together, one of the maps is wrong.",
        panels=tuple(
            Space((_coloured(first, one),), title=f"{name} less {names[0]}", height=400) for name, one in found
        ),
        columns=min(2, len(found)),
        wide=len(found) > 1,
    )


def _coloured(first: FeltMap, found: MapDifference) -> Surface:
    shown = float(np.percentile(np.abs(found.common), SHOWN_PERCENT))
    largest = MICRO * max(shown, LEAST_SHOWN * float(np.nanmedian(found.band)))
    height = Colouring("difference", MICRO * found.height, "µm", -largest, largest, ColourScale.ERROR)
    share = Colouring("difference over both bands", np.abs(found.height) / found.band, low=0.0, high=2.0)
    return Surface(first.mesh.vertices, first.mesh.triangles, colourings=(height, share))


WORKING = (Phase.SCAN, Phase.HOLD)
"""Main phases: the first of them that a run has; approach, settling and lifting do not count."""

ALIKE = "All options are the same."

BoolArray = np.ndarray[tuple[int], np.dtype[np.bool_]]

DASHES = " Dashed: the set force of each run; the nearer a line to its dashes the better."

LIGHTEST = 0.1
"""Below this share of the median force no ratio of forces is taken: landing and lifting are noise over noise."""


def comparison_report(runs: Sequence[ComparedRun], out: Path) -> Report:
    """Return the report on two or more runs of the same experiment.

    Args:
        runs: Each another one.
        out: Folder that the report goes to.
    """
    names = tuple(run.name for run in runs)
    metrics, differences, count = compared_metrics(runs), changed_options(runs), len(runs)
    options = TextTable(differences, ("name", "unit", *("value",) * count), ("option", "unit", *names))
    side_by_side = TextTable(
        [(f.name, f.scale.unit, *f.shown, *f.differences, f.note) for f in metrics],
        ("name", "unit", *("value",) * (2 * count - 1), "note"),
        compared_heads(names),
    )
    return Report(
        title=f"{', '.join(names[:-1])} and {names[-1]}, side by side",
        asked=f"to compare {count} runs of `palpate {runs[0].experiment.name}` with the first of them, {names[0]}",
        outcome=outcome(runs, metrics),
        metrics=(),
        sections=(
            Section("Options that differ", (options if differences else Paragraph(ALIKE),)),
            Section(
                "Metrics side by side",
                (side_by_side, Figures(lambda: (bars_figure([f for f in metrics if f.key], names),))),
            ),
            Section("What was found", (Figures(lambda: _surfaces(runs, names)),)),
            Section("Over time", (Figures(lambda: _over_time(runs, names)),)),
        ),
        advice=_advice(len(differences)),
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
        footer="Metrics and figures are computed anew from the runs' logs, the same way for each.",
    )


def compared_heads(names: Sequence[str]) -> tuple[str, ...]:
    """Return the heads of a table of metrics side by side."""
    less = (f"{name} less {names[0]}" for name in names[1:])
    return ("metric", "unit", *names, *less, "what is good")


def changed_options(runs: Sequence[ComparedRun]) -> tuple[tuple[str, ...], ...]:
    """Return the options that differ: name, unit, and the value in each run."""
    return tuple(
        (name, _unit(runs, name, values), *(option_words(value) for value in values))
        for name, values in changed_fields(runs)
    )


def outcome(runs: Sequence[ComparedRun], metrics: Sequence[ComparedMetric]) -> str:
    """Return the outcome in a sentence or two."""
    changed = len(changed_fields(runs))
    sentences = [f"{changed} option{' differs' if changed == 1 else 's differ'}."]
    first = next((f for f in metrics if all(isinstance(v, float) and math.isfinite(v) for v in f.values)), None)
    if first is not None:
        each = ", ".join(f"{shown} in {run.name}" for shown, run in zip(first.shown, runs, strict=True))
        unit = f" [{first.scale.unit}]" if first.unit else ""
        sentences.append(f"{first.name[:1].upper()}{first.name[1:]}{unit}: {each}.")
    return " ".join(sentences)


def compared_metrics(runs: Sequence[ComparedRun]) -> tuple[ComparedMetric, ...]:
    """Return the metrics of each run, most important first; those that no run has are left out."""
    experiment, while_ = runs[0].experiment, "in the main phase"
    each = [metrics_of(experiment, run.result) for run in runs]
    own = [
        ComparedMetric(its.meaning, its.unit, tuple(_value(values[its.key]) for values in each), "", its.key)
        for its in experiment.metrics
    ]
    own.append(ComparedMetric("area observed", "m^2", tuple(map(_area, runs)), "more is better", "map_area_m2"))
    felt = [
        _figure(
            runs,
            "felt normal force off the set one, RMS",
            "N",
            lambda run: _rms(_working(run, run.felt - run.set_force)),
            f"{while_}; less is better",
        ),
        _figure(
            runs,
            "commanded grip, mean",
            "N",
            lambda run: _mean(_working(run, run.commanded_grip)),
            f"{while_}; less is gentler, as long as nothing slips",
        ),
        _figure(runs, "felt normal force, mean", "N", lambda run: _mean(_working(run, run.felt)), while_),
        _figure(runs, "largest force felt", "N", lambda run: float(run.felt.max()), "of the whole run"),
        _figure(
            runs,
            "tangential over normal force, median",
            "",
            _ratio,
            f"{while_}; where it slides this is the coefficient of friction",
        ),
        _figure(
            runs,
            "path length of the tip",
            "m",
            lambda run: float(np.linalg.norm(np.diff(run.records[0].position, axis=0), axis=1).sum()),
            "shorter is quicker",
        ),
        _figure(
            runs, "time of the run", "s", lambda run: float(run.time[-1]), "from its first period to its last"
        ),
    ]
    named = {f.name for f in own}
    shown = (*own, *(f for f in felt if f.name not in named))
    known = [f for f in shown if any(isinstance(v, str) or math.isfinite(v) for v in f.values)]
    return (*known, ComparedMetric("how it ended", "", tuple(run.ending for run in runs)))


def _figure(
    runs: Sequence[ComparedRun], name: str, unit: str, value: Callable[[ComparedRun], float], note: str
) -> ComparedMetric:
    return ComparedMetric(name, unit, tuple(value(run) for run in runs), note)


def _over_time(runs: Sequence[ComparedRun], names: Sequence[str]) -> Iterator[Figure | None]:
    felt = [Curve(i, run.time, np.where(run.felt > 0.0, run.felt, np.nan)) for i, run in enumerate(runs)]
    set_forces = [Curve(i, run.time, run.set_force, is_set_force=True) for i, run in enumerate(runs)]
    set_forces = [curve for curve in set_forces if np.isfinite(curve.y).any()]
    grips = [Curve(i, run.time, run.commanded_grip) for i, run in enumerate(runs)]
    mean = ", the mean over the fingers" if len(runs[0].records) > 1 else ""
    yield overlay_figure(
        "Normal force over time",
        f"Normal force that was felt{mean}, from the beginning of each run on.{DASHES if set_forces else ''}",
        Axis("normal force", "N"),
        (*felt, *set_forces),
        names,
    )
    yield overlay_figure(
        "Grip over time",
        "Grip that was commanded, the mean over the fingers. The lower the gentler, as long as the object "
        "neither slips nor spins; how it ended stands above.",
        Axis("commanded grip", "N"),
        grips,
        names,
    )


def _surfaces(runs: Sequence[ComparedRun], names: Sequence[str]) -> Iterator[Figure | None]:
    samples = [run.errors for run in runs]
    for i in range(max(map(len, samples))):
        yield spread_figure([each[i] if i < len(each) else None for each in samples], names)
    yield difference_figure([run.map for run in runs], names)


def _advice(changed: int) -> tuple[str, ...]:
    if changed == 0:
        return ("All options are the same: differences are chance, or another version (palpate log info).",)
    if changed == 1:
        return (
            "One option differs: to separate its effect from chance, repeat with other seeds (palpate sweep).",
        )
    return (f"{changed} options differ: to see the effect of each, change one at a time (palpate sweep).",)


def _area(run: ComparedRun) -> float:
    """Of the map, as far as it is claimed; NaN without one."""
    return math.nan if run.map is None else MeshMetrics.of(run.map.mesh, Knowledge.OBSERVED).area


def _in_work(run: ComparedRun) -> BoolArray:
    """Which periods are of the main phase, shape (n,)."""
    phase = run.records[0].phase
    each = (phase == its.value for its in WORKING)
    return np.asarray(next((found for found in each if found.any()), np.ones(len(phase), np.bool_)))


def _working(run: ComparedRun, values: FloatArray) -> FloatArray:
    return np.asarray(values[_in_work(run)])


def _ratio(run: ComparedRun) -> float:
    """Tangential over normal force of the first finger while it worked; NaN of a hand, which does not slide."""
    if len(run.records) > 1:
        return math.nan
    record = next(iter(run.records))
    kept = _in_work(run) & record.touching
    normal = record.normal_force[kept]
    if not len(normal):
        return math.nan
    pushing = normal > LIGHTEST * max(float(np.nanmedian(normal)), 0.0)
    along = np.linalg.norm(record.tangential_force[kept], axis=1)
    return float(np.nanmedian(along[pushing] / normal[pushing])) if pushing.any() else math.nan


def _value(value: object) -> float | str:
    if value is None:
        return math.nan
    return float(value) if isinstance(value, bool | int | float) else str(value)


def _rms(values: FloatArray) -> float:
    finite = values[np.isfinite(values)]
    return float(np.sqrt(np.mean(np.square(finite)))) if len(finite) else math.nan


def _mean(values: FloatArray) -> float:
    finite = values[np.isfinite(values)]
    return float(finite.mean()) if len(finite) else math.nan


def _unit(runs: Sequence[ComparedRun], name: str, values: Sequence[object]) -> str:
    return specs_of(runs[0].experiment.Config)[name].unit if any(map(has_unit, values)) else ""
