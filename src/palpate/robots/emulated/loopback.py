"""Where emulated devices listen, and how fast time goes for them."""

import ipaddress

from palpate.errors import InvalidValueError

TIME_SCALES = (0.01, 10.0, "")
"""Least, greatest and unit of the seconds of a robot per second of wall time."""


def loopback_address(key: str, address: str) -> str:
    """Return an address that nobody but this computer reaches.

    Raises:
        InvalidValueError: It is none.
    """
    try:
        inside = ipaddress.IPv4Address(address).is_loopback
    except ValueError:
        inside = False
    if not inside:
        raise InvalidValueError(
            f"{key} = {address!r}: must be an address of this computer's own net, 127.0.0.1 to 127.255.255.254"
        )
    return address
