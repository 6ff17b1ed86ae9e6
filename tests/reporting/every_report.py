"""A report of every kind, of runs as small as they come, with the same text wherever people type one."""

from dataclasses import replace
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import trimesh

from palpate.commands.compare.config import CompareConfig
from palpate.commands.compare.maps import map_comparison_report
from palpate.commands.compare.runs import comparison_report, read_runs
from palpate.commands.replay.report import replay_report
from palpate.commands.replay.run import replay_log
from palpate.commands.sweep.report import sweep_report
from palpate.commands.sweep.result import SweepResult
from palpate.commands.sweep.store import RunRecord, RunStatus
from palpate.commands.typed_values import Varied
from palpate.experiments.kit.registry import experiment_named
from palpate.experiments.kit.script import perform
from palpate.mapping.compare import compare
from palpate.mapping.compare_files import read_map, read_reference
from palpate.reporting.data import Quantity
from palpate.reporting.page import report_page
from palpate.reporting.report import Paragraph, QuantityTable, Section, TextTable
from support.made_up_touches import touches_file
from support.sweep_runs import planned
from support.tiny_experiment import TINY

SMALL = {
    "explore": {"width": 0.006, "depth": 0.004, "speed": 0.04, "force_swing": 0.5},
    "regulate": {"profile": "step", "duration": 2.0},
    "friction": {"robot": "turning-stage", "quick": True},
    "grasp": {"load": "none", "rise": 0.1, "lift_height": 0.01, "against_ignoring_spin": True},
    "calibrate.tip": {"touches": touches_file},
}
"""Options of a run of each experiment; that of touches takes a file of them."""

KINDS = (*SMALL, "replay", "runs", "mesh", "sweep")


def html_of(kind, typed, folder):
    """Return a report of a kind, `typed` wherever a text can come from people; `folder` is for files."""
    of = {"replay": _replay, "runs": _runs, "mesh": _mesh, "sweep": _sweep}
    report = experiment_report(kind) if kind in SMALL else of[kind](typed, folder)
    metrics = (Quantity(typed, typed, typed, typed), Quantity("force", 2.0, "N", typed), Quantity("n", 3))
    heads = (typed, "", "value", "")
    rows = TextTable(((typed, typed, "0.6", typed),), ("name", "note", "value", "unit"), heads)
    said = Section(typed, (Paragraph(typed), QuantityTable(metrics), rows))
    told = dict.fromkeys(("title", "outcome", "asked", "footer"), typed)
    more = {"advice": (typed,), "repeat": ((typed, typed),), "settings": (*report.settings, (typed, typed))}
    sections = (said, *report.sections)
    return report_page(replace(report, **told, **more, metrics=(*report.metrics, *metrics), sections=sections))


@cache
def experiment_report(name):
    """The report of a run of an experiment."""
    experiment = experiment_named(name)
    with TemporaryDirectory() as folder:
        made = {key: value(Path(folder)) if callable(value) else value for key, value in SMALL[name].items()}
        return experiment.report(perform(experiment, experiment.Config(**made)))


@cache
def _tapped():
    """Two recorded runs of the smallest experiment, their logs read."""
    experiment = experiment_named(TINY)
    with TemporaryDirectory() as folder:
        places = [Path(folder, name) for name in ("soft", "firm")]
        for place, force in zip(places, (1.0, 2.0), strict=True):
            place.mkdir()
            perform(experiment, experiment.Config(force=force), place)
        return read_runs(places)


def _runs(typed, folder):
    first, second = _tapped()
    return comparison_report((replace(first, name=typed), second), folder)


def _replay(typed, folder):
    return replay_report(replay_log(_tapped()[0].logged.log, {"force": 3.0}), typed)


def _mesh(typed, folder):
    ball = trimesh.creation.icosphere(subdivisions=2, radius=0.02)
    ball.export(folder / "ball.stl")
    name = "".join(letter for letter in typed if letter not in "/\0")[:40].strip() or "x"
    config = CompareConfig(folder / name, folder / "ball.stl")
    reference = read_reference(folder / "ball.stl", 1.0)
    found = compare(read_map(folder / "ball.stl", 1.0, 500), reference, within=1e-3, samples=500)
    return map_comparison_report(found, reference, config)


def _sweep(typed, folder):
    plan = planned("force=1,2", seeds=2)
    pairs = zip(plan.combinations, ("usual", typed), strict=True)
    combinations = tuple(replace(each, values=(value,)) for each, value in pairs)
    plan = replace(
        plan,
        config=replace(plan.config, vary=((f"robot=usual,{typed}",),)),
        varied=(Varied("robot", ("usual", typed)),),
        combinations=combinations,
        runs=tuple(replace(run, combination=combinations[run.number // 2]) for run in plan.runs),
    )
    metrics = plan.experiment.metrics[:2]
    records = tuple(
        RunRecord(
            run=run.number, digest=run.case.digest, seed=run.number % 2, duration=0.5, host=typed, message=typed,
            status=RunStatus.FAILED if run.number == 3 else RunStatus.DONE, versions={"numpy": typed},
            metrics={each.key: 1e-3 * (1 + run.number) for each in metrics},
        )
        for run in plan.runs
    )  # fmt: skip
    return sweep_report(SweepResult(plan, records, metrics))
