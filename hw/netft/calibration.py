"""What a count of the box is worth: asked of the box itself, since it depends on the calibration that it runs."""

import socket
import struct
from dataclasses import dataclass
from time import monotonic

from palpate.hw.devices import DeviceError, WireError
from palpate.hw.netft.rdt import CALIBRATION, CALIBRATION_REQUEST, HEADER
from palpate.hw.netft.settings import Scales

POUND_FORCE = 4.4482216152605
"""[N], exactly: 0.45359237 kg times 9.80665 m/s^2 (NIST SP 811, appendix B.8)."""

INCH = 0.0254
"""[m], exactly."""

KILOGRAM_FORCE = 9.80665
"""[N], exactly."""

FORCE_UNITS = {
    1: POUND_FORCE,
    2: 1.0,
    3: 1000.0 * POUND_FORCE,
    4: 1000.0,
    5: KILOGRAM_FORCE,
    6: 0.001 * KILOGRAM_FORCE,
}
"""Newtons per unit: lb, N, klb, kN, kg, g."""

TORQUE_UNITS = {
    1: POUND_FORCE * INCH,
    2: POUND_FORCE * 12.0 * INCH,
    3: 1.0,
    4: 0.001,
    5: KILOGRAM_FORCE * 0.01,
    6: 1000.0,
}
"""Newton metres per unit: lb-in, lb-ft, N m, N mm, kg-cm, kN m."""


@dataclass(frozen=True, slots=True)
class BoxCalibration:
    """The calibration that a box reports.

    Attributes:
        force_unit: Its code, a key of `FORCE_UNITS`.
        torque_unit: Its code, a key of `TORQUE_UNITS`.
        counts_per_force: Per unit.
        counts_per_torque: Per unit.
    """

    force_unit: int
    torque_unit: int
    counts_per_force: int
    counts_per_torque: int

    @property
    def scales(self) -> Scales:
        """Of a count, in SI."""
        return Scales(
            FORCE_UNITS[self.force_unit] / self.counts_per_force,
            TORQUE_UNITS[self.torque_unit] / self.counts_per_torque,
        )


def parse_calibration(reply: bytes) -> BoxCalibration:
    """Return the calibration in a reply.

    Raises:
        ValueError: It is no such reply, or its values are impossible; the message names what is wrong.
    """
    try:
        header, force, torque, per_force, per_torque, *_ = CALIBRATION.unpack(reply)
    except struct.error:
        raise ValueError(f"{len(reply)} bytes, not {CALIBRATION.size}") from None
    if header != HEADER:
        raise ValueError(f"it begins with {header:#06x}, not {HEADER:#06x}")
    if force not in FORCE_UNITS or torque not in TORQUE_UNITS:
        raise ValueError(f"units {force} and {torque} are none of the table")
    if not per_force or not per_torque:
        raise ValueError(f"{per_force} counts per force, {per_torque} per torque")
    return BoxCalibration(force, torque, per_force, per_torque)


def ask_calibration(name: str, address: str, port: int, patience: float) -> BoxCalibration:
    """Return the calibration that a box runs now.

    Args:
        name: Of the device, for messages.
        address: Of the box.
        port: Of its TCP interface, `CALIBRATION_PORT` on every real one.
        patience: For all of it [s].

    Raises:
        DeviceError: It cannot be reached, is silent, or sends something else.
    """
    deadline, reply = monotonic() + patience, b""
    try:
        with socket.create_connection((address, port), patience) as wire:
            wire.sendall(CALIBRATION_REQUEST)
            while len(reply) < CALIBRATION.size:
                wire.settimeout(max(1e-3, deadline - monotonic()))
                more = wire.recv(CALIBRATION.size - len(reply))
                if not more:
                    break
                reply += more
    except ConnectionRefusedError:
        raise WireError(
            name, f"nobody listens on TCP port {port}", "is it a Net F/T box? For others give their scales instead"
        ) from None
    except TimeoutError:
        raise WireError(
            name,
            f"no reply on TCP port {port} within {patience:g} s{_received(reply)}",
            "check power, cable and IP addresses",
        ) from None
    except OSError as error:
        raise WireError(name, error.strerror or str(error), "check cable and IP addresses") from None
    if len(reply) < CALIBRATION.size:
        raise DeviceError(
            name,
            f"it closed the connection on TCP port {port} before its calibration was complete{_received(reply)}",
            "see that it is a Net F/T box and that nobody else asks it, then try again",
        )
    try:
        return parse_calibration(reply)
    except ValueError as problem:
        raise DeviceError(
            name, f"its calibration is useless: {problem}", "choose a configuration on its web page"
        ) from None


def _received(reply: bytes) -> str:
    return f", received {reply.hex(' ')}" if reply else ""
