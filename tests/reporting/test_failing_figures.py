"""A figure that fails costs neither the page nor the other figures nor their files; its error is named."""

import inspect
import json
from dataclasses import replace
from html import unescape

import numpy as np
import pytest

import palpate.reporting.paper as paper
from palpate.cli import main
from palpate.commands.command_result import ExitCode
from palpate.experiments.kit.registry import experiment_named
from palpate.reporting.data import Quantity
from palpate.reporting.figure import Axis, Figure, Panel
from palpate.reporting.marks import Cells, Colouring, Line, Text
from palpate.reporting.page import report_page, write_report
from palpate.reporting.report import FigureFailure, Figures, Paragraph, Report, Section, TextTable, report_fragment
from reporting.test_report import parsed
from support.tiny_experiment import TINY


def figure(title, mark=None):
    line = Line(np.arange(3.0), np.arange(3.0))
    return Figure(title, "A caption.", (Panel((mark or line,), Axis("x"), Axis("y")),))


def broken():
    raise ZeroDivisionError("no <contacts>")


def generated():
    yield figure("before")
    broken()
    yield figure("never")


def nan_place():
    """It can be made but not drawn: JSON has no NaN."""
    return figure("nowhere", Text(np.nan, 0.0, "here"))


def ragged():
    return figure("ragged", Cells(Colouring("share", np.zeros(5)), ("a", "b"), ("c",)))


def good_and_bad():
    yield lambda: figure("first")
    yield broken
    yield lambda: figure("last")
    yield lambda: None


WAYS = {
    "returns": (lambda: broken(), [], ["Seen"]),
    "yields": (generated, ["before"], ["Seen"]),
    "functions": (good_and_bad, ["first", "last"], ["Seen: broken"]),
    "not a number": (lambda: [nan_place(), figure("beside")], ["beside"], ["nowhere"]),
    "another shape": (lambda: [figure("beside"), ragged()], ["beside"], ["ragged"]),
}


def report(draw):
    seen = Section("Seen", (Paragraph("Some words."), Figures(draw), TextTable((("rows", "5", "", ""),))))
    after = Section("After", (Figures(lambda: [figure("afterwards")]),))
    return Report("A run", "Done.", (Quantity("force", 2.0, "N"),), (seen, after), advice=("Do it again.",))


@pytest.mark.parametrize("way", WAYS)
def test_all_else_is_on_the_page_and_the_failure_in_its_place(way, tmp_path):
    draw, drawn, failed = WAYS[way]
    written = write_report(report(draw), tmp_path / "report.html")
    assert written.files == (tmp_path / "report.html",)
    html = written.files[0].read_text()
    words = " ".join(parsed(html).text)
    for text in ("Some words.", "force", "rows", "Do it again.", *drawn, "afterwards"):
        assert text in words
    assert html.count("<figure") == len(drawn) + 1
    assert "never" not in words
    assert [each.title for each in written.failures] == failed
    for each in written.failures:
        assert f"This figure could not be drawn: {each.error}" in words
        assert each.place in words
        assert each.error.split(":")[0] in {"ZeroDivisionError", "ValueError"}


def test_the_failure_names_file_line_and_message():
    part = report(lambda: broken()).sections[0].parts[1]
    assert isinstance(part, Figures)
    (failure,) = part.drawn("Seen")
    line = inspect.getsourcelines(broken)[1] + 1
    assert failure == FigureFailure("Seen", "ZeroDivisionError: no <contacts>", f"{__file__}, line {line}")
    assert (
        str(failure)
        == f"figure 'Seen' could not be drawn: ZeroDivisionError: no <contacts> ({__file__}, line {line})"
    )
    assert "<contacts>" not in report_page(report(lambda: broken()))


def test_figures_are_counted_without_those_that_fail():
    """Each card finds its own data."""
    html = report_page(report(lambda: [nan_place(), figure("beside")]))
    assert [f'data-figure="{i}"' in html for i in range(3)] == [True, True, False]


def test_a_notebook_says_which_figure_failed():
    html = report_fragment(report(lambda: broken()))
    assert "could not be drawn: ZeroDivisionError" in unescape(html)
    assert "2" in html


@pytest.mark.slow
def test_a_figure_that_fails_on_paper_alone_leaves_the_page_and_the_other_files(tmp_path, monkeypatch):
    draw = paper.paper_figure

    def failing(shown):
        return broken() if shown.title == "first" else draw(shown)

    monkeypatch.setattr(paper, "paper_figure", failing)
    written = write_report(report(good_and_bad), tmp_path / "report.html", "svg")
    assert [each.name for each in written.files] == ["report.html", "last.svg", "afterwards.svg"]
    assert [each.title for each in written.failures] == ["Seen: broken", "first"]
    assert '<figure class="card" data-figure="2"' in written.files[0].read_text(), "the browser draws all three"


def test_what_is_no_error_of_a_figure_stops_the_report():
    def interrupted():
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        report_page(report(interrupted))


@pytest.mark.parametrize("kind", ["svg", None])
def test_a_run_with_a_failing_figure_keeps_everything_else_and_exits_with_1(kind, tmp_path, monkeypatch, capsys):
    tap = type(experiment_named(TINY))
    usual = tap.report

    def with_figures(self, result):
        shown = Figures(good_and_bad)
        return replace(usual(self, result), sections=(Section("Forces", (shown,)),))

    monkeypatch.setattr(tap, "report", with_figures)
    words = [TINY, "--time", "0.05", "--json", "--out", str(tmp_path)]
    assert main([*words, *(["--figures", kind] if kind else [])]) == ExitCode.UNFINISHED
    told = capsys.readouterr()
    result = json.loads(told.out)
    message = "figure 'Forces: broken' could not be drawn: ZeroDivisionError: no <contacts>"
    assert result["exit_code"] == 1
    assert any(message in each and f"{__file__}, line" in each for each in result["warnings"])
    assert message in " ".join(told.err.split())
    assert result["metrics"]["force_mean_n"] == pytest.approx(2.0, rel=0.1)
    files = {path.name for path in tmp_path.rglob("*") if path.is_file() and path.suffix != ".mcap"}
    assert files == {"report.html", "forces.txt", *(("first.svg", "last.svg") if kind else ())}
    assert list(tmp_path.glob("*.mcap")), "the log"
    assert (tmp_path / "report.html").read_text().count("<figure") == 2
