"""CRC-16/X25: polynomial 0x1021, initial and final 0xFFFF, reflected (ITU-T X.25; of "123456789": 906E)."""


def _table() -> tuple[int, ...]:
    entries = []
    for byte in range(256):
        value = byte
        for _ in range(8):
            value = value >> 1 ^ (0x8408 if value & 1 else 0)  # 0x1021, reflected
        entries.append(value)
    return tuple(entries)


_TABLE = _table()


def crc16_x25(data: bytes | bytearray | memoryview) -> int:
    """Return the checksum of `data`."""
    value = 0xFFFF
    for byte in data:
        value = value >> 8 ^ _TABLE[(value ^ byte) & 0xFF]
    return value ^ 0xFFFF
