"""The view in a real browser: it opens, draws, plots, and the page throws no error."""

import io
import re
import threading
import time

import numpy as np
import pytest
from PIL import Image

from palpate.runtime.live import live_parameters_of
from palpate.viewing import ANY_PORT, LiveView, Player, frames_of_log
from viewing.browser import needs_browser, page


@needs_browser
@pytest.mark.slow
def test_a_browser_shows_the_run(short_run, tmp_path):
    going = threading.Event()
    with Player(short_run.scene, frames_of_log(short_run.log), 4.0, port=ANY_PORT) as player:
        playing = threading.Thread(target=player.play, args=(lambda: not going.is_set(),))
        playing.start()
        try:
            with page(tmp_path, player.url) as browser:
                browser.wait_for("document.body.innerText.includes('Exploration of an ellipsoid, stage')")
                browser.wait_for("document.body.innerText.includes('map points')")
                browser.wait_for("/t = [1-9]\\.\\d+ s . stop/.test(document.body.innerText)")
                assert browser.evaluate("document.querySelectorAll('.uplot canvas').length") == 2
                time.sleep(3.0)  # the scene fades in
                shot = browser.screenshot()
                assert browser.errors == []
        finally:
            going.set()
            playing.join()
    picture = np.asarray(Image.open(io.BytesIO(shot)).convert("RGB")).astype(int)[:, :900]
    red, blue = picture[..., 0], picture[..., 2]
    bluish, orange = (blue > red + 20) & (blue > 120), (red > blue + 60) & (red > 150)
    assert bluish.sum() > 20_000, "the object"
    assert orange.sum() > 1000, "the fingertip"


@needs_browser
@pytest.mark.slow
def test_a_browser_shows_the_surface_as_it_grows(short_run, tmp_path):
    """Its colours have a legend with a unit; another colouring has another one."""
    scene = short_run.planned.view()
    plans, going = short_run.plans, threading.Event()
    with Player(scene, frames_of_log(short_run.log), 10.0, port=ANY_PORT, plans=plans) as player:
        playing = threading.Thread(target=player.play, args=(lambda: not going.is_set(),))
        playing.start()
        try:
            with page(tmp_path, player.url) as browser:
                browser.wait_for("/[0-9.]+ cm² observed . sd/.test(document.body.innerText)", within=120.0)
                text = browser.evaluate("document.body.innerText")
                assert re.search(r"standard deviation\s+[0-9.e-]+ mm", text)
                player.drawing._surface._choice.value = "friction"
                browser.wait_for("document.body.innerText.includes('tangential over normal force')")
                assert browser.errors == []
        finally:
            going.set()
            playing.join()


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
    assert said
    assert "requested: force 2.1 N" in said[0]
    (change,) = run.recorded(result).changes
    assert (change.name, change.value) == ("force", pytest.approx(2.1))
