"""Check whether TCP ports are free."""

import socket

PORTS = (30004, 30003, 29999, 49151)
"""Ports of an emulated robot: controller and F/T box."""


def free(address: str, *ports: int) -> bool:
    """Return whether all ports are free."""
    for port in ports:
        with socket.socket() as tried:
            tried.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            try:
                tried.bind((address, port))
            except OSError:
                return False
    return True
