"""Clients without a token that hold connections until they are killed; imports nothing heavy.

`connections.py` starts it: python benchmarks/wire/foreign_clients.py COUNT HOST:PORT [HOST:PORT ...]
"""

import os
import resource
import sys
from contextlib import suppress
from socket import create_connection, socket
from time import sleep


def main() -> None:
    """Connect, print a line, send one byte a second; connect again if closed."""
    resource.setrlimit(resource.RLIMIT_NOFILE, (4096, 4096))
    os.setpriority(os.PRIO_PROCESS, 0, 19)
    ports = [(host, int(port)) for host, port in (each.rsplit(":", 1) for each in sys.argv[2:])]
    held: list[socket | None] = [None] * int(sys.argv[1])
    while True:
        for i, one in enumerate(held):
            try:
                held[i] = stayed(one or come(ports[i % len(ports)]))
            except OSError:
                held[i] = None
        print("here", flush=True)
        sleep(1.0)


def come(where: tuple[str, int]) -> socket:
    """Begin a request without a token."""
    one = create_connection(where, 1.0)
    one.sendall(b"GET / HTTP/1.1\r\nX-")
    one.setblocking(False)
    return one


def stayed(one: socket) -> socket | None:
    """Send another byte; None if the other side has closed."""
    one.send(b"a")
    with suppress(BlockingIOError):
        if not one.recv(4096):
            one.close()
            return None
    return one


if __name__ == "__main__":
    main()
