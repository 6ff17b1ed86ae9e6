"""The view in a real browser: a played log, a growing surface, a slider; and these tests without a browser."""

import io
import os
import re
import subprocess
import sys
import threading
import time
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from palpate.experiments.explore.experiment import Explore
from palpate.runtime import Ending
from palpate.runtime.live import live_parameters_of
from palpate.viewing import ANY_PORT, LiveView, Player, frames_of_log
from viewing.browser import MISSING, needs_browser, page

HOSTILE = "<script>window.ran=1</script><img src=x onerror='window.ran=1'>\"'</style> \u202e {1+1} /a/b &amp;"
BANNER = (
    "[...document.querySelectorAll('div')].map(e => getComputedStyle(e, '::before').content)"
    ".filter(text => text.includes('Connection lost')).length"
)


@contextmanager
def playing(scene, short_run, speed, **more):
    """Play a log in a thread. Yield the player and a function that stops and closes it."""
    over = threading.Event()
    player = Player(scene, frames_of_log(short_run.log), speed, port=ANY_PORT, **more)
    thread = threading.Thread(target=player.play, args=(lambda: not over.is_set(),))

    def stop():
        over.set()
        thread.join()
        player.close()

    thread.start()
    try:
        yield player, stop
    finally:
        stop()


def figure_of(browser, mode):
    return np.asarray(Image.open(io.BytesIO(browser.screenshot())).convert(mode)).astype(int)


@needs_browser
@pytest.mark.slow
def test_a_browser_shows_a_run_as_text_in_dark_on_a_phone_until_its_connection_is_lost(short_run, tmp_path):
    scene = replace(short_run.scene, title=f"{short_run.scene.title} {HOSTILE}")
    with playing(scene, short_run, 4.0) as (player, stop), page(tmp_path, player.url) as browser:
        for text in ("Exploration of an ellipsoid by touch, stage", "map points", "force felt, 15 mm per N"):
            browser.wait_for(f"document.body.innerText.includes('{text}')")
        browser.wait_for("/t = [1-9]\\.\\d+ s . stop/.test(document.body.innerText)")
        assert browser.evaluate("document.querySelectorAll('.uplot canvas').length") == 2
        assert browser.evaluate("document.title") == "palpate"
        assert "<script>window.ran=1</script><img src=x" in browser.evaluate("document.body.innerText")
        assert browser.evaluate("window.ran === undefined")
        assert browser.evaluate("document.querySelectorAll('img[src=x]').length") == 0

        time.sleep(3.0)  # the scene fades in
        red, _, blue = np.moveaxis(figure_of(browser, "RGB")[:, :900], 2, 0)
        assert ((blue > red + 20) & (blue > 120)).sum() > 20_000, "the object"
        assert ((red > blue + 60) & (red > 150)).sum() > 1000, "the fingertip"

        light = figure_of(browser, "L")
        feature = {"name": "prefers-color-scheme", "value": "dark"}
        browser.call("Emulation.setEmulatedMedia", features=[feature])
        assert np.median(figure_of(browser, "L")) < 60 < 200 < np.median(light)

        browser.call(
            "Emulation.setDeviceMetricsOverride", width=400, height=800, deviceScaleFactor=1, mobile=False
        )
        browser.wait_for("document.scrollingElement.scrollWidth <= 400")
        panel = "document.querySelector('.palpate-legend').getBoundingClientRect()"
        browser.wait_for(f"{panel}.right <= 400 && {panel}.left >= 0 && {panel}.width > 150")
        assert browser.errors == []

        browser.wait_for(f"{BANNER} === 0")
        stop()
        browser.wait_for(f"{BANNER} === 1")


@needs_browser
@pytest.mark.slow
def test_a_browser_shows_the_surface_as_it_grows(short_run, tmp_path):
    """Its colours have a legend with a unit; another colouring has another one."""
    scene = short_run.planned.view()
    with (
        playing(scene, short_run, 10.0, plans=short_run.plans) as (player, _),
        page(tmp_path, player.url) as browser,
    ):
        browser.wait_for("/[0-9.]+ cm² observed . sd/.test(document.body.innerText)")
        text = browser.evaluate("document.body.innerText")
        assert re.search(r"standard deviation\s+[0-9.e-]+ mm", text)
        player.drawing._surface._choice.value = "friction"
        browser.wait_for("document.body.innerText.includes('tangential over normal force')")
        assert browser.errors == []


@needs_browser
@pytest.mark.slow
def test_a_slider_in_the_browser_changes_the_run(live_run, tmp_path):
    """Keys move the slider; the run takes it up, records it, and tells the page, which says when it is over."""
    (planned, run), said = live_run, []
    live = live_parameters_of(run.controller)
    with LiveView(planned.view(), port=ANY_PORT, live=live) as view, page(tmp_path, view.url) as browser:
        browser.wait_for("document.querySelectorAll('[role=slider]').length == 3")

        def meddle():
            browser.wait_for("/now 2 N/.test(document.body.innerText)")
            browser.evaluate("document.querySelectorAll('[role=slider]')[0].focus()")
            for kind in ("keyDown", "keyUp"):
                browser.call("Input.dispatchKeyEvent", type=kind, key="ArrowRight", code="ArrowRight")
            browser.wait_for("/now 2.1 N/.test(document.body.innerText)")
            said.append(browser.evaluate("document.body.innerText"))

        meddling = threading.Thread(target=meddle)
        meddling.start()
        result = run.run((view.observe,))  # in this thread: it listens to signals
        meddling.join()
        view.run_over()
        browser.wait_for("document.body.innerText.includes('the run is over')")
        assert browser.errors == []
    assert "requested: force 2.1 N" in said[0]
    assert result.ending is Ending.DONE, result.trip
    recorded = run.recorded(result)
    (change,) = recorded.changes
    assert (change.name, change.value) == ("force", pytest.approx(2.1))
    assert Explore().evaluate(planned, recorded).set_force[-1] == change.value


TEST = """
from viewing.browser import needs_browser, page

@needs_browser
def test_a_page_opens(tmp_path):
    with page(tmp_path, "about:blank"):
        pass
"""


@pytest.mark.slow
@pytest.mark.parametrize(("ci", "ends"), [("", "1 skipped"), ("true", "1 failed")])
def test_without_a_browser_tests_are_skipped_but_fail_in_ci_and_say_how_to_install_it(ci, ends, tmp_path):
    (tmp_path / "test_page.py").write_text(TEST)
    done = subprocess.run(
        [sys.executable, "-m", "pytest", "-rsf", "-p", "no:cacheprovider", "test_page.py"],
        cwd=tmp_path,
        env={
            **os.environ,
            "PATH": "",
            "CI": ci,
            "PYTHONPATH": str(Path(__file__).parents[1]),
            "PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1",
            "COLUMNS": "200",
        },
        capture_output=True,
        text=True,
        timeout=60,
    )
    assert ends in done.stdout
    assert MISSING in done.stdout.split("short test summary")[1]
    assert "apt-get install chromium" in MISSING
