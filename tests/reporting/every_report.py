"""A report of every kind, small, with the same text wherever people type one."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import trimesh
from palpate.commands.compare.report_data import ComparedFigure, ComparisonReport, Curve, Overlay, Spreads
from palpate.commands.compare.report_page import comparison_html
from palpate.commands.replay.report_data import ReplayReport
from palpate.commands.replay.report_page import replay_html
from palpate.commands.sweep.typed_values import Varied

from palpate import LimitSurface
from palpate.commands.compare.config import CompareConfig
from palpate.commands.compare.report import comparison_html as mesh_comparison_html
from palpate.commands.sweep.record import RunRecord, RunStatus
from palpate.commands.sweep.report import sweep_report
from palpate.commands.sweep.result import SweepResult
from palpate.experiments.explore.report import exploration_report
from palpate.experiments.friction.confusion_picture import confusion_picture
from palpate.experiments.friction.measured import Measured, table_rows
from palpate.experiments.friction.pictures import length_picture, speed_picture, stroke_picture, surface_picture
from palpate.experiments.friction.stroke_curves import StrokeCurve
from palpate.experiments.grasp.pictures import grip_picture, load_pictures, slip_picture
from palpate.experiments.regulate.pictures import bode_picture, error_picture, step_picture
from palpate.experiments.regulate.response import FrequencyResponse, StepResponse
from palpate.friction.materials.trials import UNKNOWN, Confusion
from palpate.mapping.compare import compare
from palpate.mapping.compare_files import read_map, read_reference
from palpate.reporting.computing import computing
from palpate.reporting.data import KeyFigure
from palpate.reporting.force_picture import force_overview
from palpate.reporting.grasp_force_picture import grasp_force_picture
from palpate.reporting.page import report_page
from palpate.reporting.report import FigureTable, Paragraph, Pictures, Report, Section, TextTable
from reporting.test_friction_pictures import ASSUMED, LEVEL
from reporting.test_grasp_force_picture import FORCES, LOAD, PAIR
from reporting.test_replay_report import side
from reporting.test_report import series_of, timing_of
from support.explore_runs import small
from support.sweep_runs import planned

KINDS = ("explore", "regulate", "friction", "grasp", "replay", "runs", "mesh", "sweep")
TIMING = timing_of(np.full(600, 1e-4), 2e-3)


def html_of(kind, typed, folder):
    """Return a report of a kind, `typed` wherever a text can come from people; `folder` is for files."""
    return {
        "explore": _explore,
        "regulate": _regulate,
        "friction": _friction,
        "grasp": _grasp,
        "replay": _replay,
        "runs": _runs,
        "sweep": _sweep,
        "mesh": lambda told: _mesh(told, folder),
    }[kind](typed)


def said(typed):
    """What all of them say, in the fields of every report."""
    return {
        "title": typed,
        "outcome": typed,
        "summary": (KeyFigure(typed, typed, typed, typed), KeyFigure("force", 2.0, "N", typed), KeyFigure("n", 3)),
        "settings": ((typed, typed),),
        "asked": typed,
        "advice": (typed,),
        "repeat": ((typed, typed),),
    }


def _explore(typed):
    told = said(typed)
    return report_page(replace(exploration_report(small()), figures=told.pop("summary"), **told))


def _regulate(typed):
    told = said(typed)
    time = np.linspace(0.0, 0.2, 50)
    steps = StepResponse(time, 1 - np.exp(-60 * time), np.ones((2, 50)))
    tones = FrequencyResponse(np.array([1.0, 4.0]), np.array([1.0 - 0.05j, 0.4 - 0.45j]))
    series = series_of(("approach", "hold", "lift"))
    pictures = (
        force_overview(series),
        error_picture(series),
        step_picture(steps, steps),
        bode_picture({"true": tones}),
    )
    sections = (
        Section(
            typed, (Pictures(lambda: pictures), TextTable(((typed, "0.6", "times", typed),)), Paragraph(typed))
        ),
        Section("Margins", (FigureTable((KeyFigure("gain margin", 3.1, "", typed),)),)),
        computing(TIMING),
    )
    return report_page(Report(figures=told.pop("summary"), sections=sections, footer=typed, **told))


def _friction(typed):
    stroke = StrokeCurve(2.0, False, np.linspace(0.0, 4e-3, 50), np.full(50, 0.5))
    confusion = Confusion((typed, "b"), (typed, UNKNOWN), np.array([[3, 1], [0, 4]]))
    speeds = (Measured(0.01, 0.5, 0.4, 0.6, 0.5), Measured(0.02, 0.5, 0.45, 0.6, 0.5, why=typed))

    def draw():
        yield stroke_picture((stroke,), LEVEL)
        yield surface_picture(ASSUMED)
        yield length_picture(LEVEL, (0.003, 0.2))
        yield speed_picture(speeds, None)
        yield confusion_picture(confusion)

    told = said(typed)
    parts = (Paragraph(typed), TextTable(table_rows(speeds, typed, "mm/s", 1e3)), Pictures(draw))
    return report_page(Report(figures=told.pop("summary"), sections=(Section(typed, parts),), **told))


def _grasp(typed):
    count, time = 400, np.arange(400) * 1e-2
    loads = np.stack([np.full((count, 2), 4.0), np.full((count, 2), 1.0), np.full((count, 2), 2e-3)], axis=2)
    still, held = np.zeros((count, 2)), np.ones(count, dtype=bool)
    truth = SimpleNamespace(
        time=time, stage=np.full(count, 3), target=np.full(count, 4.0), slid=still, turned=still, loads=loads,
        fingers=2,
    )  # fmt: skip
    grasp = SimpleNamespace(
        truth=truth, felt=np.full(count, 4.1), least=np.full(count, 3.5), counted=held, aloft=held,
        slipping=np.zeros((count, 2), dtype=bool), alarms_aloft=(SimpleNamespace(time=1.0),),
        planned=SimpleNamespace(true=LimitSurface(0.5, 0.004)),
    )  # fmt: skip

    def draw():
        yield grip_picture(grasp, typed)
        yield slip_picture(grasp, typed)
        yield from load_pictures(grasp, typed)
        yield grasp_force_picture(PAIR, FORCES, LOAD)

    told = said(typed)
    compared = KeyFigure(f"slip, {typed}", 9.0, "mm", typed)
    parts = (Paragraph(typed), FigureTable((compared,)), Pictures(draw))
    return report_page(Report(figures=told.pop("summary"), sections=(Section(typed, parts),), **told))


def _replay(typed):
    return replay_html(ReplayReport(recorded=side(), replayed=side(1.1, 2.01), **said(typed)))


def _runs(typed):
    time = np.linspace(0.0, 3.0, 200)
    lines = (Curve(0, time, np.sin(time)), Curve(1, time, np.cos(time)), Curve(1, time, np.ones(200), asked=True))
    told = said(typed)
    del told["summary"]
    report = ComparisonReport(
        names=(typed, "other"),
        differences=((typed, "N", typed, typed),),
        figures=(ComparedFigure("force", "N", (1.0, 2.0), typed), ComparedFigure(typed, "", (typed, typed))),
        overlays=(Overlay("Force over time", "Force of each run; even is good.", "time [s]", "force [N]", lines),),
        spreads=(Spreads("Errors", "Errors of each run; narrow is good.", "error [µm]", (time, -time)),),
        **told,
    )
    return comparison_html(report)


def _mesh(typed, folder):
    ball = trimesh.creation.icosphere(subdivisions=2, radius=0.02)
    ball.export(folder / "ball.stl")
    name = "".join(letter for letter in typed if letter not in "/\0")[:40].strip() or "x"
    config = CompareConfig(folder / name, folder / "ball.stl")
    reference = read_reference(folder / "ball.stl", 1.0)
    found = compare(read_map(folder / "ball.stl", 1.0, 500), reference, within=1e-3, samples=500)
    return mesh_comparison_html(found, reference, config)


def _sweep(typed):
    plan = planned("force=1,2", seeds=2)
    pairs = zip(plan.combinations, ("usual", typed), strict=True)
    combinations = tuple(replace(each, values=(value,)) for each, value in pairs)
    plan = replace(
        plan,
        asked=replace(plan.asked, vary=((f"robot=usual,{typed}",),)),
        varied=(Varied("robot", ("usual", typed)),),
        combinations=combinations,
        runs=tuple(replace(run, combination=combinations[run.number // 2]) for run in plan.runs),
    )
    records = tuple(
        RunRecord(
            run=run.number, digest=run.case.digest, seed=run.number % 2, duration=0.5, host=typed, message=typed,
            status=RunStatus.FAILED if run.number == 3 else RunStatus.DONE, versions={"numpy": typed},
            figures={"force_mean_n": 1e-3 * (1 + run.number), "held": run.number > 1},
        )
        for run in plan.runs
    )  # fmt: skip
    return report_page(sweep_report(SweepResult(plan, records, plan.experiment.figures[:2])))
