"""Who gets into a view: real sockets, and a real browser for pages of one's own and of others."""

import contextlib
import http.client
import os
import socket
from urllib.parse import urlsplit

import pytest
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import connect

from palpate.viewing import ANY_PORT, ViewUnavailableError, guard
from palpate.viewing.guard import LARGEST_MESSAGE, MOST_VIEWERS, MOST_WAITING, ViewGuard, is_own_host
from palpate.viewing.server import ViewServer
from support.waiting import WITHIN, until
from viewing.browser import needs_browser, page
from viewing.test_server import PROTOCOL


@pytest.fixture
def server():
    made = ViewServer("t", port=ANY_PORT)
    yield made
    made.stop()


def page_status(server, path, headers):
    """What a request for the page gets: status and headers."""
    with contextlib.closing(http.client.HTTPConnection("127.0.0.1", server.get_port(), timeout=60.0)) as asking:
        asking.request("GET", path, headers=headers)
        reply = asking.getresponse()
        return reply.status, reply.headers


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


@pytest.mark.parametrize(
    ("query", "headers"),
    [
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
    ],
)
def test_another_page_or_another_token_is_refused(server, query, headers, caplog):
    known = {"port": server.get_port(), "token": server.guard.token}
    path, sent = "/" + query.format(**known), {name: value.format(**known) for name, value in headers.items()}
    for _ in range(2):
        assert page_status(server, path, sent)[0] == 403
        assert socket_status(server, path, sent) == 403
    assert server.guard.refused == 4
    assert len(caplog.records) == 1, "reported once"


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


def test_every_view_has_a_token_of_its_own():
    assert len({ViewGuard("127.0.0.1").token for _ in range(100)}) == 100


def test_without_its_guard_a_view_is_not_served(monkeypatch):
    monkeypatch.setattr(ViewGuard, "installed", contextlib.nullcontext)
    with pytest.raises(ViewUnavailableError, match="cannot be checked"):
        ViewServer("t", port=ANY_PORT)


def opened(server):
    return connect(server.url.replace("http", "ws", 1), subprotocols=[PROTOCOL], compression=None, max_size=None)


def test_viewers_are_so_many_and_one_more_gets_a_sentence(server):
    with contextlib.ExitStack() as viewers:
        for _ in range(MOST_VIEWERS):
            viewers.enter_context(opened(server))
        with pytest.raises(InvalidStatus) as refused:
            opened(server)
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
        with opened(server) as viewer:
            assert viewer.recv(timeout=WITHIN)
        for each in waiting[: -MOST_WAITING - 1]:
            with contextlib.suppress(ConnectionResetError):
                assert each.recv(1) == b""


def test_a_message_that_is_too_large_ends_its_connection(server):
    with opened(server) as viewer:
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
    other = ViewServer("other", port=ANY_PORT)
    try:
        with page(tmp_path, server.url) as browser:
            browser.wait_for("document.title === 't'")  # it came over the WebSocket
            browser.evaluate(asked)
            browser.wait_for("window.asked === 'in'")
            assert server.guard.refused == 0
            browser.call("Page.navigate", url=other.url)
            browser.wait_for("document.title === 'other'")
            browser.evaluate(asked)
            browser.wait_for("window.asked === 'out'")
            assert server.guard.refused == 1
    finally:
        other.stop()
