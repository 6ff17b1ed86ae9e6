"""What holds of every kind of report: sentences, units, nothing from outside, nothing run but what draws it."""

import base64
import hashlib
import io
import re
from html import unescape

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from PIL import Image

import palpate.reporting.page as page_module
from palpate.reporting.data import Quantity
from palpate.reporting.figure import Panel
from palpate.reporting.page import report_page, table, text
from palpate.reporting.paper import paper_figure
from palpate.reporting.report import Report, Section, TextTable
from reporting.every_report import KINDS, html_of
from reporting.test_report import parsed
from viewing.browser import needs_browser, page

pytestmark = pytest.mark.xdist_group("every report")
"""One worker runs them: they share written reports and a browser."""

QUICK = "runs"
IN_BROWSER = [QUICK, *(pytest.param(kind, marks=pytest.mark.slow) for kind in KINDS if kind != QUICK)]

PHONE = 400

HOSTILE = (
    "<script>window.ran=1</script><img src=x onerror='window.ran=1'>\"'><svg onload=window.ran=1>&amp;&lt;"
    "</style></title></textarea>--><style>body{display:none}</style><a href='javascript:window.ran=1'>"
)

UNITLESS = re.compile(
    r"number of|relative|share of|force / |/ normal force|^contacts$|mu|^robot$|^taken for$|^touched$|^friction"
)
"""Labels of counts and ratios, and of what is words."""


def is_number(text):
    return re.fullmatch(r"[-+]?(\d+\.?\d*(e[-+]?\d+)?|nan|inf)", text.replace(" ", "")) is not None


def written(kind, typed, folder):
    """Return the page of a report and its pictures."""
    seen, card = [], page_module._card
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(page_module, "_card", lambda picture, n: seen.append(picture) or card(picture, n))
        return html_of(kind, typed, folder), seen


@pytest.fixture(scope="module", params=KINDS)
def report(request, tmp_path_factory):
    """One page of each kind and its pictures, for all tests of the module."""
    return written(request.param, "A name.", tmp_path_factory.mktemp("report"))


def labels(panel):
    if isinstance(panel, Panel):
        return [panel.x.label, panel.y.label]
    return [each.label for mark in panel.marks for each in getattr(mark, "colourings", ())]


@pytest.mark.slow
def test_every_picture_has_a_sentence_and_units_and_can_be_printed(report):
    html, pictures = report
    assert pictures
    assert html.count("<figcaption>") == html.count("<figure") == len(pictures)
    for picture in pictures:
        assert re.fullmatch(r"\w.{30,}[.]", picture.caption, re.DOTALL), picture.title
        shown = [label for panel in picture.panels for label in labels(panel)]
        assert all("[" in each or UNITLESS.search(each) for each in shown if each), (picture.title, shown)
        assert len(paper_figure(picture).axes) >= len(picture.panels)


@pytest.mark.slow
def test_every_number_has_a_cell_for_its_unit(report):
    """The cell is empty beside a ratio or a count, as `test_a_ratio_or_count_has_no_unit...` states."""
    # units of settings stand in the words
    rows = [row for row in parsed(report[0]).rows if [name for name, _ in row] != ["name", "value"]]
    values = [row for row in rows if any(name == "value" and is_number(text) for name, text in row)]
    assert values
    assert all(any(str(name).startswith("unit") for name, _ in row) for row in values), values


@pytest.mark.slow
def test_parts_come_in_the_same_order_and_nothing_from_outside(report):
    html, _ = report
    order = [html.index(part) for part in ("<h1>", 'class="asked"', 'class="outcome"', "<figure", "What to do")]
    order += [html.index("How to repeat it"), html.index("<footer>")]
    assert order == sorted(order)
    assert not re.search(r"https?://|url\(|@import|<link|javascript:", html)
    assert parsed(html).links == []
    assert runs_only_its_own(html)


def runs_only_its_own(html):
    """Whether the policy names the hash of the script that the page runs, and nothing but hashes."""
    policy = unescape(re.search(r'Policy" content="(.*?)"', html)[1])
    allowed = re.search(r"script-src (.*)", policy)[1].split()
    (script,) = re.findall(r"<script>(.*?)</script>", html, re.DOTALL)
    digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
    assert policy.startswith("default-src 'none'")
    assert all(each.startswith("'sha256-") for each in allowed)
    return f"'sha256-{digest}'" in allowed and html.count("<script") == 3


@given(typed=st.text(max_size=60) | st.sampled_from([HOSTILE, "\0", "a\u202eb", "x" * 20_000, "${7*7}", "\ud800"]))
@settings(max_examples=60, deadline=None)
def test_whatever_was_typed_is_text(typed):
    """It opens no tag and closes none, and it reads as it was typed, but for what nobody sees."""
    parts = (TextTable(((typed,) * 5,), ("name", "value", "unit", "value", "note"), (typed,) * 5),)
    pairs = ((typed, typed),)
    metrics = (Quantity(typed, typed, typed, typed),)
    html = report_page(
        Report(typed, typed, metrics, (Section(typed, parts),), typed, (typed,), pairs, pairs, typed)
    )
    html.encode("utf-8")
    checker = parsed(html)
    assert set(checker.tags) <= {
        "html", "head", "meta", "title", "style", "body", "main", "h1", "h2", "p", "div", "table", "tr", "td",
        "th", "section", "code", "span", "footer",
    }  # fmt: skip
    assert not set("\0\u202e\u2066") & set(html)
    assert text(typed) == text(unescape(text(typed))), "shown again it is the same"


def test_text_reads_as_typed():
    assert unescape(text("<b> & \"x\" 'y'\n")) == "<b> & \"x\" 'y'\n"
    assert text("a\0b\u202ec") == "a\N{REPLACEMENT CHARACTER}b\N{REPLACEMENT CHARACTER}c"


def test_a_ratio_or_count_has_no_unit_and_says_nothing_of_it():
    rows = [("n", "3", "", ""), ("f", "2.0", "N", "")]
    assert table(rows, ("name", "value", "unit", "note")).count('<td class="unit"></td>') == 1


def brightness(browser, theme):
    feature = {"name": "prefers-color-scheme", "value": theme}
    browser.call("Emulation.setEmulatedMedia", features=[feature])
    return float(np.asarray(Image.open(io.BytesIO(browser.screenshot())).convert("L")).mean())


@pytest.fixture(scope="module")
def offline(tmp_path_factory):
    """A browser without network and as narrow as a phone, for the reports of all kinds."""
    with page(tmp_path_factory.mktemp("profile"), "about:blank") as browser:
        browser.call("Network.enable")
        browser.call("Log.enable")
        browser.call(
            "Network.emulateNetworkConditions", offline=True, latency=0, downloadThroughput=0, uploadThroughput=0
        )
        browser.call(
            "Emulation.setDeviceMetricsOverride", width=PHONE, height=900, deviceScaleFactor=1, mobile=False
        )
        yield browser


@pytest.mark.slow
@needs_browser
@pytest.mark.parametrize("kind", IN_BROWSER)
def test_a_browser_without_network_draws_it_and_runs_nothing_else(kind, offline, tmp_path):
    path = tmp_path / "report.html"
    html, pictures = written(kind, HOSTILE, tmp_path)
    path.write_text(html, encoding="utf-8")
    for former in (offline.errors, offline.complaints, offline.requests):
        former.clear()
    offline.call("Page.navigate", url=path.as_uri())
    offline.wait_for(f"location.href === '{path.as_uri()}' && document.body.dataset.shown === 'all'")
    assert offline.evaluate("document.querySelectorAll('.plot .main-svg').length > 0") == bool(pictures)
    assert offline.evaluate("[...document.querySelectorAll('.plot')].every(each => each.data.length >= 0)")
    assert offline.evaluate("window.ran === undefined")
    assert offline.evaluate("document.querySelectorAll('iframe, object').length") == 0
    assert "<script>" in offline.evaluate("document.body.innerText"), "it is shown as it was typed"
    assert offline.evaluate("document.scrollingElement.scrollWidth") <= PHONE
    assert brightness(offline, "dark") < 90.0 < 180.0 < brightness(offline, "light")
    assert offline.errors == offline.complaints == []
    assert offline.requests
    assert all(url.startswith(("file://", "data:", "about:", "blob:")) for url in offline.requests)
