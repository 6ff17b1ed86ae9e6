"""The view's server and what it serves: real sockets, real processes, no browser."""

import contextlib
import os
import signal
import socket
import subprocess
import sys
import urllib.error
import urllib.request

import numpy as np
import psutil
import pytest
import viser
import zstandard
from websockets.sync.client import connect

from palpate.errors import InvalidValueError
from palpate.viewing import ANY_PORT, LiveView, Player, ViewScene, ViewUnavailableError, frames_of_log
from palpate.viewing.server import ViewServer
from support.waiting import until

PROTOCOL = f"viser-v{viser.__version__}"


@pytest.fixture
def player(short_run):
    with Player(short_run.scene, frames_of_log(short_run.log), port=ANY_PORT) as made:
        yield made


def heard(url, wanted):
    """What a browser would be told, until a text occurs in it."""
    said = bytearray()
    with connect(url.replace("http", "ws", 1), subprotocols=[PROTOCOL], compression=None, max_size=None) as client:
        until(lambda: said.extend(decoded(client.recv(timeout=60.0))) or wanted in said)
    return bytes(said)


def decoded(part):
    """viser's wire format: two lengths, compressed messages, then arrays as they are."""
    compressed = int.from_bytes(part[8:16], "little")
    return zstandard.ZstdDecompressor().decompress(part[16 : 16 + compressed])


def map_points(player):
    chunks = [player.server.scene.get_handle_by_name(f"/map/chunk_{i}") for i in range(100)]
    return np.concatenate([np.empty((0, 3)), *(chunk.points for chunk in chunks if chunk is not None)])


def test_a_log_is_in_the_scene(player, short_run):
    frames = frames_of_log(short_run.log)
    player.step(1e9)
    assert player.time == pytest.approx(frames.time[-1] - frames.time[0])
    points = map_points(player)
    assert len(points) > 50
    assert np.abs(short_run.planned.target.signed_distance(points.astype(float))).max() < 2e-4
    assert player.server.scene.get_handle_by_name("/body_0").position == pytest.approx(frames.position[-1])
    said = heard(player.url, b"/map/chunk_0")
    for name in (b"/body_0/part_", b"/part_1", b"/contact_force_0"):
        assert name in said


def test_the_arrow_is_the_contact_force(player, short_run):
    frames = frames_of_log(short_run.log)
    middle = int(np.flatnonzero(frames.finger(0).touching)[len(frames) // 3])
    arrow = player.server.scene.get_handle_by_name("/contact_force_0")
    assert not arrow.visible, "nothing is touched at the beginning"
    player.step(float(frames.time[middle] - frames.time[0]) + 1e-9)
    assert arrow.visible
    start, end = arrow.position + arrow.points[0]
    assert start == pytest.approx(frames.centroid[middle], abs=1e-6)
    force = (end - start) / 0.015
    assert force == pytest.approx(frames.force[middle], abs=1e-3)
    assert force[2] > 1.5, "the object pushes the finger up"


def test_winding_back_takes_the_map_back(player):
    player.step(1.5)
    player.drawing.refresh(player._frames[:1])
    early = map_points(player)
    assert len(early) > 10
    player.step(1e9)
    player._slider.value = 1.5
    player.step(0.03)
    assert player.time == 1.5
    player.drawing.refresh(player._frames[:1])
    assert map_points(player) == pytest.approx(early)


def test_stopped_is_stopped(player):
    player._playing.value = False
    player.step(1.0)
    assert player.time == 0.0


def test_speed_is_speed(short_run):
    scene, frames = short_run.scene, frames_of_log(short_run.log)
    with Player(scene, frames, speed=2.5, port=ANY_PORT) as player:
        player.step(0.2)
        assert player.time == pytest.approx(0.5)


@pytest.mark.parametrize("speed", [0.0, -1.0, float("nan")])
def test_impossible_speeds(short_run, speed):
    with pytest.raises(InvalidValueError, match="speed"):
        Player(short_run.scene, frames_of_log(short_run.log), speed, port=ANY_PORT)


def test_an_empty_log_has_nothing_to_show(short_run):
    with pytest.raises(InvalidValueError, match="no periods"):
        Player(short_run.scene, frames_of_log(short_run.log)[:0], port=ANY_PORT)


def test_what_people_typed_is_text(short_run):
    scene = ViewScene("<img src=x onerror=alert(1)> {1+1} /a/b", ())
    with Player(scene, frames_of_log(short_run.log), port=ANY_PORT) as player:
        said = heard(player.url, b"onerror")
    assert b"&lt;img src=x" in said
    assert b"<img" not in said


def test_it_listens_on_this_machine_alone():
    server = ViewServer("t", port=ANY_PORT)
    try:
        assert server.get_host() == "127.0.0.1"
        with urllib.request.urlopen(server.url) as page:
            assert b"<html" in page.read().lower()
        others = [str(i[4][0]) for i in socket.getaddrinfo(socket.gethostname(), None, socket.AF_INET)]
        for address in {a for a in others if not a.startswith("127.")}:
            with socket.socket() as outside:
                outside.settimeout(2.0)
                assert outside.connect_ex((address, server.get_port())) != 0
        for path in ("/../../../../../../etc/passwd", "/%2e%2e/%2e%2e/_viser.py"):
            with pytest.raises(urllib.error.HTTPError, match="404"):
                urllib.request.urlopen(server.url.replace("/?", f"{path}?"))
        assert server.request_share_url() is None
    finally:
        server.stop()


@pytest.mark.slow
def test_a_port_in_use_is_told_and_not_evaded(capsys):
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        with pytest.raises(ViewUnavailableError, match=rf"port {port} on 127.0.0.1 is in use.*--port"):
            ViewServer("t", port=port)
        with pytest.raises(ViewUnavailableError, match="in use"):
            LiveView(ViewScene("t", ()), port=port)
    assert capsys.readouterr().out == ""


def test_a_host_that_is_not_ours_is_told():
    with pytest.raises(InvalidValueError, match=r"192\.0\.2\.1.*127\.0\.0\.1 serves this machine alone"):
        ViewServer("t", host="192.0.2.1", port=ANY_PORT)
    with pytest.raises(InvalidValueError, match="port = 70000"):
        ViewServer("t", port=70000)


def test_a_host_without_a_name_is_told():
    with pytest.raises(InvalidValueError, match=r"no name of a host"):
        ViewServer("t", host="a" * 70 + ".example", port=ANY_PORT)


def test_the_tab_has_the_name_of_the_view():
    server = ViewServer('t "quoted" <b>', port=ANY_PORT)
    try:
        assert b'document.title = "t \\"quoted\\" <b>"' in heard(server.url, b"document.title")
    finally:
        server.stop()


def test_closing_frees_the_port_without_a_word(capfd):
    server = ViewServer("t", port=ANY_PORT)
    port = server.get_port()
    heard(server.url, b"ReplayDone")
    server.stop()
    server.stop()
    again = ViewServer("t", port=port)
    again.stop()
    out, err = capfd.readouterr()
    assert (out, err) == ("", "")


@pytest.mark.slow
def test_a_live_view_shows_a_run_and_closes_cleanly(short_run):
    with LiveView(short_run.scene, port=ANY_PORT) as view:
        for period in short_run.periods:
            view.observe(*period)
        said = heard(view.url, b"/map/chunk_0")
        assert b"/contact_force" in said
        assert view.is_alive
        process = view._process
    assert process.exitcode == 0
    with pytest.raises(OSError, match="refused"):
        urllib.request.urlopen(view.url)
    view.close()


@pytest.mark.slow
def test_a_view_that_dies_does_not_disturb_the_loop(short_run):
    with LiveView(short_run.scene, port=ANY_PORT) as view:
        os.kill(view._process.pid, signal.SIGKILL)
        view.wait()
        for period in short_run.periods[:100]:
            view.observe(*period)
        assert not view.is_alive


PROGRAM = """
import os
from palpate.viewing import LiveView, ViewScene
if __name__ == "__main__":
    view = LiveView(ViewScene("t", ()), port=0)
    print(view._process.pid, flush=True)
    os._exit(0)  # as if it had crashed
"""


@pytest.mark.slow
def test_a_view_does_not_outlive_a_loop_that_crashed(tmp_path):
    program = tmp_path / "program.py"
    program.write_text(PROGRAM)
    done = subprocess.run([sys.executable, str(program)], capture_output=True, text=True, timeout=60)
    until(lambda: ended(int(done.stdout)))


def ended(pid):
    with contextlib.suppress(psutil.NoSuchProcess):
        return psutil.Process(pid).status() == psutil.STATUS_ZOMBIE
    return True
