"""The page that draws pictures: surfaces turn, colourings switch, times zoom together, steps are played."""

import base64

import numpy as np
import pytest

from palpate.reporting.figure import TIME, Axis, Figure, Panel, Space
from palpate.reporting.marks import Colouring, Dash, Line, Moving, Rule
from palpate.reporting.page import write_report
from palpate.reporting.plots import plots
from palpate.reporting.report import Figures, Report, Section
from palpate.reporting.solids import Arrows, Surface
from viewing.browser import needs_browser, page

T = np.linspace(0.0, 8.0, 801)
FORCE = Figure(
    "Force",
    "It swings about the set force.",
    tuple(Panel((Line(T, np.sin(T), "felt"), Rule(0.5, upright=False, dash=Dash.DASHED)), TIME, y)
          for y in (Axis("force", "N"), Axis("speed", "mm/s"))),
    wide=True,
)  # fmt: skip
VERTICES = np.array([[0.0, 0.0, 0.0], [0.01, 0.0, 0.0], [0.0, 0.01, 0.002], [0.01, 0.01, 0.0]])
HEIGHT = Colouring("height", 1e3 * VERTICES[:, 2], "mm")
FRICTION = Colouring("friction", np.array([0.3, 0.4, np.nan, 0.5]))
SURFACE = Figure(
    "Surface",
    "What was felt, and how the force turned.",
    (
        Space((Surface(VERTICES, np.array([[0, 1, 2], [1, 3, 2], [0, 1, 3]]), "map", (HEIGHT, FRICTION)),)),
        Panel((Moving(np.arange(3.0), np.arange(3.0), "now"),), Axis("x", "mm"), Axis("y", "mm")),
        Space((Arrows(np.zeros((3, 1, 3)), 0.01 * np.eye(3)[:, None], "force"),)),
    ),
    steps=("first", "second", "third"),
    step=1,
)
FREQUENCY = Axis("frequency", "Hz", logarithmic=True)
BODE = Figure(
    "Bode",
    "Level gain is good.",
    tuple(Panel((Line(T + 1.0, -T),), FREQUENCY, y) for y in (Axis("gain", "dB"), Axis("phase", "degrees"))),
)
REPORT = Report("A title", "Done.", (), (Section("Seen", (Figures(lambda: (FORCE, SURFACE, BODE)),)),))


def dragged(browser, selector, across):
    """Drag the mouse from the middle of an element by so many pixels."""
    browser.evaluate(f"document.querySelector('{selector}').scrollIntoView({{block: 'center'}})")
    x, y = browser.evaluate(
        f"(b => [b.left + b.width / 2, b.top + b.height / 2])"
        f"(document.querySelector('{selector}').getBoundingClientRect())"
    )
    for kind, at in (("mousePressed", x), ("mouseMoved", x + 0.5 * across), ("mouseMoved", x + across)):
        browser.call("Input.dispatchMouseEvent", type=kind, x=at, y=y, button="left", buttons=1, clickCount=1)
    browser.call("Input.dispatchMouseEvent", type="mouseReleased", x=x + across, y=y, button="left", clickCount=1)


@needs_browser
@pytest.mark.slow
def test_a_reader_turns_zooms_switches_and_plays(tmp_path):
    write_report(REPORT, tmp_path / "report.html")
    with page(tmp_path / "profile", (tmp_path / "report.html").as_uri()) as browser:
        browser.call("Log.enable")
        browser.call("Network.enable")
        browser.wait_for("document.body.dataset.shown === 'all'")
        plot = "document.querySelectorAll('.plot')"
        dragged(browser, ".plot .nsewdrag", 200)
        browser.wait_for(f"{plot}[0].layout.xaxis.range[1] < 7.5")
        browser.wait_for(f"{plot}[1].layout.xaxis.range.join() === {plot}[0].layout.xaxis.range.join()")
        dragged(browser, '[data-figure="2"] .nsewdrag', 100)
        browser.wait_for(f"{plot}[6].layout.xaxis.range.join() === {plot}[5].layout.xaxis.range.join()")
        assert browser.evaluate(f"{plot}[0].layout.xaxis.range[1]") > 1.0, "it has another axis"
        eye = f"JSON.stringify({plot}[2]._fullLayout.scene._scene.getCamera().eye)"
        before = browser.evaluate(eye)
        dragged(browser, ".gl-container canvas", 120)
        browser.wait_for(f"{eye} !== {before!r}")
        browser.evaluate("(s => { s.value = 'friction'; s.onchange(); })(document.querySelector('select'))")
        browser.wait_for(f"{plot}[2].data[0].colorbar.title.text === 'friction'")
        known = browser.evaluate(f"{plot}[2].data.map((each) => each.i.length)")
        assert known == [1, 2], "triangles of which a corner is not known have no colour"
        assert browser.evaluate(f"{plot}[3].data[0].x[0]") == 1.0
        browser.evaluate("(s => { s.value = 2; s.oninput(); })(document.querySelector('input[type=range]'))")
        browser.wait_for(f"{plot}[3].data[0].x[0] === 2")
        assert "third" in browser.evaluate("document.querySelector('output').textContent")
        assert browser.errors == browser.complaints == []
        assert all(url.startswith(("file:", "data:", "blob:")) for url in browser.requests)


def test_what_is_drawn_has_the_numbers_in_millimetres_and_the_colours_of_roles():
    surface, moving, arrows = plots(SURFACE)
    x = np.frombuffer(base64.b64decode(surface["data"][0]["x"]["bdata"]), dtype="<f4")
    np.testing.assert_allclose(x, 1e3 * VERTICES[:, 0])
    assert [each["quantity"] for each in surface["extras"][0]["colourings"]] == ["height", "friction"]
    assert moving["extras"][0]["moving"].keys() == {"x", "y"}
    assert len(arrows["extras"][0]["meshes"]) == len(SURFACE.steps)
    assert plots(FORCE)[0]["data"][0]["line"]["color"] == "role:felt"


@pytest.mark.slow
def test_a_paper_has_one_file_for_each_picture_and_colouring(tmp_path):
    written = write_report(REPORT, tmp_path / "report.html", "pdf").files[1:]
    assert [each.name for each in written] == [
        "force.pdf",
        "surface-height.pdf",
        "surface-friction.pdf",
        "bode.pdf",
    ]
    assert all(each.read_bytes().startswith(b"%PDF") for each in written)
    again = [each.read_bytes() for each in written]
    once_more = write_report(REPORT, tmp_path / "report.html", "pdf")
    assert once_more.files[1:] == written
    assert once_more.failures == ()
    assert again == [each.read_bytes() for each in written]
