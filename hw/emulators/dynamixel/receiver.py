"""Packets out of a stream of bytes, however torn and noisy."""

from dataclasses import dataclass

from palpate.hw.dynamixel.packets import FORBIDDEN, HEADER, OVERHEAD, checksum, unstuffed

LONGEST = 1024
"""Length field that is still believed; the client library sends no longer packets (RXPACKET_MAX_LEN)."""

FRAME_TIMEOUT = 0.1
"""How long the rest of a packet is waited for [s]; assumed. A bus at 9600 baud needs it."""


@dataclass(frozen=True, slots=True)
class RequestPacket:
    """A packet with a right checksum.

    Attributes:
        servo_id: For whom it is.
        instruction: Its code, which may mean nothing.
        parameters: As meant, without stuffing.
    """

    servo_id: int
    instruction: int
    parameters: bytes


class PacketReceiver:
    """Collects bytes and gives back whole packets; `rejected` counts those whose checksum was wrong."""

    def __init__(self) -> None:
        """Begin with nothing."""
        self._bytes = bytearray()
        self._last = 0.0
        self.rejected = 0

    def feed(self, data: bytes, now: float) -> list[RequestPacket]:
        """Take what has arrived and return the packets that are complete.

        Args:
            data: Bytes.
            now: Time [s]; a packet torn in the middle is given up after a pause.
        """
        held = self._bytes
        if now - self._last > FRAME_TIMEOUT:
            held.clear()
        self._last = now
        held += data
        found: list[RequestPacket] = []
        while True:
            start = held.find(HEADER[:3])
            if start < 0:
                del held[:-2]
                return found
            del held[:start]
            if len(held) < OVERHEAD:
                return found
            length = int.from_bytes(held[5:7], "little")
            if held[3] != 0 or not 3 <= length <= LONGEST:
                del held[:3]
                continue
            whole = OVERHEAD + length
            # where another header begins, this packet was torn: its own content has none
            torn = held.find(FORBIDDEN, OVERHEAD, whole - 2)
            while torn >= 0 and held[torn + 3 : torn + 4] == b"\xfd":
                torn = held.find(FORBIDDEN, torn + 4, whole - 2)
            if 0 <= torn < len(held) - 3:
                del held[:torn]
                self.rejected += 1
                continue
            if len(held) < whole:
                return found
            if checksum(held[: whole - 2]) != int.from_bytes(held[whole - 2 : whole], "little"):
                self.rejected += 1
                del held[:3]
                continue
            content = unstuffed(bytes(held[OVERHEAD : whole - 2]))
            found.append(RequestPacket(held[4], content[0], content[1:]))
            del held[:whole]
