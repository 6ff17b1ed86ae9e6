"""How the view looks in a real browser, where it listens, and that what people typed stays text."""

import contextlib
import io
import socket
import threading
from dataclasses import replace
from http.client import HTTPConnection

import numpy as np
import pytest
from PIL import Image
from rich.console import Console

from palpate.commands.view.command import _print_where
from palpate.commands.view.config import ViewConfig
from palpate.runtime import palette
from palpate.viewing import ANY_PORT, LOOPBACK, Player, frames_of_log
from palpate.viewing.look import LOST, legend, linear_rgb, style_sheet
from palpate.viewing.server import ViewServer
from viewing.browser import needs_browser, page

HOSTILE = "<script>window.ran=1</script><img src=x onerror='window.ran=1'>\"'</style> \u202e {1+1} /a/b &amp;"


class Playing:
    """A player that plays while its test lasts."""

    def __init__(self, short_run, title=None):
        scene = short_run.scene
        scene = scene if title is None else replace(scene, title=title)
        self.player = Player(scene, frames_of_log(short_run.log), 4.0, port=ANY_PORT)
        self._going = threading.Event()
        self._thread = threading.Thread(target=self.player.play, args=(lambda: not self._going.is_set(),))

    def __enter__(self):
        self._thread.start()
        return self.player

    def __exit__(self, *told):
        self.stop()

    def stop(self):
        self._going.set()
        self._thread.join()
        self.player.close()


def picture_of(browser):
    return np.asarray(Image.open(io.BytesIO(browser.screenshot())).convert("L")).astype(int)


@needs_browser
@pytest.mark.slow
def test_it_is_dark_for_whom_it_shall_be_and_fits_a_phone(short_run, tmp_path):
    with Playing(short_run) as player, page(tmp_path, player.url) as browser:
        browser.wait_for("document.body.innerText.includes('map points')")
        browser.wait_for("document.body.innerText.includes('force felt, 15 mm per N')")
        light = picture_of(browser)
        feature = {"name": "prefers-color-scheme", "value": "dark"}
        browser.call("Emulation.setEmulatedMedia", features=[feature])
        dark = picture_of(browser)
        assert np.median(dark) < 60 < 200 < np.median(light)
        browser.call(
            "Emulation.setDeviceMetricsOverride", width=400, height=800, deviceScaleFactor=1, mobile=False
        )
        browser.wait_for("document.scrollingElement.scrollWidth <= 400")
        panel = "document.querySelector('.palpate-legend').getBoundingClientRect()"
        browser.wait_for(f"{panel}.right <= 400 && {panel}.left >= 0 && {panel}.width > 150")
        assert browser.errors == []


@needs_browser
@pytest.mark.slow
def test_it_says_when_the_connection_is_lost(short_run, tmp_path):
    playing = Playing(short_run)
    banner = (
        "[...document.querySelectorAll('div')].map(e => getComputedStyle(e, '::before').content)"
        ".filter(told => told.includes('Connection lost')).length"
    )
    with playing as player, page(tmp_path, player.url) as browser:
        browser.wait_for("document.body.innerText.includes('map points')")
        browser.wait_for(f"{banner} === 0")
        playing.stop()
        browser.wait_for(f"{banner} === 1", within=60.0)


@needs_browser
@pytest.mark.slow
def test_what_was_typed_is_text_in_the_browser(short_run, tmp_path):
    with Playing(short_run, HOSTILE) as player, page(tmp_path, player.url) as browser:
        browser.wait_for("document.body.innerText.includes('map points')")
        assert browser.evaluate("document.title") == "palpate"
        assert "<script>window.ran=1</script><img src=x" in browser.evaluate("document.body.innerText")
        assert browser.evaluate("window.ran === undefined")
        assert browser.evaluate("document.querySelectorAll('img[src=x]').length") == 0
        assert browser.errors == []


def other_addresses():
    found = {str(info[4][0]) for info in socket.getaddrinfo(socket.gethostname(), None, socket.AF_INET)}
    return {each for each in found if not each.startswith("127.")}


def reaches(address, port):
    """Ask for the whole page: of a connection that comes as a server stops, asyncio leaves a transport open."""
    try:
        with contextlib.closing(HTTPConnection(address, port, timeout=60.0)) as asking:
            asking.request("GET", "/")
            return bool(asking.getresponse().read())
    except ConnectionRefusedError:
        return False


@pytest.mark.parametrize(("host", "reached"), [(LOOPBACK, False), ("0.0.0.0", True)])
def test_others_reach_it_only_if_that_was_asked_for(host, reached):
    assert ViewConfig("runs/explore").host == LOOPBACK, "--host changes it"
    server = ViewServer("t", host, ANY_PORT)
    try:
        assert reaches(LOOPBACK, server.get_port())
        for address in other_addresses():
            assert reaches(address, server.get_port()) is reached
    finally:
        server.stop()


@pytest.mark.parametrize(
    ("host", "warned"), [(LOOPBACK, False), ("localhost", False), ("0.0.0.0", True), ("::", True)]
)
def test_it_is_said_when_others_can_reach_it(host, warned):
    out = io.StringIO()
    _print_where(Console(file=out, width=200), "http://localhost:1", host, None)
    told = out.getvalue()
    assert "http://localhost:1" in told
    assert ("Everybody who reaches" in told) is warned


def test_what_the_style_sheet_needs_is_in_it():
    sheet = style_sheet()
    assert sheet.count("{") == sheet.count("}")
    assert LOST in sheet
    assert palette.GROUND.dark in sheet
    assert '"' not in LOST, "it stands in quotation marks"
    without, with_map = (legend(0.015, has_map=each) for each in (False, True))
    assert "map" in with_map
    assert "still to go" in with_map
    assert "map" not in without
    assert "still to go" not in without


def test_arrows_shine_as_the_felt_force_is_drawn():
    """viser takes them for linear light: back through the curve of sRGB they are what they shall be."""
    shown = [255.0 * (1.055 * (each / 255.0) ** (1 / 2.4) - 0.055 if each > 1 else 12.92 * each / 255.0)
             for each in linear_rgb(palette.FELT)]  # fmt: skip
    assert shown == pytest.approx(palette.rgb(palette.FELT), abs=3.0)
