"""The view in a real browser: it opens, draws, plots, and the page throws no error."""

import io
import shutil
import threading
import time

import numpy as np
import pytest
from PIL import Image

from palpate.experiments.view_plan import view_scene
from palpate.viewing import ANY_PORT, Player, frames_of_log
from viewing.browser import page

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")

needs_browser = pytest.mark.skipif(CHROMIUM is None, reason="needs chromium (Debian: apt install chromium)")


@needs_browser
@pytest.mark.slow
def test_a_browser_shows_the_run(short_run, tmp_path):
    going = threading.Event()
    with Player(view_scene(short_run.planned), frames_of_log(short_run.log), 4.0, port=ANY_PORT) as player:
        playing = threading.Thread(target=player.play, args=(lambda: not going.is_set(),))
        playing.start()
        try:
            with page(CHROMIUM, tmp_path, player.url) as browser:
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
