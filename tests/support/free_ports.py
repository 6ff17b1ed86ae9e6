"""Whether TCP ports can be had: nobody listens there."""

import socket

PORTS = (30004, 30003, 29999, 49151)
"""Of an emulated robot: its controller's and its F/T box's."""


def free(address: str, *ports: int) -> bool:
    """Return whether all of them can."""
    for port in ports:
        with socket.socket() as tried:
            tried.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            try:
                tried.bind((address, port))
            except OSError:
                return False
    return True
