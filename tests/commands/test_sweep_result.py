"""What a sweep tells of its runs: nothing lost, nothing scaled wrong, nothing typed that becomes markup."""

import ast
import csv
import inspect
import itertools
import math
import re
import shlex
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from msgspec import structs

from palpate.commands.sweep.figure import figures, summary_figure, write_summary
from palpate.commands.sweep.report import (
    advice,
    combination_rows,
    failure_rows,
    repeat_commands,
    sweep_report,
)
from palpate.commands.sweep.result import SweepResult, checked_columns, shown_metrics, spread_of, time_text
from palpate.commands.sweep.store import RunRecord, RunStatus, columns_of, rows_of, write_csv, write_parquet
from palpate.errors import InvalidValueError
from palpate.experiments.kit.options import specs_of
from palpate.experiments.kit.registry import experiment_named, experiment_names
from palpate.reporting.marks import Band, Dash, Line, Points
from palpate.reporting.page import report_page
from palpate.reporting.plots import plots
from palpate.reporting.units import UNITS, scale_of
from support.drawn import marks as marks_of
from support.drawn import panels
from support.sweep_runs import SHORT, planned
from support.tiny_experiment import TINY

FIGURES = experiment_named(TINY).metrics
FORCE = FIGURES[0]
numbers = st.floats(-1e6, 1e6, allow_subnormal=False)


def made(*vary, value=lambda run: 1e-3 * (1 + run.number), status=lambda number: RunStatus.DONE, **more):
    """A sweep whose runs came to these values."""
    plan = planned(*vary, **more)
    records = [
        RunRecord(
            run=run.number,
            digest=run.case.digest,
            seed=run.case.seed,
            status=status(run.number),
            message="" if status(run.number) is RunStatus.DONE else "<b>it & fell</b>",
            duration=0.5,
            metrics={"force_mean_n": value(run)} if status(run.number) is not RunStatus.FAILED else {},
            versions={"numpy": "2.0"},
        )
        for run in plan.runs
    ]
    return SweepResult(plan, tuple(records), (FORCE,))


def html(result):
    return report_page(sweep_report(result))


# --- spreads


@given(st.lists(numbers, min_size=1, max_size=30), st.randoms(use_true_random=False), st.floats(0.01, 100.0))
def test_a_spread_does_not_depend_on_the_order_and_scales_with_the_unit(values, random, factor):
    shuffled = values.copy()
    random.shuffle(shuffled)
    spread = spread_of(values)
    assert spread_of([*shuffled, None, "word"]) == spread
    assert min(values) <= spread.low <= spread.middle <= spread.high <= max(values)
    scaled = spread_of([factor * value for value in values])
    size = factor * max(map(abs, values))
    assert scaled.middle == pytest.approx(factor * spread.middle, abs=1e-12 * size + 1e-300)
    assert scaled.high == pytest.approx(factor * spread.high, abs=1e-12 * size + 1e-300)


@given(st.sampled_from(["m", "m/s", "N", "s", "rad", "N m", "N/m", "Hz", ""]), st.floats(1e-12, 1e6))
def test_a_scale_changes_the_unit_by_what_it_multiplies(unit, largest):
    prefixes = {"": 1.0, "k": 1e3, "m": 1e-3, "µ": 1e-6, "n": 1e-9}
    scale = scale_of(unit, largest)
    assert scale.unit.endswith(unit)
    assert scale.factor * prefixes[scale.unit.removesuffix(unit)] == pytest.approx(1.0)


# --- tables


def test_tables_hold_every_run_and_floats_read_back_to_the_same_bits(tmp_path):
    rng = np.random.default_rng(3)
    values = rng.lognormal(sigma=20.0, size=12).tolist()
    result = made("force=1,2", "robot=stage,turning-stage", seeds=3, value=lambda run: values[run.number])
    columns, rows = columns_of(result.plan), rows_of(result.plan, result.records)
    write_csv(rows, columns, tmp_path / "runs.csv")
    with (tmp_path / "runs.csv").open(newline="") as file:
        back = list(csv.DictReader(file))
    assert [float(row["force_mean_n"]) for row in back] == values
    assert [(float(r["force"]), r["robot"], int(r["seed"])) for r in back] == [
        (force, robot, seed) for force in (1.0, 2.0) for robot in ("stage", "turning-stage") for seed in range(3)
    ]
    assert {row["true_mean_n"] for row in back} == {""}
    parquet = pytest.importorskip("pyarrow.parquet")
    assert write_parquet(rows, columns, tmp_path / "runs.parquet")
    table = parquet.read_table(tmp_path / "runs.parquet")
    assert table.column_names == list(columns)
    assert table["force_mean_n"].to_pylist() == values
    assert table["run"].to_pylist() == list(range(12))


@pytest.mark.parametrize("name", [TINY, *experiment_names()])
def test_no_column_has_the_name_of_another(name):
    """Whatever is varied."""
    fixed = columns_of(planned(experiment=name, fixed=()))
    options = specs_of(experiment_named(name).Config).keys() - {"seed", "out"}
    assert len(set(fixed)) == len(fixed)
    assert not options & set(fixed)


# --- units


@pytest.mark.parametrize("name", experiment_names())
def test_a_figures_column_ends_in_its_unit(name):
    for metric in experiment_named(name).metrics:
        if metric.unit:
            assert metric.key.endswith(f"_{UNITS[metric.unit][0]}")
        else:
            assert not metric.key.endswith(("_m", "_n", "_s", "_hz", "_rad"))
        assert len(metric.meaning) <= 36, "it stands beside an axis"


@pytest.mark.parametrize("name", experiment_names())
def test_options_have_the_unit_that_their_help_says(name):
    """The sentences behind the fields, which people see in --help, against the units in tables and pictures."""
    kind = experiment_named(name).Config
    told = {}
    for each in reversed(kind.__mro__[:-1]):  # shared options stand in base classes
        (body,) = (node.body for node in ast.parse(inspect.getsource(each)).body if isinstance(node, ast.ClassDef))
        for line, words in itertools.pairwise(body):
            if not (isinstance(line, ast.AnnAssign) and isinstance(words, ast.Expr)):
                continue
            if "float" in ast.unparse(line.annotation):
                told[ast.unparse(line.target)] = re.findall(r"\[([^\]]+)\]", ast.unparse(words))
    assert len(told) > 10
    for option, units in told.items():
        if option != "change":  # a list of names with units of their own
            assert specs_of(kind)[option].unit == (units[0] if units else ""), option


# --- which metrics


def test_figures_to_show_are_known_numbers():
    (held, force) = checked_columns(["held", "force_mean_n", "held"], FIGURES)
    assert (held.key, force.key) == ("held", "force_mean_n")
    with pytest.raises(InvalidValueError, match=r"force_mean: .* did you mean force_mean_n\?"):
        checked_columns(["force_mean"], FIGURES)


def test_figures_are_chosen_among_those_that_there_are():
    result = made("force=1,2")
    assert [each.key for each in shown_metrics(result.records, FIGURES)] == ["force_mean_n"]
    told = {"force_mean_n": None, "held": True, "true_mean_n": 1.0, "contact": "never lost"}
    told = [structs.replace(record, metrics=told) for record in result.records]
    assert [each.key for each in shown_metrics(told, FIGURES)] == ["held", "true_mean_n"]
    failed = made("force=1,2", status=lambda number: RunStatus.FAILED)
    assert shown_metrics(failed.records, FIGURES) == ()


# --- pictures

SHAPES = {
    "seeds alone": ((), 5),
    "one number": (("force=1:5:5",), 3),
    "one number, no seeds": (("force=1:5:5",), 1),
    "numbers far apart": (("force=0.01,0.1,1,10",), 2),
    "one word": (("surface=hard,soft",), 3),
    "a number and a word": (("surface=hard,soft", "force=1,2,3"), 3),
    "two numbers, few": (("speed=0.01,0.02", "force=1,2,3"), 2),
    "two numbers, many": (("speed=0.01:0.02:8", "force=1:4:9"), 1),
    "two words": (("surface=hard,soft", "robot=stage,turning-stage"), 2),
    "three": (("speed=0.01,0.02", "surface=hard,soft", "force=1,2,3"), 2),
    "four, one of them with a single value": (
        ("reach=0.01,0.02", "speed=0.01,0.02", "robot=stage", "force=1,2"),
        1,
    ),
    "a robot and a number": (("robot=stage,turning-stage", "force=1,2"), 1),
}


def marks(picture, kind):
    return [mark for panel in panels(picture) for mark in marks_of(panel, *getattr(kind, "__args__", (kind,)))]


@pytest.mark.parametrize("shape", SHAPES)
def test_whatever_was_varied_there_is_a_picture_that_names_it(shape, tmp_path):
    vary, seeds = SHAPES[shape]
    result = made(*vary, seeds=seeds)
    (picture,) = figures(result)
    names = [each.name for each in result.plan.varied if len(each.values) > 1] or ["seed"]
    named = [axis.quantity for panel in panels(picture) for axis in (panel.x, panel.y)]
    shown = " ".join(named + [mark.name for mark in marks(picture, Line | Points)])
    assert all(name.replace("_", " ") in shown for name in names)
    assert len(plots(picture)) == len(summary_figure(result).panels)
    if shape in {"two numbers, few", "two numbers, many"}:
        write_summary(result, tmp_path / "summary.png")
        assert (tmp_path / "summary.png").read_bytes().startswith(b"\x89PNG")


def test_a_line_goes_through_the_medians_and_its_band_holds_the_runs():
    def value(run):
        return 1e-3 * run.combination.config.force * (1.0 + 0.1 * (run.case.seed - 2))

    (picture,) = figures(made("force=1,2,4", seeds=5, value=value))
    (line,), (band,), (points,) = (marks(picture, kind) for kind in (Line, Band, Points))
    np.testing.assert_allclose(line.x, [1.0, 2.0, 4.0])
    np.testing.assert_allclose(line.y, [1.0, 2.0, 4.0])  # in mN
    assert panels(picture)[0].y.label == "mean force held [mN]"
    np.testing.assert_allclose(band.low / line.y, 0.84)
    np.testing.assert_allclose(band.high / line.y, 1.16)
    assert all("median of 5 runs" in each for each in points.texts)


@pytest.mark.parametrize("seeds", [1, 2, 4])
@pytest.mark.parametrize(
    "vary", [("force=1,2",), ("surface=hard,soft",), ("force=1,2", "speed=0.01,0.02", "reach=0.01,0.02")]
)
def test_nothing_is_claimed_of_fewer_than_five_seeds(vary, seeds):
    """Neither beside medians, nor where other options make up the number."""
    result = made(*vary, seeds=seeds)
    (picture,) = figures(result)
    assert "Fewer than 5 seeds do not tell what is chance." in picture.caption
    assert "hardly chance" not in picture.caption
    assert not marks(picture, Band)
    for panel in picture.panels:
        (points,) = (mark for mark in panel.marks if isinstance(mark, Points))
        assert points.y_error is None
        assert len(points.x) == len(result.records), "every run is a point"
    notes = [note for *_, note in combination_rows(result, 0)]
    assert not any(" to " in note for note in notes)
    assert seeds < 4 or len(notes[0].split(", ")) == 4, "each of them is told"
    assert " to " in combination_rows(made(*vary, seeds=5), 0)[0][3]
    assert "--seeds 5" in " ".join(advice(result))


@pytest.mark.parametrize(("apart", "told"), [(0.0, True), (0.005, True), (0.1, False)])
def test_lines_that_hide_one_another_are_told(apart, told):
    def value(run):
        return (
            run.combination.config.force * (1.0 + apart * (run.combination.config.speed > 0.015))
            + 1e-4 * run.number
        )

    (picture,) = figures(made("force=1,2,3", "speed=0.01,0.02", seeds=5, value=value))
    assert ("Indistinguishable here: speed = 10 mm/s and speed = 20 mm/s." in picture.caption) == told
    assert [line.dash for line in marks(picture, Line)] == [Dash.SOLID, Dash.DASHED if told else Dash.SOLID]


def test_runs_that_did_not_finish_do_not_count():
    def status(number):
        return RunStatus.UNFINISHED if number == 0 else RunStatus.DONE

    result = made("force=1,2", seeds=3, value=lambda run: 1e6 if run.number == 0 else 2.0, status=status)
    ((_, value, unit, note), _) = combination_rows(result, 0)
    assert (value, unit, note) == ("2", "N", "2 of 3 runs")
    assert "1 run that did not get to the end left out" in figures(result)[0].caption
    assert result.outcome.startswith("5 of 6 runs")


# --- report


@pytest.mark.slow
def test_a_report_needs_nothing_from_outside_and_escapes_what_is_typed(tmp_path):
    hostile = '<script>alert("x")</script>&'
    robot = tmp_path / hostile.replace("/", "_")
    from palpate.robots.robot import load_robot

    robot.write_text(next(iter(load_robot("stage").texts.values())))
    result = made(
        f"robot=stage,'{robot}'",
        "force=1,2",
        status=lambda number: RunStatus.FAILED if number == 3 else RunStatus.DONE,
    )
    odd = structs.replace(result.records[0], versions={"numpy": "<i>9</i>"})
    text = html(SweepResult(result.plan, (odd, *result.records[1:]), result.metrics))
    assert "numpy &lt;i&gt;9&lt;/i&gt; and 2.0" in text
    assert "<i>" not in text
    assert '<script>alert("x")' not in text
    assert "<b>it" not in text
    assert "&lt;b&gt;it &amp; fell&lt;/b&gt;" in text
    assert not re.search(r'(src|href)="(?!data:)', text)
    assert text.startswith("<!DOCTYPE html>")


def test_a_report_says_how_to_repeat_it_and_one_run_of_it():
    result = made("force=1:2:3", seeds=2, out=Path("a folder"))
    (_, again), (_, alone) = repeat_commands(result.plan)
    words = shlex.split(again)
    assert words[:2] == ["palpate", "sweep"]
    assert words[2:] == [
        TINY, "--vary", "force=1:2:3", "--set", *SHORT, "--seeds", "2", "--out", "a folder",
    ]  # fmt: skip
    assert shlex.split(alone) == [
        "palpate", TINY, "--force", "1.0", "--time", "0.02", "--noise", "0.01",
    ]  # fmt: skip


def test_advice_is_given_where_there_is_something_to_do():
    assert advice(made("force=1,2", seeds=5)) == ()
    assert "Nothing has to be done" in html(made("force=1,2", seeds=5))
    failed = made("force=1,2", seeds=3, status=lambda n: RunStatus.FAILED if n == 3 else RunStatus.DONE)
    assert "--repeat-failed" in " ".join(advice(failed))
    for seeds in (1, 4):
        assert "--seeds 5" in " ".join(advice(made("force=1,2", seeds=seeds)))
    assert "One seed of each is enough" in " ".join(advice(made("force=1,2", seeds=2, value=lambda run: 1.0)))


def test_what_is_true_or_false_is_a_share_and_nothing_is_no_number():
    assert spread_of([True, True, False, None]).middle == pytest.approx(2 / 3)
    nothing = spread_of([None, "word"])
    assert nothing.count == 0
    assert math.isnan(nothing.middle)


def test_a_column_of_several_kinds_can_be_kept(tmp_path):
    plan = planned("noise=null,0.02", "force=1,2", fixed=())
    several = replace(plan.varied[1], values=((0.008,), (0.008, 0.008, 0.012)))
    combinations = [
        replace(each, values=(each.values[0], several.values[i % 2])) for i, each in enumerate(plan.combinations)
    ]
    runs = [replace(run, combination=each) for run, each in zip(plan.runs, combinations, strict=True)]
    result = made("noise=null,0.02", "force=1,2", fixed=(), status=lambda n: list(RunStatus)[n])
    plan = replace(plan, varied=(plan.varied[0], several), combinations=tuple(combinations), runs=tuple(runs))
    result = replace(result, plan=plan)
    columns = columns_of(result.plan)
    rows = rows_of(result.plan, result.records)
    write_csv(rows, columns, tmp_path / "runs.csv")
    assert [row["force"] for row in rows] == ["0.008", "0.008 0.008 0.012"] * 2
    assert [row["noise"] for row in rows] == [None, None, 0.02, 0.02]
    pytest.importorskip("pyarrow")
    assert write_parquet(rows, columns, tmp_path / "runs.parquet")


def test_a_report_of_nothing_but_failures_or_words_says_so():
    result = made("force=1,2", status=lambda number: RunStatus.FAILED)
    assert "0 of 2 runs got to their end" in html(SweepResult(result.plan, result.records, ()))
    words = made("force=1,2", value=lambda run: "never lost")  # words have no median
    assert "see force_mean_n in runs.csv" in words.outcome
    assert figures(words)
    assert [row[0] for row in failure_rows(result)] == ["run 0: force=1, seed=0", "run 1: force=2, seed=0"]


def test_times_are_in_units_that_suit_them():
    assert [time_text(t) for t in (0.123, 45.0, 600.0, 7200.0, 1e6)] == [
        "0.12 s",
        "45 s",
        "10 min",
        "2 h",
        "12 days",
    ]
