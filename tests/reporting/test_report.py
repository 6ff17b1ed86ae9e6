import functools
import io
import re
from dataclasses import replace
from html.parser import HTMLParser

import numpy as np
import pytest
from rich.console import Console

import palpate.reporting.page as page_module
from mapping.raster import sphere_cap
from palpate.errors import InvalidValueError
from palpate.experiments.explore.report import exploration_report
from palpate.mapping import MapSettings, SurfaceMap, surface_mesh
from palpate.mapping.layers import VertexLayer
from palpate.reporting.computing import computing
from palpate.reporting.data import KeyFigure, TimeSeries
from palpate.reporting.encode import svg_uri
from palpate.reporting.force_picture import force_overview
from palpate.reporting.page import report_page, write_report
from palpate.reporting.report import FigureTable, Paragraph, Pictures, Report, Section, TextTable
from palpate.reporting.terminal import key_figures
from palpate.runtime import RunTiming
from palpate.runtime.data import Phase
from support.explore_runs import small, unfelt, untrue

NO_LAYER = VertexLayer("stiffness", np.zeros(0), np.zeros(0))

VOID = {"meta", "img", "source", "br"}


class Checker(HTMLParser):
    """Every tag that opens closes, in order; collects tags, sources and text."""

    def __init__(self):
        super().__init__()
        self.open, self.tags, self.links, self.text = [], [], [], []

    def handle_starttag(self, tag, attrs):
        self.tags.append(tag)
        self.links += [v for k, v in attrs if k in ("src", "srcset", "href")]
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.text.append(data)


def parsed(html):
    checker = Checker()
    checker.feed(html)
    checker.close()
    assert checker.open == []
    return checker


def series_of(phases=("approach", "scan", "lift"), each=200, touched=True):
    count = each * len(phases)
    time = np.arange(count) * 2e-3
    force = 2.0 + 0.02 * np.sin(20 * time)
    force[: each // 2 if touched else count] = np.nan
    return TimeSeries(
        time=time,
        phase=tuple(name for name in phases for _ in range(each)),
        measured_force=force,
        set_force=np.full(count, 2.0),
        spin_torque=1e-3 * np.sin(time),
        speed=np.full(count, 0.02),
        true_force=np.nan_to_num(force),
        true_spin_torque=1e-3 * np.sin(time),
    )


def timing_of(compute, period):
    return RunTiming(compute, np.full(max(0, compute.size - 1), period), np.zeros(0), 0, "", period)


CAP = sphere_cap(half=0.006, step=4e-4)
PLAIN = Report(
    title="A sphere",
    outcome="Done.",
    figures=(KeyFigure("Force error", 0.0123456, "N", "of 2 N"), KeyFigure("Ended", "done")),
    settings=(("Scan speed", "20 mm/s"),),
)


@functools.cache
def cap_mesh():
    """What was felt of the cap as a surface: it takes a second, and so not before a test asks."""
    return surface_mesh(SurfaceMap.learned(CAP, MapSettings.for_rows(2e-3, bias=1e-6)), 1e-3)


@pytest.fixture(scope="module")
def full_html():
    """With every kind of part."""
    return report_page(replace(exploration_report(small()), figures=PLAIN.figures, outcome="<Done>"))


@pytest.mark.slow
def test_the_whole_report_is_well_formed_and_has_every_picture(full_html):
    checker = parsed(full_html)
    assert checker.tags.count("img") == checker.tags.count("figcaption") == 13
    text = " ".join(checker.text)
    for said in ("0.01235", "of 2 N", "40 mm/s", "radius", "It is a sphere", "misses by", "may be off", "<Done>"):
        assert said in text


@pytest.mark.slow
def test_nothing_comes_from_outside(full_html):
    links = parsed(full_html).links
    assert links
    assert all(link.startswith(("data:image/svg+xml;base64,", "data:image/png;base64,")) for link in links)
    assert not re.search(r"https?://|url\(|@import|<script|<link", full_html)


@pytest.mark.slow
def test_it_is_small_enough_to_send(full_html):
    assert len(full_html) < 4_000_000


@pytest.mark.slow
def test_the_same_run_gives_the_same_report():
    report = replace(PLAIN, sections=(Section("Forces", (Pictures(lambda: [force_overview(series_of())]),)),))
    assert report_page(report) == report_page(report)
    first, second = (svg_uri(force_overview(series_of()).full) for _ in range(2))
    assert first == second


def test_text_of_the_user_is_text():
    evil = '<script>alert("x")</script> & "quotes"'
    figure = KeyFigure(evil, evil, evil, evil)
    parts = (Paragraph(evil), FigureTable((figure,)), TextTable(((evil,),), ("note",), (evil,)))
    html = report_page(Report(evil, evil, (figure,), (Section(evil, parts),), evil, settings=((evil, evil),)))
    checker = parsed(html)
    assert "script" not in checker.tags
    # title twice, outcome, four of each figure, heading, paragraph, two of the table, two of the setting
    assert checker.text.count(evil) == 17
    assert f"Asked: {evil}" in checker.text


def test_a_section_without_anything_to_be_seen_is_left_out():
    empty = Section("Nothing here", (Paragraph(""), TextTable(()), Pictures(lambda: [None])))
    assert "Nothing here" not in report_page(replace(PLAIN, sections=(empty,)))


@pytest.mark.slow
@pytest.mark.parametrize(
    "less",
    [
        unfelt,
        untrue,
        lambda found: replace(found, cloud=found.cloud.select(np.arange(len(found.cloud)) == 0),
                              point_error=np.zeros(1), map=None, growth=None),
        lambda found: replace(found, run=replace(found.run, timing=timing_of(np.zeros(0), 1e-3))),
        lambda found: replace(found, record=replace(found.record, touching=np.zeros(len(found.record), bool))),
        lambda found: replace(found, point_error=np.zeros(len(found.cloud))),
    ],
    ids=["nothing-felt", "no-truth", "one-contact", "no-timing", "no-force", "no-error"],
)  # fmt: skip
def test_whatever_is_missing_the_rest_is_reported(less):
    html = report_page(exploration_report(less(small())))
    parsed(html)
    assert "nan" not in re.sub(r"base64,[^\"]*", "", html)


@pytest.mark.slow
def test_a_map_without_truth_or_triangles_is_reported():
    assert "true errors" not in report_page(exploration_report(untrue(small())))
    found, none = small(), np.zeros(0)
    empty = replace(found.map, mesh=surface_mesh(SurfaceMap(), 1e-3), error=none, stiffness=NO_LAYER,
                    friction=NO_LAYER, curvature=())  # fmt: skip
    told = report_page(exploration_report(replace(found, map=empty)))
    assert "nothing of the surface counts as observed" in told


def test_the_file_is_the_report(tmp_path, monkeypatch):
    monkeypatch.setattr(page_module, "report_page", lambda _: "<p>\N{GREEK SMALL LETTER MU}</p>")
    write_report(PLAIN, tmp_path / "report.html")
    assert (tmp_path / "report.html").read_bytes() == b"<p>\xce\xbc</p>"


def test_a_failed_write_leaves_the_former_report(tmp_path, monkeypatch):
    path = tmp_path / "report.html"
    path.write_text("former")
    monkeypatch.setattr(page_module, "report_page", lambda _: "no UTF-8: \udc80")
    with pytest.raises(UnicodeEncodeError):
        write_report(PLAIN, path)
    assert path.read_text() == "former"
    assert len(list(tmp_path.iterdir())) == 1


@pytest.mark.parametrize(
    ("value", "text"),
    [(3.0, "3"), (28801.0, "28801"), (0.0123456, "0.01235"), (39.99996, "40.00"), (12345.6, "12346"),
     (1234.5, "1234"), (float("nan"), "-"), (float("inf"), "inf"), (1.5e-9, "1.500e-09"), ("done", "done")],
)  # fmt: skip
def test_key_figures_show_four_digits(value, text):
    assert KeyFigure("x", value).text == text


def test_key_figures_show_as_many_digits_as_asked_for():
    assert KeyFigure("x", 40.037, digits=5).text == "40.037"
    assert KeyFigure("x", 12345.6, digits=5).text == "12346"


def test_terminal_table_shows_text_as_it_is():
    figure = KeyFigure("[bold]RMS[/bold]", 0.5, "N", "[red]x")
    console = Console(width=100, record=True, file=io.StringIO())
    console.print(key_figures("[b]t", "Done.", (figure,)))
    text = console.export_text()
    for said in ("[bold]RMS[/bold]", "0.5", "[red]x", "[b]t", "Done."):
        assert said in text


def test_lengths_must_fit():
    with pytest.raises(InvalidValueError, match="speed has 3 entries: must be 600"):
        replace(series_of(), speed=np.zeros(3))


def timing_html(timing):
    return report_page(replace(PLAIN, sections=(computing(timing),)))


def test_timing_in_real_time_tells_of_deadlines_and_in_simulated_time_of_slow_periods():
    compute = np.array([1e-4, 2e-4, 5e-3])
    simulated = timing_html(timing_of(compute, 2e-3))
    assert "slower than real time" in simulated
    assert "waking up late" not in simulated
    real = replace(
        timing_of(compute, 2e-3), lateness=np.array([1e-5, 3e-4]), overruns=1, note="no <real-time> priority"
    )
    html = timing_html(real)
    for text in ("waking up late, 99 %", ">300<", "overruns", "no &lt;real-time&gt; priority", "max 5000 µs of 3"):
        assert text in html


def test_phases_may_be_any_strings():
    series = replace(series_of(), phase=np.array([Phase.SCAN] * 600))
    assert series.phase == ("scan",) * 600
    assert replace(series, phase=[Phase.LIFT] * 600).phase == ("lift",) * 600
