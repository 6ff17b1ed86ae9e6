"""Raw data transfer (RDT) on the wire: requests, records, the reply with the calibration. Big-endian.

Source: ATI's Net F/T manual, 9620-05-Net FT, "UDP interface using RDT" and "TCP interface".
"""

from enum import IntEnum
from struct import Struct

HEADER = 0x1234
"""Begins every request, and the reply with the calibration."""

RDT_PORT = 49152
"""UDP: requests and records."""

CALIBRATION_PORT = 49151
"""TCP: the calibration."""

REQUEST = Struct(">HHI")
"""Header, command, number of records (0: without end)."""

RECORD = Struct(">III6i")
"""rdt_sequence, ft_sequence, status, then Fx Fy Fz Tx Ty Tz in counts."""

CALIBRATION_REQUEST = bytes([1]) + bytes(19)
"""Asks for the calibration."""

CALIBRATION = Struct(">HBBII6H")
"""Header, unit of force, unit of torque, counts per force, counts per torque, scales of 16-bit values."""


class RdtCommand(IntEnum):
    """What is asked of an ATI box."""

    STOP = 0
    STREAM = 2
    """One record per datagram, as sampled."""
    STREAM_BUFFERED = 3
    """Several records per datagram."""
    STREAM_MULTI_UNIT = 4
    RESET_LATCH = 0x41
    """Of the monitor condition."""
    BIAS = 0x42
    """Take the present load for zero, in the box."""


class OnRobotCommand(IntEnum):
    """What else is asked of an OnRobot box, which bends `RdtCommand.BIAS` to on (255) and off (0)."""

    FILTER = 0x81
    """0: none; 1 to 6: 500, 150, 50, 15, 5, 1.5 Hz."""
    PERIOD = 0x82
    """Between records [ms]."""
