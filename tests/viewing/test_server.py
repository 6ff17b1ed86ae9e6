"""The view's server: where it listens, who gets in, what it sends, how its processes end. Real sockets."""

import contextlib
import http.client
import io
import os
import socket
import subprocess
import sys
import urllib.error
import urllib.request
from urllib.parse import urlsplit

import pytest
import viser
import zstandard
from rich.console import Console
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import connect

from palpate.commands.view.command import _print_address
from palpate.commands.view.config import ViewConfig
from palpate.errors import InvalidValueError
from palpate.viewing import ANY_PORT, LOOPBACK, LiveView, ViewScene, ViewUnavailableError, guard
from palpate.viewing.guard import LARGEST_MESSAGE, MOST_VIEWERS, MOST_WAITING, ViewGuard, is_own_host
from palpate.viewing.server import ViewServer
from support.waiting import WITHIN, process_ended, until
from viewing.browser import needs_browser, page

PROTOCOL = f"viser-v{viser.__version__}"


@contextlib.contextmanager
def served(title="t", host=LOOPBACK):
    made = ViewServer(title, host, ANY_PORT)
    try:
        yield made
    finally:
        made.stop()


@pytest.fixture
def server():
    with served() as made:
        yield made


def opened(url):
    """Open the WebSocket of a view."""
    return connect(url.replace("http", "ws", 1), subprotocols=[PROTOCOL], compression=None, max_size=None)


def messages_until(url, wanted):
    """Return the decoded messages to a browser until a text occurs in them."""
    received = bytearray()
    with opened(url) as client:
        until(lambda: received.extend(decoded(client.recv(timeout=60.0))) or wanted in received)
    return bytes(received)


def decoded(part):
    """viser's wire format: two lengths, compressed messages, then arrays as they are."""
    compressed = int.from_bytes(part[8:16], "little")
    return zstandard.ZstdDecompressor().decompress(part[16 : 16 + compressed])


def page_status(server, path="/", headers=(), address=LOOPBACK):
    """Return status and headers of a request for the page; the status is 0 if the connection is refused.

    The whole page is read: of a connection that comes as a server stops, asyncio leaves a transport open.
    """
    try:
        with contextlib.closing(http.client.HTTPConnection(address, server.get_port(), timeout=60.0)) as asking:
            asking.request("GET", path, headers=dict(headers))
            reply = asking.getresponse()
            assert reply.read()
            return reply.status, reply.headers
    except ConnectionRefusedError:
        return 0, {}


@pytest.mark.parametrize(
    ("host", "reached"), [(LOOPBACK, False), ("localhost", False), ("0.0.0.0", True), ("::", True)]
)
def test_other_machines_reach_it_only_on_request_and_the_command_warns_of_it(host, reached):
    assert ViewConfig("runs/explore").host == LOOPBACK, "--host changes it"
    console = Console(file=io.StringIO(), width=200, record=True)
    _print_address(console, "http://localhost:1", host, None)
    shown = console.export_text()
    assert "http://localhost:1" in shown
    assert ("Everyone who reaches" in shown) is reached
    if host in (LOOPBACK, "0.0.0.0"):
        with served(host=host) as server:
            assert page_status(server)[0]
            for info in socket.getaddrinfo(socket.gethostname(), None, socket.AF_INET):
                address = str(info[4][0])
                assert bool(page_status(server, address=address)[0]) is (reached or address.startswith("127."))


def test_it_serves_the_page_on_this_machine_and_no_other_files(server):
    assert server.get_host() == "127.0.0.1"
    with urllib.request.urlopen(server.url) as page:
        assert b"<html" in page.read().lower()
    for path in ("/../../../../../../etc/passwd", "/%2e%2e/%2e%2e/_viser.py"):
        with pytest.raises(urllib.error.HTTPError, match="404"):
            urllib.request.urlopen(server.url.replace("/?", f"{path}?"))
    assert server.request_share_url() is None


@pytest.mark.slow
def test_a_port_in_use_is_reported_and_not_evaded(capsys):
    with socket.create_server((LOOPBACK, 0)) as taken:
        port = taken.getsockname()[1]
        with pytest.raises(ViewUnavailableError, match=rf"port {port} on 127.0.0.1 is in use.*--port"):
            ViewServer("t", port=port)
        with pytest.raises(ViewUnavailableError, match="in use"):
            LiveView(ViewScene("t", ()), port=port)
    assert capsys.readouterr().out == ""


@pytest.mark.parametrize(
    ("address", "message"),
    [
        ({"host": "192.0.2.1", "port": ANY_PORT}, r"192\.0\.2\.1.*127\.0\.0\.1 serves this machine alone"),
        ({"port": 70000}, "port = 70000"),
        ({"host": "a" * 70 + ".example", "port": ANY_PORT}, "no name of a host"),
    ],
)
def test_an_address_of_another_machine_is_refused(address, message):
    with pytest.raises(InvalidValueError, match=message):
        ViewServer("t", **address)


def test_the_tab_has_the_name_of_the_view_and_closing_frees_the_port_without_a_word(capfd):
    with served('t "quoted" <b>') as server:
        port = server.get_port()
        assert b'document.title = "t \\"quoted\\" <b>"' in messages_until(server.url, b"ReplayDone")
        server.stop()
    ViewServer("t", port=port).stop()
    assert capfd.readouterr() == ("", "")


def socket_status(server, path, headers):
    """What the handshake of a WebSocket gets."""
    host = headers.get("Host", f"127.0.0.1:{server.get_port()}")
    more = {name: value for name, value in headers.items() if name != "Host"}
    try:
        with (
            socket.create_connection(("127.0.0.1", server.get_port())) as through,
            connect(f"ws://{host}{path}", sock=through, subprotocols=[PROTOCOL], additional_headers=more),
        ):
            return 101
    except InvalidStatus as refused:
        return refused.response.status_code


REFUSED = (
    ("", {}),
    ("?token=", {}),
    ("?token=guessed", {}),
    ("?token=%ff%00", {}),
    ("", {"Cookie": "palpate-{port}=guessed"}),
    ("", {"Cookie": "palpate-1={token}"}),
    ("?token={token}", {"Host": "evil.example:{port}"}),
    ("?token={token}", {"Host": "192.0.2.1:{port}"}),
    ("?token={token}", {"Host": "127.0.0.1.evil.example"}),
    ("?token={token}", {"Origin": "http://evil.example"}),
    ("?token={token}", {"Origin": "null"}),
    ("?token={token}", {"Origin": "http://127.0.0.1:1"}),
    ("", {"Cookie": "palpate-{port}={token}", "Origin": "http://localhost:{port}"}),
)
"""Query and headers without the token, of another host, or of a page from another origin."""


def test_another_page_or_another_token_is_refused_and_reported_once(server, caplog):
    known = {"port": server.get_port(), "token": server.guard.token}
    for count, (query, headers) in enumerate(REFUSED, 1):
        path = "/" + query.format(**known)
        sent = {name: value.format(**known) for name, value in headers.items()}
        assert page_status(server, path, sent)[0] == 403, (query, headers)
        assert socket_status(server, path, sent) == 403, (query, headers)
        assert server.guard.refused == 2 * count
        assert len(caplog.records) == 1


@pytest.mark.parametrize("name", ["127.0.0.1", "localhost"])
def test_the_token_gets_in_and_a_cookie_carries_it_on(server, name):
    origin = f"{name}:{server.get_port()}"
    status, headers = page_status(server, f"/?token={server.guard.token}", {"Host": origin})
    assert status == 200
    cookie = headers["Set-Cookie"]
    assert "HttpOnly" in cookie
    assert "SameSite=Strict" in cookie
    sent = {"Host": origin, "Origin": f"http://{origin}", "Cookie": f"other=1; {cookie.split(';')[0]}"}
    assert socket_status(server, "/", sent) == 101
    assert page_status(server, "/", {"Cookie": sent["Cookie"]})[0] == 200
    assert server.guard.refused == 0


@pytest.mark.parametrize(
    ("header", "host", "own"),
    [
        ("localhost:8080", "127.0.0.1", True),
        ("LOCALHOST", "127.0.0.1", True),
        ("[::1]:8080", "::1", True),
        ("127.0.0.1:9000", "127.0.0.1", True),  # the near end of a tunnel
        ("10.0.0.5:8080", "127.0.0.1", False),
        ("10.0.0.5:8080", "0.0.0.0", True),
        ("10.0.0.5:8080", "10.0.0.5", True),
        ("10.0.0.6:8080", "10.0.0.5", False),
        (f"{socket.gethostname()}:8080", "0.0.0.0", True),
        ("evil.example", "0.0.0.0", False),
        ("evil.example", "", False),
        ("", "0.0.0.0", False),
        ("[", "0.0.0.0", False),
    ],
)
def test_a_name_that_others_can_make_resolve_here_is_not_ours(header, host, own):
    assert is_own_host(header, host) is own


def test_every_view_has_a_token_of_its_own_and_is_not_served_without_its_guard(monkeypatch):
    assert len({ViewGuard("127.0.0.1").token for _ in range(100)}) == 100
    monkeypatch.setattr(ViewGuard, "installed", contextlib.nullcontext)
    with pytest.raises(ViewUnavailableError, match="cannot be checked"):
        ViewServer("t", port=ANY_PORT)


def test_viewers_are_so_many_and_one_more_gets_a_sentence(server):
    with contextlib.ExitStack() as viewers:
        for _ in range(MOST_VIEWERS):
            viewers.enter_context(opened(server.url))
        with pytest.raises(InvalidStatus) as refused:
            opened(server.url)
        assert refused.value.response.status_code == 503
        assert b"close one" in refused.value.response.body
    until(lambda: socket_status(server, f"/?token={server.guard.token}", {}) == 101)


@pytest.mark.slow
def test_connections_that_never_finish_a_request_make_room(server):
    address = ("127.0.0.1", server.get_port())
    with contextlib.ExitStack() as silent:
        waiting = [silent.enter_context(socket.create_connection(address, timeout=WITHIN)) for _ in range(300)]
        for each in waiting:
            with contextlib.suppress(OSError):
                each.sendall(b"GET / HTTP/1.1\r\nX-")
        with opened(server.url) as viewer:
            assert viewer.recv(timeout=WITHIN)
        for each in waiting[: -MOST_WAITING - 1]:
            with contextlib.suppress(ConnectionResetError):
                assert each.recv(1) == b""


def test_a_message_that_is_too_large_ends_its_connection(server):
    with opened(server.url) as viewer:
        viewer.send(b"\x00" * (LARGEST_MESSAGE + 1))
        with contextlib.suppress(ConnectionClosed):
            until(lambda: viewer.recv(timeout=WITHIN) is None)
        assert viewer.close_code == 1009


def test_a_page_that_does_not_read_is_disconnected(server, monkeypatch):
    monkeypatch.setattr(guard, "SLOWEST", 0.0)
    url = urlsplit(server.url)
    with socket.create_connection((url.hostname, url.port), timeout=WITHIN) as lazy:
        lazy.sendall(
            f"GET /?{url.query} HTTP/1.1\r\nHost: {url.netloc}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
            f"Sec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\nSec-WebSocket-Version: 13\r\n"
            f"Sec-WebSocket-Protocol: {PROTOCOL}\r\n\r\n".encode()
        )
        assert b"101" in lazy.recv(100)
        live = server._websock_server._live_connections
        until(lambda: len(live) == 1)
        text = server.gui.add_html("")

        def gone():
            text.content = os.urandom(500_000).hex()
            return not live

        until(gone)


@needs_browser
@pytest.mark.slow
def test_a_browser_lets_the_own_page_in_and_another_port_of_the_host_not(tmp_path, server):
    """Cookies go to every port of a host: what keeps another server's page out is its origin."""
    socket_of = f"new WebSocket('ws://{urlsplit(server.url).netloc}/', '{PROTOCOL}')"
    asked = (
        f"window.asked = 'waits'; s = {socket_of}; s.onopen = () => asked = 'in'; s.onerror = () => asked = 'out'"
    )
    with served("other") as other, page(tmp_path, "about:blank") as browser:
        for url, title, state, refused in ((server.url, "t", "in", 0), (other.url, "other", "out", 1)):
            browser.call("Page.navigate", url=url)
            browser.wait_for(f"document.title === '{title}'")  # it came over the WebSocket
            browser.evaluate(asked)
            browser.wait_for(f"window.asked === '{state}'")
            assert server.guard.refused == refused


@pytest.mark.slow
def test_a_live_view_shows_a_run_and_closes_cleanly(short_run):
    with LiveView(short_run.scene, port=ANY_PORT) as view:
        for period in short_run.periods:
            view.observe(*period)
        assert b"/contact_force" in messages_until(view.url, b"/map/chunk_0")
        assert view.is_alive
        process = view._process
    assert process.exitcode == 0
    with pytest.raises(OSError, match="refused"):
        urllib.request.urlopen(view.url)
    view.close()


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
    until(lambda: process_ended(int(done.stdout)))
