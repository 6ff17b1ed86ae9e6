"""Who may watch a view and drive its run: the view's own page, with its token; so many, and none too slow.

Checked are the pages and the handshake of the WebSocket alike. The token comes with the printed address; a cookie
carries it on, since viser's page opens its socket without the query. `Origin` is checked because browsers send a
cookie to every port of a host, `Host` because a stranger's name may be made to resolve to this computer (DNS
rebinding), and its page is then of the same origin.
"""

import asyncio
import contextlib
import logging
import socket
import threading
from collections.abc import Callable, Iterator
from http import HTTPStatus
from http.cookies import CookieError, SimpleCookie
from ipaddress import ip_address
from typing import Any
from urllib.parse import parse_qs, urlsplit

import websockets.asyncio.server
from websockets.asyncio.server import ServerConnection
from websockets.http11 import Request, Response
from websockets.protocol import State

from palpate.access_token import is_token, new_token

MOST_VIEWERS = 16
"""Pages that are shown at a time; each costs the view's process another copy of every message."""

MOST_WAITING = 32
"""Connections before their handshake; the oldest are closed beyond. Browsers open six per host at a time."""

LARGEST_MESSAGE = 65536
"""Bytes of a message from a page; a camera's take some 300."""

SLOWEST = 20.0
"""A page that takes nothing for so long, while more than 32 KiB wait for it, is disconnected [s]: what websockets
gives it to reply to a ping. A page that does not read would hold up the ping, too."""

EVERYWHERE = ("", "0.0.0.0", "::")
"""Hosts that mean all addresses of this computer."""

_log = logging.getLogger("palpate")

_UNREPORTED = logging.getLogger("palpate.viewing.connections")
"""Where websockets reports each connection that fails: strangers could fill a terminal with it."""
_UNREPORTED.propagate = False
_UNREPORTED.addHandler(logging.NullHandler())

_REPLACING = threading.Lock()


class ViewGuard:
    """Decides on each request to one view.

    Attributes:
        token: What a request must carry.
        refused: How many did not, or came from a foreign page.
        in_force: Whether the view's server asks it.
    """

    def __init__(self, host: str) -> None:
        """Make a token.

        Args:
            host: Address that the view listens on.
        """
        self.token, self.refused, self.in_force = new_token(), 0, False
        self._host = host

    @contextlib.contextmanager
    def installed(self) -> Iterator[None]:
        """Guard the server that viser starts meanwhile.

        viser has no hook for it: for that time, the function of websockets by which it serves is replaced.
        """
        with _REPLACING:
            plain = websockets.asyncio.server.serve

            def serve(*where: Any, process_request: Any, **options: Any) -> Any:
                self.in_force = True
                guarded = {
                    "process_request": lambda connection, asked: self._process(connection, asked, process_request),
                    "create_connection": _BoundedConnection,
                    "max_size": LARGEST_MESSAGE,
                    "logger": _UNREPORTED,
                }
                return plain(*where, **options | guarded)

            websockets.asyncio.server.serve = serve  # type: ignore[assignment,misc]
            try:
                yield
            finally:
                websockets.asyncio.server.serve = plain  # type: ignore[misc]

    def _process(
        self,
        connection: ServerConnection,
        request: Request,
        page: Callable[[ServerConnection, Request], Response | None],
    ) -> Response | None:
        """Refuse a request, or let viser respond."""
        cookie = f"palpate-{connection.local_address[1]}"
        reason = self._objection(request, cookie)
        if reason is not None:
            self.refused += 1
            if self.refused == 1:
                _log.warning("the view refused a request: %s (further ones are counted, not reported)", reason)
            return connection.respond(HTTPStatus.FORBIDDEN, f"Refused: {reason}.\n")
        if len(connection.server.connections) >= MOST_VIEWERS:
            full = f"{MOST_VIEWERS} pages show this view already: close one, then load this again.\n"
            return connection.respond(HTTPStatus.SERVICE_UNAVAILABLE, full)
        response = page(connection, request)
        if response is not None:
            response.headers["Set-Cookie"] = f"{cookie}={self.token}; HttpOnly; SameSite=Strict; Path=/"
            response.headers["Content-Security-Policy"] = "frame-ancestors 'none'"
            response.headers["Referrer-Policy"] = "no-referrer"
        return response

    def _objection(self, request: Request, cookie: str) -> str | None:
        """Return why a request is refused, None if it is not."""
        hosts, origins = request.headers.get_all("Host"), request.headers.get_all("Origin")
        if len(hosts) != 1 or not is_own_host(hosts[0], self._host):
            return f"Host {', '.join(hosts)!r} is not where this view listens; open the address that it printed"
        if any(origin != f"http://{hosts[0]}" for origin in origins):
            return f"Origin {', '.join(origins)!r} is another page's; open the address that the view printed"
        given = parse_qs(urlsplit(request.path).query).get("token", [])
        if not any(is_token(each, self.token) for each in (*given, *_cookies(request, cookie))):
            return "no token, or a wrong one; open the whole address that the view printed, ?token= and all"
        return None


class _BoundedConnection(ServerConnection):
    """Makes room for the next when too many wait, and gives up when its page does not read."""

    _gives_up: asyncio.TimerHandle

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        super().connection_made(transport)
        waiting = [each for each in self.server.handlers if each.state is State.CONNECTING]
        for oldest in waiting[:-MOST_WAITING]:
            oldest.transport.abort()

    def pause_writing(self) -> None:
        super().pause_writing()
        self._gives_up = self.loop.call_later(SLOWEST, self.transport.abort)

    def resume_writing(self) -> None:
        super().resume_writing()
        self._gives_up.cancel()


def is_own_host(header: str, host: str) -> bool:
    """Return whether a request's `Host` names this computer, as far as it listens.

    Of an address in digits nobody else can be the owner; any other name may be made to resolve to it.

    Args:
        header: Name or address, with or without a port: that of a tunnel may be another one.
        host: Address that is listened on.
    """
    try:
        name = urlsplit(f"//{header}").hostname or ""
    except ValueError:
        return False
    if name in ("localhost", host.lower(), socket.gethostname().lower()):
        return True
    try:
        address = ip_address(name)
    except ValueError:
        return False
    return host in EVERYWHERE or (address.is_loopback and _is_loopback(host))


def _is_loopback(host: str) -> bool:
    try:
        return ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"


def _cookies(request: Request, name: str) -> list[str]:
    """Return the values of a cookie; none, if what was sent is no list of cookies."""
    found = []
    for header in request.headers.get_all("Cookie"):
        with contextlib.suppress(CookieError):
            cookies = SimpleCookie(header)
            found += [cookies[name].value] if name in cookies else []
    return found
