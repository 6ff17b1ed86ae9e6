"""The page of a report, its file, its table on a terminal and its fragment in a notebook."""

import io
from dataclasses import replace
from html.parser import HTMLParser

import numpy as np
import pytest
from rich.console import Console

import palpate.reporting.page as page_module
from palpate.errors import InvalidValueError
from palpate.reporting.data import Quantity, TimeSeries
from palpate.reporting.page import report_page, write_report
from palpate.reporting.report import (
    NOTHING,
    Figures,
    Paragraph,
    QuantityTable,
    Report,
    Section,
    TextTable,
    quantity_table,
    report_fragment,
)
from palpate.reporting.run_figures import computing, force_overview
from palpate.runtime import RunTiming
from palpate.runtime.data import Phase
from palpate.runtime.times import Times

VOID = {"meta", "img", "source", "br"}


class Checker(HTMLParser):
    """Every tag that opens closes, in order; collects tags, sources, text, and class and text of table cells."""

    def __init__(self):
        super().__init__()
        self.open, self.tags, self.links, self.text, self.rows = [], [], [], [], []

    def handle_starttag(self, tag, attrs):
        self.tags.append(tag)
        self.links += [v for k, v in attrs if k in ("src", "srcset", "href")]
        if tag not in VOID:
            self.open.append(tag)
        if tag == "tr":
            self.rows.append([])
        elif tag == "td":
            self.rows[-1].append([dict(attrs).get("class"), ""])

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.text.append(data)
        if "td" in self.open:
            self.rows[-1][-1][1] += data


def parsed(html):
    checker = Checker()
    checker.feed(html)
    checker.close()
    assert checker.open == []
    return checker


TIME = np.arange(600) * 2e-3
SERIES = TimeSeries(TIME, ["scan"] * 600, 2.0 + 0.02 * np.sin(20 * TIME), *(np.full(600, 2.0) for _ in range(3)))


def timing_of(compute, period=2e-3):
    periods, ages = np.full(max(0, compute.size - 1), period), np.full(compute.size, 4e-3)
    return RunTiming(Times(compute), Times(periods), Times(), Times(ages), 0, "", period)


PLAIN = Report(
    "A sphere",
    "Done.",
    (Quantity("Force error", 0.0123456, "N", "of 2 N"),),
    (Section("Over time", (Figures(lambda: [force_overview(SERIES), None]),)),),
    settings=(("Scan speed", "20 mm/s"),),
)


def test_what_is_not_there_is_left_out_and_without_advice_nothing_has_to_be_done():
    empty = (Paragraph(""), QuantityTable(()), TextTable(()), Figures(lambda: [None]))
    checker = parsed(report_page(Report("A title", "Done.", (), (Section("Empty", empty),))))
    assert {"A title", "Done.", NOTHING} <= set(checker.text)
    assert not {"Empty", "How to repeat it"} & set(checker.text)
    assert not {"figure", "script", "table"} & set(checker.tags)


def test_the_figures_of_sections_count_as_the_reports():
    more = (Quantity("gain margin", 3.0), Quantity("phase margin", 50.0))
    report = replace(PLAIN, sections=(*PLAIN.sections, Section("Margins", (Paragraph("x"), QuantityTable(more)))))
    assert report.all_metrics == (*PLAIN.metrics, *more)


def test_the_file_is_the_report_and_a_failed_write_leaves_the_former(tmp_path, monkeypatch):
    path = tmp_path / "report.html"
    assert report_page(PLAIN) == report_page(PLAIN), "the same report gives the same bytes"
    monkeypatch.setattr(page_module, "_page", lambda *_: "<p>\N{GREEK SMALL LETTER MU}</p>")
    write_report(PLAIN, path)
    assert path.read_bytes() == b"<p>\xce\xbc</p>"
    monkeypatch.setattr(page_module, "_page", lambda *_: "no UTF-8: \udc80")
    with pytest.raises(UnicodeEncodeError):
        write_report(PLAIN, path)
    assert path.read_bytes() == b"<p>\xce\xbc</p>"
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize(
    ("value", "digits", "text"),
    [(3.0, {}, "3"), (28801.0, {}, "28801"), (0.0123456, {}, "0.01235"), (39.99996, {}, "40.00"),
     (12345.6, {}, "12346"), (1234.5, {}, "1234"), (float("nan"), {}, "-"), (float("inf"), {}, "inf"),
     (1.5e-9, {}, "1.500e-09"), ("done", {}, "done"),
     (40.037, {"digits": 5}, "40.037"), (12345.6, {"digits": 5}, "12346")],
)  # fmt: skip
def test_key_figures_show_four_digits_or_as_many_as_asked_for(value, digits, text):
    assert Quantity("x", value, **digits).text == text


def test_terminal_table_shows_text_as_it_is():
    console = Console(width=100, record=True, file=io.StringIO())
    console.print(quantity_table([Quantity("[bold]RMS[/bold]", 0.5, "N", "[red]x")], "[b]t", "Done."))
    text = console.export_text()
    for said in ("[bold]RMS[/bold]", "0.5", "[red]x", "[b]t", "Done."):
        assert said in text


@pytest.mark.parametrize("compute", [np.zeros(0), np.array([0.0, 3e-3])], ids=["no-period", "overrun"])
def test_however_a_run_kept_time_it_is_reported(compute):
    parsed(report_page(replace(PLAIN, sections=(computing(timing_of(compute)),))))


def test_timing_in_real_time_tells_of_deadlines_and_in_simulated_time_of_slow_periods():
    timing = timing_of(np.array([1e-4, 2e-4, 5e-3]))
    late = np.array([1e-5, 3e-4])
    real = replace(timing, lateness=late, overruns=1, note="no <real-time> priority")
    simulated, html = (report_page(replace(PLAIN, sections=(computing(each),))) for each in (timing, real))
    assert "slower than real time" in simulated
    assert "waking up late" not in simulated
    for text in ("waking up late, 99 %", ">300<", "overruns", "no &lt;real-time&gt; priority", "max 5000 µs of 3"):
        assert text in html


def test_series_have_one_length_and_phases_of_any_strings():
    with pytest.raises(InvalidValueError, match="speed has 3 entries: must be 600"):
        replace(SERIES, speed=np.zeros(3))
    for phases in (np.array([Phase.SCAN] * 600), [Phase.SCAN] * 600):
        assert replace(SERIES, phase=phases).phase == ("scan",) * 600


UNSEEN = Section("Nothing seen", (Figures(lambda: [None]),))
SEEN = Section("Errors", (Paragraph("x"), Figures(lambda: [None, *[force_overview(SERIES)] * 2])))


@pytest.mark.parametrize(("sections", "pictures"), [((), 0), ((UNSEEN,), 0), ((UNSEEN, SEEN, SEEN), 1)])
def test_a_notebook_shows_the_figures_and_the_first_picture(sections, pictures):
    whole = parsed(report_fragment(replace(PLAIN, sections=sections)))
    assert whole.tags.count("img") == pictures
    assert {"0.01235", "Done."} <= set(whole.text)


def test_text_in_a_notebook_is_text():
    evil = "<script>x</script>"
    whole = parsed(report_fragment(Report(evil, evil, (Quantity(evil, evil, evil, evil),))))
    assert "script" not in whole.tags
    assert whole.text.count(evil) == 6
