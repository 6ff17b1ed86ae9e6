"""`palpate compare RUN RUN ...`: runs of one experiment side by side, as a table, figures and a report."""

import math
import shlex
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, fields
from functools import cached_property, partial
from pathlib import Path

import numpy as np
import numpy.typing as npt
from rich.console import Console
from rich.table import Table
from rich.text import Text

from palpate.commands.command_result import CommandResult, ExitCode
from palpate.errors import FloatArray, InvalidValueError
from palpate.experiments.kit.checks import make_folder
from palpate.experiments.kit.comparable import ErrorSample, FeltMap, WithErrors, WithMap, WithSetForce
from palpate.experiments.kit.experiment import Result
from palpate.experiments.kit.from_log import LoggedRun
from palpate.experiments.kit.metric import metrics_of
from palpate.experiments.kit.options import has_unit, option_words, specs_of
from palpate.experiments.kit.recorded_run import ProgressCallback, no_progress
from palpate.mapping import Knowledge
from palpate.mapping.mesh_metrics import MeshMetrics
from palpate.reporting.data import FigureKind, Quantity
from palpate.reporting.figure import TIME, Axis, Figure, Panel, Space
from palpate.reporting.marks import Bars, Colouring, ColourScale, Dash, Line, Rule, look_of, shortened
from palpate.reporting.page import write_report
from palpate.reporting.report import Figures, FigureSource, Paragraph, Report, Section, TextTable
from palpate.reporting.solids import Surface
from palpate.reporting.units import Scale, quantity_key, scale_of
from palpate.runtime import Phase, Record
from palpate.runtime.log import log_in, read_log
from palpate.runtime.log.record import record_of
from palpate.runtime.progress import doing, say
from palpate.sensing.contact import ContactStatus

FILE_NAME = "comparison.html"
"""Name of the report in the output folder."""

LOG_ENDING = ".mcap"
"""Suffix of the logs of runs."""

CHANGE_OPTION = "change"
"""Option for changes of live parameters; the log has the changes that took effect."""

OUTPUT_OPTION = "out"
"""Option that does not affect the run."""

MAIN_PHASES = (Phase.SCAN, Phase.HOLD)
"""Phases in which forces are compared: the first of them that a run has."""

MIN_SHARE_OF_MEDIAN_FORCE = 0.1
"""Smallest normal force, per its median, at which a ratio of forces is taken: lighter contacts are noise."""

BAR_DIFFERENCE = 0.05
"""Smallest difference between runs, per the largest value, that is drawn as bars."""

BAR_THICKNESS, BAR_COLUMNS = 0.7, 3
"""Thickness of a bar per distance to the next, and number of bar panels across the page."""

LEGEND_LETTERS, TICK_LETTERS = 32, 14
"""Longest name of a run in a legend, and beside a bar."""

SPREAD_PERCENT, SPREAD_BINS = 99.5, 60
"""Share of all errors within the axis of a spread, so that outliers do not hide the rest; bins."""

COLOURED_PERCENT = 99.0
"""Share of the differences that the colours span, so that outliers do not hide the rest."""

MIN_COLOURED_BANDS = 0.1
"""Share of both bands that the colours span at least."""

MIN_COMMON_SHARE = 0.02
"""Share of the first map that two maps must have in common; less is a rim."""

MICRO = 1e6

BoolArray = npt.NDArray[np.bool_]


@dataclass(frozen=True, slots=False, eq=False)
class ComparedRun:
    """One run, as logged.

    Attributes:
        name: Name that distinguishes the run from the others.
        place: Folder or log, as typed.
        logged: Log, experiment and configuration.
        result: Result, evaluated from the log.
        records: Every period, one record per finger.
    """

    name: str
    place: Path
    logged: LoggedRun
    result: Result
    records: tuple[Record, ...]

    @cached_property
    def set_force(self) -> FloatArray:
        """Set normal force, shape (n,) [N]; NaN where there is none, or where it is unknown."""
        force = np.full(len(self.records[0]), np.nan)
        if isinstance(self.result, WithSetForce):
            known = self.result.set_force[: len(force)]
            force[: len(known)] = known
        return force

    @property
    def errors(self) -> tuple[ErrorSample, ...]:
        """Errors whose spread is drawn."""
        return self.result.error_samples() if isinstance(self.result, WithErrors) else ()

    @property
    def map(self) -> FeltMap | None:
        """Map of the surface, if the run claims one."""
        return self.result.claimed_map if isinstance(self.result, WithMap) else None

    @property
    def time(self) -> FloatArray:
        """Time since the first period, shape (n,) [s]."""
        at = self.records[0].time
        return np.asarray(at - at[0])

    @cached_property
    def felt(self) -> FloatArray:
        """Measured normal force, mean over the fingers, shape (n,) [N]; zero without contact."""
        each = [np.where(r.status == ContactStatus.OK, r.normal_force, 0.0) * r.touching for r in self.records]
        return np.asarray(np.mean(np.nan_to_num(each), axis=0))

    @cached_property
    def commanded_grip(self) -> FloatArray:
        """Commanded grip, mean over the fingers, shape (n,) [N]; NaN without a hand."""
        grip, columns = np.full(len(self.records[0]), np.nan), self.logged.log.codec.columns
        if "command.grip_force" in columns:
            each = self.logged.log.rows[:, columns["command.grip_force"]]
            known = np.isfinite(each).any(axis=1)
            grip[known] = np.nanmean(each[known], axis=1)
        return grip

    @cached_property
    def in_main_phase(self) -> BoolArray:
        """Whether each period belongs to the main phase, shape (n,)."""
        phase = self.records[0].phase
        each = (phase == its.value for its in MAIN_PHASES)
        return np.asarray(next((found for found in each if found.any()), np.ones(len(phase), np.bool_)))

    @property
    def ending(self) -> str:
        """How the run ended, in words."""
        events = self.logged.log.events
        recorded = [event.text.removeprefix("ended: ") for event in events if event.source == "run"]
        return recorded[-1] if recorded else "not noted: the log breaks off"

    @property
    def options(self) -> Mapping[str, object]:
        """Options by name; of live parameters, the changes that the log has, None without any."""
        log, config = self.logged.log, self.logged.config
        found: dict[str, object] = {each.name: getattr(config, each.name) for each in fields(config)}
        found.pop(OUTPUT_OPTION, None)
        if CHANGE_OPTION in found:
            first = log.heading.first_time
            changes = (f"{each.name} {each.value:g} at {each.time - first:.3g} s" for each in log.changes)
            found[CHANGE_OPTION] = "; ".join(changes) or None
        return found


def is_run(place: Path) -> bool:
    """Return whether a place names a run: a folder, or a log."""
    return place.is_dir() or place.suffix == LOG_ENDING


def read_runs(places: Sequence[Path], progress: ProgressCallback = no_progress) -> tuple[ComparedRun, ...]:
    """Return the runs at some places.

    Args:
        places: Folders or logs.
        progress: Called with the name of the run that is being evaluated.

    Raises:
        InvalidValueError: If a place is no run, if two are the same run, or if their experiments differ.
        OSError: If a log cannot be read.
    """
    for place in places:
        if not is_run(place):
            raise InvalidValueError(
                f"{place}: is no run, as {next(each for each in places if is_run(each))} is; give folders of runs "
                "or their logs (.mcap), or a map and a mesh"
            )
    paths = [log_in(place).resolve() for place in places]
    for i, path in enumerate(paths):
        if path in paths[:i]:
            raise InvalidValueError(f"{places[i]} and {places[paths.index(path)]} are the same run: {path}")
    logged = [LoggedRun.of(read_log(path)) for path in paths]
    first = logged[0].experiment.name
    for place, each in zip(places, logged, strict=True):
        if each.experiment.name != first:
            raise InvalidValueError(
                f"{places[0]} is of `palpate {first}` and {place} of `palpate {each.experiment.name}`: only runs "
                "of the same experiment can be compared"
            )
    names = [
        place.resolve().name if place.is_dir() else path.stem for place, path in zip(places, paths, strict=True)
    ]
    if len(set(names)) < len(names):
        names = [f"{i + 1}: {name}" for i, name in enumerate(names)]
    runs = []
    for name, place, each in zip(names, places, logged, strict=True):
        log = each.log
        records = tuple(record_of(log.codec, log.rows, i) for i in range(len(log.layout.channels)))
        if not len(records[0]):
            raise InvalidValueError(f"{log.path}: has no periods: the run ended before its first one")
        progress(f"evaluating {name}")
        runs.append(ComparedRun(name, place, each, each.evaluate(progress), records))
    return tuple(runs)


@dataclass(frozen=True, slots=True)
class ComparedMetric:
    """One metric of every run.

    Attributes:
        name: Meaning for people.
        unit: SI unit; "" for a ratio, a count or words.
        values: Number or words of each run; NaN where a run has none.
        note: Remark: when it holds, and which direction is good.
        key: Name in tables and JSON; "" for one made of name and unit.
    """

    name: str
    unit: str
    values: tuple[float | str, ...]
    note: str = ""
    key: str = ""

    @property
    def numbers(self) -> list[float]:
        """Values that are finite numbers."""
        return [value for value in self.values if not isinstance(value, str) and math.isfinite(value)]

    @property
    def scale(self) -> Scale:
        """Unit in which the values are shown."""
        return scale_of(self.unit, max(map(abs, self.numbers), default=0.0))

    @property
    def shown(self) -> tuple[str, ...]:
        """Values as shown."""
        return tuple(Quantity(self.name, value).text for value in self._scaled)

    @property
    def differences(self) -> tuple[str, ...]:
        """Every later run's value less the first one's, as shown; "" for words and unknown values."""
        first, *others = self._scaled
        return tuple(_difference(value, first) for value in others)

    @property
    def _scaled(self) -> list[float | str]:
        return [value if isinstance(value, str) else self.scale.factor * value for value in self.values]


def _difference(value: float | str, first: float | str) -> str:
    if isinstance(value, str) or isinstance(first, str) or not math.isfinite(value - first):
        return ""
    digits = ".0f" if abs(value - first) >= 1000.0 else ".3g"
    return "0" if value == first else f"{value - first:+{digits}}"


IN_MAIN_PHASE = "in the main phase"

COMMON_METRICS: tuple[tuple[str, str, Callable[[ComparedRun], float], str], ...] = (
    (
        "felt normal force off the set one, RMS",
        "N",
        lambda run: _rms((run.felt - run.set_force)[run.in_main_phase]),
        f"{IN_MAIN_PHASE}; less is better",
    ),
    (
        "commanded grip, mean",
        "N",
        lambda run: _mean(run.commanded_grip[run.in_main_phase]),
        f"{IN_MAIN_PHASE}; less is gentler, as long as nothing slips",
    ),
    ("felt normal force, mean", "N", lambda run: _mean(run.felt[run.in_main_phase]), IN_MAIN_PHASE),
    ("largest force felt", "N", lambda run: float(run.felt.max()), "of the whole run"),
    (
        "tangential over normal force, median",
        "",
        lambda run: _force_ratio(run),
        f"{IN_MAIN_PHASE}; the coefficient of friction while the tip slides",
    ),
    (
        "path length of the tip",
        "m",
        lambda run: float(np.linalg.norm(np.diff(run.records[0].position, axis=0), axis=1).sum()),
        "shorter is quicker",
    ),
    ("time of the run", "s", lambda run: float(run.time[-1]), "from its first period to its last"),
)
"""Metrics of the log of any experiment: name, SI unit, value, remark."""


def compared_metrics(runs: Sequence[ComparedRun]) -> tuple[ComparedMetric, ...]:
    """Return the metrics that any run has: the experiment's own, then those of any log."""
    experiment = runs[0].logged.experiment
    each = [metrics_of(experiment, run.result) for run in runs]
    own = [
        ComparedMetric(its.meaning, its.unit, tuple(_value(values[its.key]) for values in each), "", its.key)
        for its in experiment.metrics
    ]
    own.append(ComparedMetric("area observed", "m^2", tuple(map(_area, runs)), "more is better", "map_area_m2"))
    names = {metric.name for metric in own}
    own += [
        ComparedMetric(name, unit, tuple(value(run) for run in runs), note)
        for name, unit, value, note in COMMON_METRICS
        if name not in names
    ]
    known = [metric for metric in own if metric.numbers or any(isinstance(value, str) for value in metric.values)]
    return (*known, ComparedMetric("how it ended", "", tuple(run.ending for run in runs)))


def _value(value: object) -> float | str:
    if value is None:
        return math.nan
    return float(value) if isinstance(value, bool | int | float) else str(value)


def _area(run: ComparedRun) -> float:
    return math.nan if run.map is None else MeshMetrics.of(run.map.mesh, Knowledge.OBSERVED).area


def _rms(values: FloatArray) -> float:
    return math.sqrt(_mean(np.square(values)))


def _mean(values: FloatArray) -> float:
    finite = values[np.isfinite(values)]
    return float(finite.mean()) if len(finite) else math.nan


def _force_ratio(run: ComparedRun) -> float:
    """Return tangential over normal force of a finger in the main phase; NaN for a hand, which does not slide."""
    record = run.records[0]
    kept = run.in_main_phase & record.touching
    normal = record.normal_force[kept]
    if len(run.records) > 1 or not len(normal):
        return math.nan
    pushing = normal > MIN_SHARE_OF_MEDIAN_FORCE * max(float(np.nanmedian(normal)), 0.0)
    tangential = np.linalg.norm(record.tangential_force[kept], axis=1)
    return float(np.nanmedian(tangential[pushing] / normal[pushing])) if pushing.any() else math.nan


def compared_options(
    runs: Sequence[ComparedRun], *, differing: bool
) -> tuple[tuple[str, tuple[object, ...]], ...]:
    """Return the options that differ between the runs, or those that agree: name, and value in each run."""
    each = [run.options for run in runs]
    found = ((name, tuple(options[name] for options in each)) for name in each[0])
    return tuple(
        (name, values) for name, values in found if any(value != values[0] for value in values[1:]) is differing
    )


def option_rows(runs: Sequence[ComparedRun]) -> tuple[tuple[str, ...], ...]:
    """Return the options that differ as rows: name, unit, and the value in each run."""
    return tuple(
        (name, _option_unit(runs, name, values), *(option_words(value) for value in values))
        for name, values in compared_options(runs, differing=True)
    )


def _option_unit(runs: Sequence[ComparedRun], name: str, values: Sequence[object]) -> str:
    return specs_of(runs[0].logged.experiment.Config)[name].unit if any(map(has_unit, values)) else ""


def compare_runs(places: Sequence[Path], out: Path | None, figures: FigureKind | None = None) -> CommandResult:
    """Compare runs, print the metrics, and write the report.

    Args:
        places: Folders or logs of two runs or more.
        out: Folder for the report; None for the folder of the first run.
        figures: Kind of files in which the figures are written, too; None for none.

    Returns:
        Metrics as lists with one value per run.

    Raises:
        InvalidValueError: If a place is no run, or if the runs cannot be compared.
        OSError: If a log cannot be read, or if the report cannot be written.
    """
    console = Console()
    with doing(console, "reading the logs"):
        runs = read_runs(places, lambda step: say(console, step))
    folder = runs[0].logged.log.path.parent if out is None else out
    make_folder(folder)
    with doing(console, "comparing"):
        report, metrics, options = comparison_report(runs, folder), compared_metrics(runs), option_rows(runs)
    table = Table(title=Text(report.title), caption=Text(report.outcome))
    for i, head in enumerate(_heads(runs)[:-1]):
        table.add_column(Text(head), justify="left" if i < 2 else "right")
    for name, unit, *values in options:
        table.add_row(*map(Text, (f"option: {name}", unit, *values, *("",) * (len(runs) - 1))))
    for metric in metrics:
        table.add_row(*map(Text, (metric.name, metric.scale.unit, *metric.shown, *metric.differences)))
    console.print(table)
    with doing(console, "drawing the report"):
        written = write_report(report, folder / FILE_NAME, figures)
    for line in written.lines:
        say(console, line)
    return CommandResult(
        ExitCode.UNFINISHED if written.failures else ExitCode.DONE,
        outcome=report.outcome,
        metrics={metric.key or quantity_key(metric.name, metric.unit): list(metric.values) for metric in metrics},
        facts={
            "runs": [str(run.logged.log.path) for run in runs],
            "changed_options": {row[0]: list(row[2:]) for row in options},
        },
        files=written.files,
        warnings=written.warnings,
    )


def comparison_report(runs: Sequence[ComparedRun], out: Path) -> Report:
    """Return the report on two or more runs of one experiment.

    Args:
        runs: Runs to compare; the first one is the reference.
        out: Folder of the report.
    """
    names, count = tuple(run.name for run in runs), len(runs)
    metrics, options = compared_metrics(runs), option_rows(runs)
    differing = Paragraph("All options are the same.")
    table = TextTable(options, ("name", "unit", *("value",) * count), ("option", "unit", *names))
    rows = [(m.name, m.scale.unit, *m.shown, *m.differences, m.note) for m in metrics]
    side_by_side = TextTable(rows, ("name", "unit", *("value",) * (2 * count - 1), "note"), _heads(runs))
    bars = Figures(lambda: (bars_figure([metric for metric in metrics if metric.key], names),))
    repeat = shlex.join(["palpate", "compare", *(str(run.place) for run in runs), "--out", str(out)])
    return Report(
        title=f"{', '.join(names[:-1])} and {names[-1]}, side by side",
        asked=f"to compare {count} runs of `palpate {runs[0].logged.experiment.name}` with the first, {names[0]}",
        outcome=_outcome(runs, metrics, len(options)),
        metrics=(),
        sections=(
            Section("Options that differ", (table if options else differing,)),
            Section("Metrics side by side", (side_by_side, bars)),
            Section("The surfaces", (Figures(lambda: _surface_figures(runs, names)),)),
            Section("Over time", (Figures(lambda: _time_figures(runs, names)),)),
        ),
        advice=(_advice(len(options)),),
        repeat=(("The same again:", repeat),),
        settings=(
            *(
                (name, f"{option_words(values[0])} {_option_unit(runs, name, values)}".rstrip())
                for name, values in compared_options(runs, differing=False)
            ),
            *((f"log of {run.name}", str(run.logged.log.path)) for run in runs),
        ),
        footer="Metrics and figures are computed anew from the runs' logs, the same way for each.",
    )


def _heads(runs: Sequence[ComparedRun]) -> tuple[str, ...]:
    """Return the heads of a table of metrics side by side."""
    names = [run.name for run in runs]
    return ("metric", "unit", *names, *(f"{name} less {names[0]}" for name in names[1:]), "remark")


def _outcome(runs: Sequence[ComparedRun], metrics: Sequence[ComparedMetric], changed: int) -> str:
    sentences = [f"{changed} option{' differs' if changed == 1 else 's differ'}."]
    first = next((metric for metric in metrics if len(metric.numbers) == len(runs)), None)
    if first is not None:
        each = ", ".join(f"{shown} in {run.name}" for shown, run in zip(first.shown, runs, strict=True))
        unit = f" [{first.scale.unit}]" if first.unit else ""
        sentences.append(f"{first.name[:1].upper()}{first.name[1:]}{unit}: {each}.")
    return " ".join(sentences)


def _advice(changed: int) -> str:
    if changed == 0:
        return "All options are the same: differences are chance, or another version (palpate log info)."
    if changed == 1:
        return "One option differs: to separate its effect from chance, repeat with other seeds (palpate sweep)."
    return f"{changed} options differ: to see the effect of each, change one at a time (palpate sweep)."


def _surface_figures(runs: Sequence[ComparedRun], names: Sequence[str]) -> Iterator[FigureSource]:
    samples = [run.errors for run in runs]
    for i in range(max(map(len, samples))):
        yield partial(spread_figure, [each[i] if i < len(each) else None for each in samples], names)
    yield partial(difference_figure, [run.map for run in runs], names)


def _time_figures(runs: Sequence[ComparedRun], names: Sequence[str]) -> Iterator[FigureSource]:
    mean = ", the mean over the fingers" if len(runs[0].records) > 1 else ""
    with_set = any(np.isfinite(run.set_force).any() for run in runs)
    dashes = " Dashed: the set force of each run; the nearer a line to its dashes the better." if with_set else ""
    felt = [_line(run.time, np.where(run.felt > 0.0, run.felt, np.nan), i, names) for i, run in enumerate(runs)]
    set_forces = [
        _line(run.time, run.set_force, i, names, ", set", (Dash.DASHED,), 1.5, 1.0)
        for i, run in enumerate(runs)
        if np.isfinite(run.set_force).any()
    ]
    yield partial(
        _over_time,
        "Normal force over time",
        f"Measured normal force{mean}, from the beginning of each run on.{dashes}",
        Axis("normal force", "N"),
        [*felt, *set_forces],
    )
    yield partial(
        _over_time,
        "Grip over time",
        "Commanded grip, the mean over the fingers. A lower grip is gentler, as long as the object neither slips "
        "nor spins; the table shows how each run ended.",
        Axis("commanded grip", "N"),
        [_line(run.time, run.commanded_grip, i, names) for i, run in enumerate(runs)],
    )


def _over_time(title: str, caption: str, y: Axis, lines: Sequence[Line]) -> Figure | None:
    if not any(np.isfinite(line.y).any() for line in lines):
        return None
    return Figure(title, caption, (Panel(tuple(lines), TIME, y),), wide=True)


def _line(
    x: FloatArray,
    y: FloatArray,
    run: int,
    names: Sequence[str],
    ending: str = "",
    dashes: Sequence[Dash] = (Dash.SOLID, Dash.DOTTED, Dash.DASH_DOT),
    width: float = 1.2,
    opacity: float = 0.8,
) -> Line:
    colour, dash, _, thicker = look_of(run, dashes=dashes)
    name = f"{shortened(names[run], LEGEND_LETTERS)}{ending}"
    return Line(x, y, name, colour, width=width * thicker, dash=dash, opacity=opacity)


def bars_figure(metrics: Sequence[ComparedMetric], names: Sequence[str]) -> Figure | None:
    """Return the metrics in which the runs differ as bars; None if there are none."""
    panels = tuple(_bars(metric, names) for metric in metrics if _differs(metric))
    if not panels:
        return None
    return Figure(
        title="Metrics as bars",
        caption=f"Metrics of which two runs differ by more than {100.0 * BAR_DIFFERENCE:g} %; the table has all.",
        panels=panels,
        columns=min(BAR_COLUMNS, len(panels)),
        wide=True,
    )


def _differs(metric: ComparedMetric) -> bool:
    known = metric.numbers
    return len(known) > 1 and max(known) - min(known) > BAR_DIFFERENCE * max(map(abs, known))


def _bars(metric: ComparedMetric, names: Sequence[str]) -> Panel:
    """Return the panel of one metric, the first run on top."""
    places, factor = np.arange(len(names))[::-1].astype(np.float64), metric.scale.factor
    ticks = tuple((float(at), shortened(name, TICK_LETTERS)) for at, name in zip(places, names, strict=True))
    bars = tuple(
        Bars(np.array([at]), np.array([factor * value]), np.array([BAR_THICKNESS]), "", look_of(run)[0], True)
        for run, (at, value) in enumerate(zip(places, metric.values, strict=True))
        if not isinstance(value, str) and math.isfinite(value)
    )
    y = Axis(low=-0.6, high=len(names) - 0.4, ticks=ticks)
    return Panel(bars, Axis(metric.name, metric.scale.unit), y, height=76 + 24 * len(names))


def spread_figure(samples: Sequence[ErrorSample | None], names: Sequence[str]) -> Figure | None:
    """Return the distribution of each run's errors; None if no run has any."""
    known = [(run, each) for run, each in enumerate(samples) if each is not None and len(each.values)]
    if not known:
        return None
    together = np.concatenate([each.values for _, each in known])
    low, high = np.percentile(together, [100.0 - SPREAD_PERCENT, SPREAD_PERCENT]).tolist()
    room = max(0.05 * (high - low), 1e-9)
    bins = np.linspace(low - room, high + room, SPREAD_BINS + 1)
    lines = []
    for run, each in known:
        count, _ = np.histogram(np.clip(each.values, bins[0], bins[-1]), bins)
        steps = np.concatenate([[0.0], np.repeat(100.0 * count / len(each.values), 2), [0.0]])
        lines.append(_line(np.repeat(bins, 2), steps, run, names, width=1.5, opacity=1.0))
    first = known[0][1]
    panel = Panel((Rule(0.0), *lines), Axis(first.quantity, first.unit), Axis("share of the points", "%", low=0.0))
    return Figure(first.title, first.caption, (panel,))


@dataclass(frozen=True, slots=True, eq=False)
class MapDifference:
    """Another map less the first one, at the vertices of the first.

    Attributes:
        height: Difference along the normal, positive where the other map lies further out; NaN where not both maps
            claim the surface, shape (n,) [m].
        band: Sum of the half-widths of both 95 % bands, shape (n,) [m].
    """

    height: FloatArray
    band: FloatArray

    @classmethod
    def of(cls, first: FeltMap, other: FeltMap) -> "MapDifference":
        """Return the difference; the other map is evaluated exactly, not interpolated between its vertices."""
        there = other.surface.query(first.mesh.vertices)
        both = there.observed & (first.mesh.knowledge == Knowledge.OBSERVED)
        return cls(np.where(both, -there.distance, np.nan), first.mesh.band() + there.band())

    @property
    def common(self) -> FloatArray:
        """Heights that are known, shape (k,) [m]."""
        return self.height[np.isfinite(self.height)]

    @property
    def words(self) -> str:
        """Size of the difference, and the share of the common surface on which both bands allow it."""
        rms = MICRO * float(np.sqrt(np.mean(self.common**2)))
        within = 100.0 * float(np.mean(np.abs(self.height) <= self.band, where=np.isfinite(self.height)))
        return f"{rms:.3g} µm RMS, {within:.0f} % within both bands"


def difference_figure(maps: Sequence[FeltMap | None], names: Sequence[str]) -> Figure | None:
    """Return every later map less the first one; None where no two maps cover the same region."""
    first = maps[0]
    if first is None:
        return None
    others = zip(names[1:], maps[1:], strict=True)
    each = [(name, MapDifference.of(first, other)) for name, other in others if other is not None]
    found = [(name, one) for name, one in each if len(one.common) > MIN_COMMON_SHARE * len(one.height)]
    if not found:
        return None
    sizes = "; ".join(f"{name}: {one.words}" for name, one in found)
    return Figure(
        title="Difference of the maps",
        caption=f"The map of {names[0]}, coloured by how much further out the other one lies; grey where not both "
        f"know the surface. {sizes}. Where it is more than both 95 % bands together, one of the maps is wrong.",
        panels=tuple(
            Space((_coloured(first, one),), title=f"{name} less {names[0]}", height=400) for name, one in found
        ),
        columns=min(2, len(found)),
        wide=len(found) > 1,
    )


def _coloured(first: FeltMap, found: MapDifference) -> Surface:
    largest = float(np.percentile(np.abs(found.common), COLOURED_PERCENT))
    span = MICRO * max(largest, MIN_COLOURED_BANDS * float(np.nanmedian(found.band)))
    height = Colouring("difference", MICRO * found.height, "µm", -span, span, ColourScale.ERROR)
    share = Colouring("difference over both bands", np.abs(found.height) / found.band, low=0.0, high=2.0)
    return Surface(first.mesh.vertices, first.mesh.triangles, colourings=(height, share))
