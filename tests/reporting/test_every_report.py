"""What holds of every kind of report: sentences, units, text to be read, nothing from outside, nothing run."""

import re
from html import unescape
from html.parser import HTMLParser

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import palpate.reporting.page as page_module
from palpate.reporting.data import KeyFigure
from palpate.reporting.page import PHONE_WIDTH, POLICY, STYLE, report_page, table, text
from palpate.reporting.report import Report, Section, TextTable
from palpate.reporting.style import SMALL_SIZE
from reporting.every_report import KINDS, html_of
from reporting.test_report import parsed
from viewing.browser import needs_browser, page

QUICK = ("runs", "sweep")
IN_BROWSER = [QUICK[0], *(pytest.param(kind, marks=pytest.mark.slow) for kind in KINDS if kind != QUICK[0])]
EVERY = [kind if kind in QUICK else pytest.param(kind, marks=pytest.mark.slow) for kind in KINDS]

SMALLEST = 9.0  # [px] of text in pictures, on a phone
PHONE = 400

HOSTILE = (
    "<script>window.ran=1</script><img src=x onerror='window.ran=1'>\"'><svg onload=window.ran=1>&amp;&lt;"
    "</style></title></textarea>--><style>body{display:none}</style><a href='javascript:window.ran=1'>"
)

UNITLESS = re.compile(
    r"number of|relative|share of|force / |/ normal force|^contacts$|mu|^robot$|^taken for$|^touched$|^Friction$"
)
"""Labels of counts and ratios, and of what is words."""


class Tables(HTMLParser):
    """Rows of tables: class and text of each cell."""

    def __init__(self, html):
        super().__init__()
        self.rows, self._cell = [], None
        self.feed(html)

    def handle_starttag(self, tag, attrs):
        if tag == "tr":
            self.rows.append([])
        elif tag == "td":
            self._cell = [dict(attrs).get("class"), ""]
            self.rows[-1].append(self._cell)

    def handle_endtag(self, tag):
        self._cell = None if tag == "td" else self._cell

    def handle_data(self, data):
        if self._cell is not None:
            self._cell[1] += data


def is_number(told):
    try:
        float(told.replace(" ", ""))
    except ValueError:
        return False
    return True


@pytest.fixture
def pictures(monkeypatch):
    """Every picture that is put into a page meanwhile."""
    seen, card = [], page_module._card
    monkeypatch.setattr(page_module, "_card", lambda picture: seen.append(picture) or card(picture))
    return seen


@pytest.mark.slow
@pytest.mark.parametrize("kind", EVERY)
def test_every_picture_has_a_sentence_units_and_text_that_can_be_read(kind, pictures, tmp_path):
    html = html_of(kind, "A name.", tmp_path)
    assert pictures
    assert html.count("<figcaption>") == html.count("<figure") == len(pictures)
    for picture in pictures:
        assert re.fullmatch(r"\w.{30,}[.]", picture.caption, re.DOTALL), picture.title
        for figure in filter(None, (picture.full, picture.narrow)):
            for axes in figure.axes:
                labels = [axes.get_xlabel(), axes.get_ylabel()]
                assert all("[" in told or UNITLESS.search(told) for told in labels if told), (
                    picture.title,
                    labels,
                )
            small = [
                t.get_text() for t in figure.findobj(lambda each: hasattr(each, "get_fontsize"))
                if t.get_visible() and t.get_text().strip() and t.get_fontsize() < SMALL_SIZE - 1e-9
            ]  # fmt: skip
            assert not small, (picture.title, small)


@pytest.mark.slow
@pytest.mark.parametrize("kind", EVERY)
def test_every_number_has_a_unit_or_says_that_it_has_none(kind, tmp_path):
    counted = 0
    for row in Tables(html_of(kind, "a name", tmp_path)).rows:
        classes = [name for name, _ in row]
        if classes == ["name", "value"]:
            continue  # what was asked: its units stand in the words
        if any(is_number(told) for name, told in row if name == "value"):
            counted += 1
            assert next(told for name, told in row if str(name).startswith("unit")), row
    assert counted


@pytest.mark.slow
@pytest.mark.parametrize("kind", EVERY)
def test_parts_come_in_the_same_order_and_nothing_from_outside(kind, tmp_path):
    html = html_of(kind, "a name", tmp_path)
    order = [html.index(part) for part in ("<h1>", 'class="asked"', 'class="outcome"', "<figure", "What to do")]
    order += [html.index("How to repeat it"), html.index("<footer>")]
    assert order == sorted(order)
    assert not re.search(r"https?://|url\(|@import|<script|<link|javascript:", html)
    assert all(link.startswith("data:image/svg+xml;base64,") for link in parsed(html).links)
    assert POLICY.startswith("default-src 'none'")
    assert POLICY in unescape(html)


@given(typed=st.text(max_size=60) | st.sampled_from([HOSTILE, "\0", "a\u202eb", "x" * 20_000, "${7*7}", "\ud800"]))
@settings(max_examples=60, deadline=None)
def test_whatever_was_typed_is_text(typed):
    """It opens no tag and closes none, and it reads as it was typed, but for what nobody sees."""
    parts = (TextTable(((typed,) * 5,), ("name", "value", "unit", "value", "note"), (typed,) * 5),)
    pairs = ((typed, typed),)
    figures = (KeyFigure(typed, typed, typed, typed),)
    html = report_page(
        Report(typed, typed, figures, (Section(typed, parts),), typed, (typed,), pairs, pairs, typed)
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


def at_width(browser, width):
    browser.call("Emulation.setDeviceMetricsOverride", width=width, height=900, deviceScaleFactor=1, mobile=False)


def in_theme(browser, theme):
    feature = {"name": "prefers-color-scheme", "value": theme}
    browser.call("Emulation.setEmulatedMedia", features=[feature])


def brightness(browser):
    import io

    import numpy as np
    from PIL import Image

    return float(np.asarray(Image.open(io.BytesIO(browser.screenshot())).convert("L")).mean())


@needs_browser
@pytest.mark.parametrize("kind", IN_BROWSER)
def test_a_browser_without_network_shows_it_and_runs_nothing(kind, pictures, tmp_path):
    path, profile = tmp_path / "report.html", tmp_path / "profile"
    # without its policy: what was typed is harmless by itself
    html = html_of(kind, HOSTILE, tmp_path)
    assert POLICY in unescape(html)
    path.write_text(re.sub(r"<meta HTTP-EQUIV.*?>", "", html), encoding="utf-8")
    with page(profile, "about:blank") as browser:
        browser.call("Network.enable")
        browser.call("Log.enable")
        browser.call(
            "Network.emulateNetworkConditions", offline=True, latency=0, downloadThroughput=0, uploadThroughput=0
        )
        at_width(browser, PHONE)
        browser.call("Page.navigate", url=path.as_uri())
        browser.wait_for("document.readyState == 'complete' && document.querySelector('footer') != null")
        browser.wait_for("[...document.images].every(each => each.complete && each.naturalWidth > 0)")
        assert browser.evaluate("window.ran === undefined")
        assert browser.evaluate("document.scripts.length") == 0
        assert browser.evaluate("document.querySelectorAll('a, svg, iframe, object').length") == 0
        assert "<script>" in browser.evaluate("document.body.innerText"), "it is shown as it was typed"
        assert browser.evaluate("document.scrollingElement.scrollWidth") <= PHONE
        shown = browser.evaluate("[...document.images].map(each => each.clientWidth)")
        for width, picture in zip(shown, pictures, strict=True):
            inches = (picture.narrow or picture.full).get_size_inches()[0]
            assert SMALL_SIZE / 72.0 * width / inches >= SMALLEST, picture.title
        light = brightness(browser)
        in_theme(browser, "dark")
        assert brightness(browser) < 90.0 < 180.0 < light
        assert browser.errors == []
        assert browser.complaints == []
        assert all(url.startswith(("file://", "data:", "about:")) for url in browser.requests), browser.requests


@needs_browser
@pytest.mark.slow
def test_pictures_follow_the_theme_and_no_script_is_needed(tmp_path):
    """On a dark page the ground of a picture is dark and its letters light; it is the same with scripts off."""
    import io

    import numpy as np
    from PIL import Image

    path = tmp_path / "report.html"
    path.write_text(html_of("runs", "a name", tmp_path), encoding="utf-8")
    with page(tmp_path / "profile", path.as_uri()) as browser:
        browser.wait_for("document.images.length > 0 && [...document.images].every(each => each.complete)")
        at_width(browser, 1000)
        for theme, ground, letters in (("light", 255, 34), ("dark", 33, 230)):
            in_theme(browser, theme)
            browser.evaluate("document.querySelector('figure').scrollIntoView()")
            seen = np.asarray(Image.open(io.BytesIO(browser.screenshot())).convert("L")).astype(int)
            box = browser.evaluate(
                "(b => [b.left, b.top, b.right, b.bottom])(document.images[0].getBoundingClientRect())"
            )
            left, top, right, bottom = (round(each) for each in box)
            inside = seen[top:bottom, left:right]
            assert np.median(inside) == pytest.approx(ground, abs=3)
            assert (np.abs(inside - letters) < 25).sum() > 100
        browser.call("Emulation.setScriptExecutionDisabled", value=True)
        with_scripts = browser.screenshot()
        browser.call("Page.reload")
        browser.wait_for("document.readyState == 'complete'")
        browser.evaluate("document.querySelector('figure').scrollIntoView()")
        one, other = (
            np.asarray(Image.open(io.BytesIO(each)).convert("L")).astype(int)
            for each in (with_scripts, browser.screenshot())
        )
        assert np.abs(one - other).mean() < 1.0


def test_the_phone_width_is_the_style_sheets():
    assert f"@media (max-width: {PHONE_WIDTH}px)" in STYLE
