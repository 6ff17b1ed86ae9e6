"""The report on a sweep: one HTML file."""

import shlex
from collections.abc import Sequence
from dataclasses import fields, replace

import numpy as np

from palpate.commands.sweep.config import SweepConfig
from palpate.commands.sweep.figure import figures
from palpate.commands.sweep.plan import NAME_DIGITS, NOT_IDENTIFYING, Combination, SweepPlan
from palpate.commands.sweep.result import FEWEST_SEEDS, HIGH, LOW, SweepResult, numbers_of, spread_of, time_text
from palpate.commands.sweep.store import RunRecord, RunStatus
from palpate.commands.typed_values import shown_value
from palpate.experiments.kit.metric import is_share
from palpate.experiments.kit.options import NOISY, specs_of
from palpate.experiments.kit.run_report import command_line
from palpate.reporting.data import Quantity
from palpate.reporting.report import Figures, Report, Section, TextTable
from palpate.reporting.units import scale_of

MOST_ROWS = 60
"""Largest number of rows of a table; runs.csv has the rest."""


def sweep_report(result: SweepResult) -> Report:
    """Return the report."""
    plan = result.plan
    failures = TextTable(failure_rows(result), ("name", "value", "note"), ("run", "how it went", "why"))
    return Report(
        plan.title,
        result.outcome,
        quantities(result),
        (
            Section("Metrics over the options", (Figures(lambda: figures(result)),)),
            *(_in_metrics(result, i) for i in range(len(result.metrics))),
            Section("Runs that did not get to their end", (failures,)),
        ),
        asked=f"palpate {plan.config.experiment}, {plan.size}",
        advice=advice(result),
        settings=setting_rows(result),
        repeat=repeat_commands(plan),
        footer="Every run is a row of runs.csv, in SI units.",
        reached=not result.failures,
    )


SPREAD_TEXT = f"{LOW:g} to {HIGH:g} % of the runs"
"""Meaning of the interval beside the median of at least `FEWEST_SEEDS` runs."""


def quantities(result: SweepResult) -> tuple[Quantity, ...]:
    """Return the number, outcomes and cost of the runs."""
    metrics = [_runs("requested", len(result.records), result.plan.size.partition(": ")[2])]
    metrics += [
        _runs(_STATUS_WORDS[status], result.counted(status))
        for status in RunStatus
        if status is RunStatus.DONE or result.counted(status)
    ]
    durations = numbers_of([record.duration for record in result.records])
    if durations.size:
        metrics.append(_time("computing time of a run", float(np.median(durations)), "median"))
        metrics.append(_time("of all runs together", float(durations.sum()), _hosts(result)))
    return tuple(metrics)


def combination_rows(result: SweepResult, index: int) -> list[tuple[str, str, str, str]]:
    """Return a metric of each combination as rows: name, value, unit, note."""
    metric, plan = result.metrics[index], result.plan
    values = numbers_of(result.values(metric, plan.combinations))
    scale = scale_of(metric.unit, float(np.abs(values).max()) if values.size else 0.0)
    rows = []
    for combination, found in zip(plan.combinations, result.by_combination(metric), strict=True):
        spread = spread_of(found).scaled(scale.factor)
        name = plan.name_of(combination) or "all runs"
        value = f"{spread.middle:.4g}" if spread.count else "-"
        note = ""
        if spread.low < spread.high:
            each = ", ".join(f"{scale.factor * number:.4g}" for number in numbers_of(found))
            note = each if spread.count < FEWEST_SEEDS else f"{spread.low:.4g} to {spread.high:.4g}"
        rows.append((name, value, scale.unit if spread.count else "", _with_count(result, combination, note)))
    return rows


def _in_metrics(result: SweepResult, index: int) -> Section:
    """Return the table of a metric."""
    metric, plan = result.metrics[index], result.plan
    share = is_share(result.values(metric, plan.combinations))
    beside = SPREAD_TEXT if len(plan.seeds) >= FEWEST_SEEDS else "each run"
    heads = ("combination", "share", "", "") if share else ("combination", "median", "", beside)
    rows = _shortened(combination_rows(result, index), ("", "", "in runs.csv"))
    heading = metric.meaning[:1].upper() + metric.meaning[1:] + (", by combination" if plan.varied else "")
    return Section(heading, (TextTable(rows, heads=heads),))


def failure_rows(result: SweepResult) -> Sequence[tuple[str, ...]]:
    """Return the runs that did not reach their end: name, outcome, reason."""
    rows = [(run_name(result, record), record.status.value, record.message) for record in result.failures]
    return _shortened(rows, ("", "in runs.csv"))


def run_name(result: SweepResult, record: RunRecord) -> str:
    """Return the name of a run."""
    name = result.plan.name_of(result.plan.runs[record.run].combination)
    return f"run {record.run}: " + (f"{name}, " if name else "") + f"seed={record.seed}"


def advice(result: SweepResult) -> tuple[str, ...]:
    """Return advice on the next step."""
    sentences = []
    if result.failures:
        sentences.append(
            "Some runs did not get to their end: remove the causes that the table names, and repeat "
            "them by the same command with --repeat-failed."
        )
    if result.seeds_alike:
        specs = specs_of(result.plan.experiment.Config)
        noises = [name for name, spec in specs.items() if spec.fixed == NOISY and name.endswith("_noise")]
        unless = f", unless the sensor has noise (--set {noises[0]}=0.01)" if noises else ""
        sentences.append(f"One seed of each is enough{unless}.")
    elif len(result.plan.seeds) < FEWEST_SEEDS and len(result.records) > 1:
        sentences.append(
            f"With fewer than {FEWEST_SEEDS} runs of each combination, the effect of the options cannot be "
            f"separated from chance: --seeds {FEWEST_SEEDS} into another folder (--out) shows both."
        )
    return tuple(sentences)


def repeat_commands(plan: SweepPlan) -> tuple[tuple[str, str], ...]:
    """Return the commands that repeat the sweep, each with its purpose."""
    alone = replace(plan.combinations[0].config, out=plan.experiment.Config().out)
    return (
        ("The same again; in the same folder it goes on with what is left:", typed_command(plan.config)),
        ("Its first run alone, with a report and a log of its own:", command_line(plan.config.experiment, alone)),
    )


def typed_command(config: SweepConfig) -> str:
    """Return the command of the same sweep; the number of processes changes no metric, and is left out."""
    words = ["palpate", "sweep", config.experiment]
    for option, several in (("--vary", config.vary), ("--set", config.set)):
        for each in several:
            words += [option, *each]
    words += ["--seeds", str(config.seeds)] if config.seeds > 1 else []
    for option, value in (("--config", config.config), ("--ray", config.ray), ("--out", config.out)):
        words += [option, str(value)] if value is not None else []
    words += ["--keep-reports"] if config.keep_reports else []
    words += ["--show", *config.show] if config.show else []
    return shlex.join(words)


def setting_rows(result: SweepResult) -> tuple[tuple[str, str], ...]:
    """Return the settings: name, value."""
    plan = result.plan
    seeds = f"{plan.seeds.start}" + (f" to {plan.seeds[-1]}" if len(plan.seeds) > 1 else "")
    rows = [("experiment", plan.config.experiment)]
    for each in plan.varied:
        values = ", ".join(shown_value(value, NAME_DIGITS) for value in each.values)
        rows.append((f"{each.name}, varied", f"{values} {plan.unit(each.name)}".rstrip()))
    for name, value in shared_options(plan).items():
        rows.append((name, f"{shown_value(value)} {plan.unit(name)}".rstrip()))
    rows.append(("seeds of each combination", seeds))
    versions = next((record.versions for record in result.records if record.versions), {})
    if versions:
        rows.append(("versions", ", ".join(f"{name} {version}" for name, version in versions.items())))
    return tuple(rows)


def shared_options(plan: SweepPlan) -> dict[str, object]:
    """Return the options that all runs share, typed or not as they are by default: by a file, or by the robot."""
    usual, (first, *others) = plan.experiment.Config(), [each.config for each in plan.combinations]
    varied = {each.name for each in plan.varied}
    shared = {}
    for name in (field.name for field in fields(plan.experiment.Config)):
        value = getattr(first, name)
        if name in varied or name in NOT_IDENTIFYING or any(getattr(other, name) != value for other in others):
            continue
        if name in plan.fixed or value != getattr(usual, name):
            shared[name] = value
    return shared


_STATUS_WORDS = {
    RunStatus.DONE: "got to their end",
    RunStatus.UNFINISHED: "stopped before",
    RunStatus.FAILED: "failed",
    RunStatus.DIED: "processes died",
}


def _shortened(rows: Sequence[tuple[str, ...]], rest: tuple[str, ...]) -> Sequence[tuple[str, ...]]:
    more = len(rows) - MOST_ROWS
    return rows if more <= 0 else [*rows[:MOST_ROWS], (f"and {more} more", *rest)]


def _runs(name: str, count: int, note: str = "") -> Quantity:
    return Quantity(name, count, "run" if count == 1 else "runs", note)


def _time(name: str, seconds: float, note: str) -> Quantity:
    value, unit = time_text(seconds).rsplit(" ", 1)
    return Quantity(name, value, unit, note)


def _with_count(result: SweepResult, combination: Combination, note: str) -> str:
    done, count = result.done_of(combination), len(result.plan.seeds)
    if done == count:
        return note
    return f"{note}; {done} of {count} runs" if note else f"{done} of {count} runs"


def _hosts(result: SweepResult) -> str:
    hosts = dict.fromkeys(record.host for record in result.records if record.host)
    return f"on {len(hosts)} computers" if len(hosts) > 1 else ""
