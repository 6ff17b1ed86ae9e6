import dataclasses
import functools
import io
import re
from html.parser import HTMLParser

import numpy as np
import palpate.experiments.explore.report_page as report_module
import pytest
from palpate.experiments.explore.map_data import MapReport, ShapeReport
from palpate.experiments.explore.report_page import report_html, write_report
from rich.console import Console

from mapping.raster import CENTER, RADIUS, sphere_cap
from palpate.errors import InvalidValueError
from palpate.mapping import MapSettings, SurfaceMap, surface_mesh
from palpate.mapping.layers import VertexLayer
from palpate.reporting.data import ExplorationReport, KeyFigure, TimeSeries, TrueSurface
from palpate.reporting.encode import svg_uri
from palpate.reporting.force_picture import force_overview
from palpate.reporting.terminal import summary_table
from palpate.runtime import RunTiming
from palpate.runtime.data import Phase

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


def octahedron():
    vertices = CENTER + RADIUS * np.concatenate([np.eye(3), -np.eye(3)])
    return TrueSurface(vertices, np.array([[0, 1, 2], [1, 3, 2], [3, 4, 2], [4, 0, 2]]))


def timing_of(compute, period):
    return RunTiming(compute, np.full(max(0, compute.size - 1), period), np.zeros(0), 0, "", period)


CAP = sphere_cap(half=0.006, step=4e-4)
PLAIN = ExplorationReport(
    title="A sphere",
    outcome="Done.",
    summary=(KeyFigure("Force error", 0.0123456, "N", "of 2 N"), KeyFigure("Ended", "done")),
    settings=(("Scan speed", "20 mm/s"),),
    cloud=CAP,
    series=series_of(),
    timing=timing_of(np.full(600, 1e-4), 2e-3),
)
SHAPE = ShapeReport(
    "It is a sphere.", (("radius", "40.000", "mm", "± 0.001 mm"),), (("plane", "1.7", "mm", "too far off"),)
)


@functools.cache
def cap_mesh():
    """What was felt of the cap as a surface: it takes a second, and so not before a test asks."""
    return surface_mesh(SurfaceMap.learned(CAP, MapSettings.for_rows(2e-3, bias=1e-6)), 1e-3)


@functools.cache
def cap_map():
    mesh = cap_mesh()
    return MapReport(
        mesh,
        (("may be off everywhere", "0.00100", "mm", "the <budget>"),),
        np.linalg.norm(mesh.vertices - CENTER, axis=1) - RADIUS,
        CENTER + RADIUS * np.eye(3),
        (VertexLayer("friction", np.full(len(mesh.vertices), 0.3), np.full(len(mesh.vertices), 0.01)),),
    )


@functools.cache
def full():
    """Everything that a report can hold."""
    return dataclasses.replace(
        PLAIN,
        map=cap_map(),
        shape=SHAPE,
        true_surface=octahedron(),
        point_error=np.linalg.norm(CAP.position - CENTER, axis=1) - RADIUS + 1e-6,
    )


BRIEF = dataclasses.replace(PLAIN, series=series_of(phases=()))


@pytest.fixture(scope="module")
def full_html():
    return report_html(full())


@pytest.mark.slow
def test_the_whole_report_is_well_formed_and_has_every_picture(full_html):
    checker = parsed(full_html)
    assert checker.tags.count("img") == 10
    assert checker.tags.count("figcaption") == 10
    text = " ".join(checker.text)
    for said in (
        "0.01235",
        "of 2 N",
        "20 mm/s",
        "40.000",
        "± 0.001 mm",
        "It is a sphere.",
        "the <budget>",
        "Done.",
    ):
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
    assert report_html(BRIEF) == report_html(BRIEF)
    first, second = (svg_uri(force_overview(PLAIN.series).full) for _ in range(2))
    assert first == second


def test_text_of_the_user_is_text():
    evil = '<script>alert("x")</script> & "quotes"'
    html = report_html(
        dataclasses.replace(
            BRIEF,
            title=evil,
            outcome=evil,
            summary=(KeyFigure(evil, evil, evil, evil),),
            settings=((evil, evil),),
        )
    )
    checker = parsed(html)
    assert "script" not in checker.tags
    assert checker.text.count(evil) == 9  # title twice, outcome, four of the key figure, two of the setting


@pytest.mark.slow
@pytest.mark.parametrize(
    "report",
    [
        dataclasses.replace(PLAIN, cloud=CAP.select(np.zeros(len(CAP), dtype=bool)), summary=(), settings=()),
        dataclasses.replace(BRIEF, cloud=CAP.select(np.arange(len(CAP)) == 0)),
        dataclasses.replace(PLAIN, series=series_of(phases=("approach", "somethingelse", "lost"))),
        dataclasses.replace(PLAIN, series=series_of(phases=()), timing=timing_of(np.zeros(0), 1e-3)),
        dataclasses.replace(
            PLAIN, series=dataclasses.replace(series_of(), true_force=None, true_spin_torque=None)
        ),
        dataclasses.replace(PLAIN, series=series_of(touched=False)),
        dataclasses.replace(BRIEF, timing=timing_of(np.array([0.0, 3e-3]), 2e-3)),
        dataclasses.replace(BRIEF, point_error=np.zeros(len(CAP)), true_surface=octahedron()),
    ],
    ids=[
        "nothing-felt", "one-contact", "no-scan", "no-series", "no-truth", "no-force", "overrun", "no-error",
    ],
)  # fmt: skip
def test_whatever_is_missing_the_rest_is_reported(report):
    parsed(report_html(report))


@pytest.mark.slow
def test_a_map_without_truth_or_layers_or_triangles_is_reported():
    nobody_knows = dataclasses.replace(cap_map(), error=None, missed=np.zeros((0, 3)), layers=())
    assert "true errors" not in report_html(dataclasses.replace(BRIEF, map=nobody_knows))
    empty = surface_mesh(SurfaceMap(), 1e-3)
    told = report_html(dataclasses.replace(BRIEF, map=MapReport(empty, (), None, np.zeros((0, 3)))))
    assert "nothing of the surface counts as observed" in told


def test_a_map_has_one_error_and_one_value_of_a_layer_per_vertex():
    with pytest.raises(InvalidValueError, match="error has shape"):
        dataclasses.replace(cap_map(), error=np.zeros(3))
    with pytest.raises(InvalidValueError, match="must be finite"):
        dataclasses.replace(cap_map(), error=np.full(len(cap_mesh().vertices), np.nan))
    with pytest.raises(InvalidValueError, match="layer friction has 2 values"):
        dataclasses.replace(cap_map(), layers=(VertexLayer("friction", np.zeros(2), np.zeros(2)),))


@pytest.mark.slow
def test_where_errors_come_from_is_told_as_text():
    report = dataclasses.replace(BRIEF, point_error=np.zeros(len(CAP)), error_note="Friction <lifts> it.")
    assert "Friction <lifts> it." in " ".join(parsed(report_html(report)).text)


def test_the_file_is_the_report(tmp_path, monkeypatch):
    monkeypatch.setattr(report_module, "report_html", lambda _: "<p>\N{GREEK SMALL LETTER MU}</p>")
    write_report(PLAIN, tmp_path / "report.html")
    assert (tmp_path / "report.html").read_bytes() == b"<p>\xce\xbc</p>"


def test_a_failed_write_leaves_the_former_report(tmp_path, monkeypatch):
    path = tmp_path / "report.html"
    path.write_text("former")
    monkeypatch.setattr(report_module, "report_html", lambda _: "no UTF-8: \udc80")
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
    console.print(summary_table(dataclasses.replace(PLAIN, title="[b]t", summary=(figure,))))
    text = console.export_text()
    for said in ("[bold]RMS[/bold]", "0.5", "[red]x", "[b]t", "Done."):
        assert said in text


def test_lengths_must_fit():
    with pytest.raises(InvalidValueError, match="point_error"):
        dataclasses.replace(PLAIN, point_error=np.zeros(3))
    with pytest.raises(InvalidValueError, match="point_error: must be finite"):
        dataclasses.replace(PLAIN, point_error=np.full(len(CAP), np.nan))
    with pytest.raises(InvalidValueError, match="speed has 3 entries: must be 600"):
        dataclasses.replace(PLAIN.series, speed=np.zeros(3))
    with pytest.raises(InvalidValueError, match="triangles name vertices 0 to 9"):
        TrueSurface(np.zeros((3, 3)), np.array([[0, 1, 9]]))


def test_timing_in_real_time_tells_of_deadlines_and_in_simulated_time_of_slow_periods():
    compute = np.array([1e-4, 2e-4, 5e-3])
    simulated = report_html(dataclasses.replace(BRIEF, timing=timing_of(compute, 2e-3)))
    assert "slower than real time" in simulated
    assert "waking up late" not in simulated
    real = dataclasses.replace(
        timing_of(compute, 2e-3), lateness=np.array([1e-5, 3e-4]), overruns=1, note="no <real-time> priority"
    )
    html = report_html(dataclasses.replace(BRIEF, timing=real))
    for text in ("waking up late, 99 %", ">300<", "overruns", "no &lt;real-time&gt; priority", "max 5000 µs of 3"):
        assert text in html


def test_phases_may_be_any_strings():
    series = dataclasses.replace(PLAIN.series, phase=np.array([Phase.SCAN] * 600))
    assert series.phase == ("scan",) * 600
    assert dataclasses.replace(series, phase=[Phase.LIFT] * 600).phase == ("lift",) * 600
