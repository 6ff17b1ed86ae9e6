"""The web server of a view: viser, kept to what a view is for."""

import contextlib
import errno
import io
import json
import socket

import viser

from palpate.errors import InvalidValueError, PalpateError
from palpate.viewing.guard import EVERYWHERE, ViewGuard

LOOPBACK = "127.0.0.1"
"""Reachable from this machine alone."""

USUAL_PORT = 8080
"""viser's own."""

ANY_PORT = 0
"""Whichever is free."""


class ViewUnavailableError(PalpateError, OSError):
    """The view cannot be served; the message has the reason and the remedy."""


class ViewServer(viser.ViserServer):
    """A server that prints nothing, takes the port it was given or none, stays on its host, and has a guard."""

    def __init__(self, label: str, host: str = LOOPBACK, port: int = USUAL_PORT) -> None:
        """Start serving.

        Args:
            label: Over the panel and on the browser's tab; shown as plain text.
            host: Address to listen on.
            port: Where; `ANY_PORT` for one that is free.

        Raises:
            ViewUnavailableError: The port is taken, or requests cannot be checked.
            InvalidValueError: There is no such port, or the address is not this machine's.
        """
        if not 0 <= port <= 65535:
            raise InvalidValueError(f"port = {port}: must be from 1 to 65535, or 0 for one that is free")
        check_host(host)
        # viser goes on to the next port without a word, and tries a thousand of them
        free = free_port(host, port)
        self.guard = ViewGuard(host)
        with contextlib.redirect_stdout(io.StringIO()), self.guard.installed():
            super().__init__(host=host, port=free, label=label, verbose=False)
        if self.get_port() != free:
            self.stop()
            raise ViewUnavailableError(_taken(host, free))
        if not self.guard.in_force:
            self.stop()
            raise ViewUnavailableError(f"viser {viser.__version__}: its requests cannot be checked; install 1.1.1")
        self._host_shown = host
        self._name_tab(label)

    @property
    def url(self) -> str:
        """What to open in a browser; whoever has it may drive the run."""
        host = "localhost" if self._host_shown in EVERYWHERE else self._host_shown
        return f"http://{f'[{host}]' if ':' in host else host}:{self.get_port()}/?token={self.guard.token}"

    def request_share_url(self, verbose: bool = True) -> str | None:
        """Refuse: any page could ask for a tunnel to the internet, past the host that was chosen."""
        return None

    def _name_tab(self, name: str) -> None:
        """Name the browser's tab: viser calls it Viser, and has no public method to change that."""
        with contextlib.suppress(ImportError, AttributeError):  # of another version: then it stays so
            from viser._messages import RunJavascriptMessage

            self._websock_server.queue_message(RunJavascriptMessage(f"document.title = {json.dumps(name)}"))

    def stop(self) -> None:
        """Stop serving, without a word; may be called more than once."""
        with contextlib.redirect_stdout(io.StringIO()):
            super().stop()


def check_host(host: str) -> None:
    """Refuse an address that this machine does not have: unlike a port that is taken, it can never be right.

    Raises:
        InvalidValueError: It has none such.
    """
    try:
        family, kind, protocol, _, address = socket.getaddrinfo(host or None, ANY_PORT, type=socket.SOCK_STREAM)[0]
        with socket.socket(family, kind, protocol) as probe:
            probe.bind(address)
    except (OSError, UnicodeError) as error:  # the latter of names that no network can have
        reason = getattr(error, "strerror", None) or "no name of a host"
        raise InvalidValueError(
            f"host = {host!r}: {reason}; {LOOPBACK} serves this machine alone, 0.0.0.0 everybody in the network"
        ) from None


def free_port(host: str, port: int) -> int:
    """Return the port, or a free one for `ANY_PORT`."""
    try:
        family, kind, protocol, _, address = socket.getaddrinfo(host or None, port, type=socket.SOCK_STREAM)[0]
        with socket.socket(family, kind, protocol) as probe:
            probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)  # as the server will
            probe.bind(address)
            return int(probe.getsockname()[1])
    except OSError as error:
        if error.errno == errno.EADDRINUSE:
            raise ViewUnavailableError(_taken(host, port)) from None
        if error.errno == errno.EACCES:
            raise ViewUnavailableError(
                f"port = {port}: no permission to listen there; take one from 1024 on"
            ) from None
        raise ViewUnavailableError(f"host = {host!r}, port = {port}: {error.strerror}") from None


def _taken(host: str, port: int) -> str:
    return (
        f"port {port} on {host} is in use, by another view perhaps: close that, or choose another port "
        "(--port; 0 takes one that is free)"
    )
