"""Damage to valid examples, as whoever knows their format would do it; the same seed gives the same bytes."""

import re
import struct
import zlib
from collections.abc import Sequence

import numpy as np
import zstandard

NUMBER = re.compile(rb"[-+]?\d+\.?\d*(?:[eE][-+]?\d+)?")
EXTREMES = (
    b"1e308 -1e308 5e-324 nan inf -inf 0 -0.0 -1 1e-9 7e12 9223372036854775808 4294967296 .nan .inf " + b"9" * 400
)
TOKENS = (
    *EXTREMES.split(),
    b"null",
    b"true",
    b"1_000",
    b"0x10",
    b"",
    b"\x1b[2J",
    "\u202e".encode(),
    b"=cmd|' /C calc'!A0",
)
OPENINGS = (
    b"[",
    b"{",
    b"- ",
    b"? ",
    b"&a ",
    b"{a: ",
    b"[[],",
    b'"',
    b"a: ",
    b",",
    b"\n",
    b"*a ",
    b"!!x ",
    b"#\n",
    b"f 1 2 3\n",
)
SIZES = (0, 1, 255, 65535, 2**31 - 1, 2**31, 2**32 - 1, 2**40, 2**63 - 1, 2**63, 2**64 - 1)
LONGEST = 1 << 26
"""Bytes of an input: twice what any reader takes."""


def damaged(kind: str, examples: Sequence[bytes], seed: tuple[int, int]) -> bytes:
    """Return an example with one to four kinds of damage."""
    rng = np.random.default_rng(seed)
    data = examples[rng.integers(len(examples))]
    ways = {"text": TEXT, "binary": BINARY, "log": LOG}[kind]
    for _ in range(rng.integers(1, 5)):
        data = ways[rng.integers(len(ways))](rng, data, examples)[:LONGEST]
    return data


def _place(rng, data):
    return int(rng.integers(len(data) + 1))


def flipped(rng, data, _):
    changed = bytearray(data)
    for place in rng.integers(0, max(1, len(data)), rng.integers(1, 8)):
        if place < len(changed):
            changed[place] ^= 1 << int(rng.integers(8))
    return bytes(changed)


def cut(rng, data, _):
    return data[: _place(rng, data)]


def left_out(rng, data, _):
    place = _place(rng, data)
    return data[:place] + data[place + int(rng.integers(1, 200)) :]


def spliced(rng, data, examples):
    other = examples[rng.integers(len(examples))]
    return data[: _place(rng, data)] + other[_place(rng, other) :]


def repeated(rng, data, _):
    """A piece again and again: mostly some thousand bytes, sometimes more than is read."""
    place, length = _place(rng, data), int(rng.integers(1, 80))
    most = 10 ** rng.uniform(2.0, 4.5 if rng.random() < 0.995 else 7.8)
    return data[:place] + data[place : place + length] * int(most / length) + data[place:]


def extreme_number(rng, data, _):
    found = list(NUMBER.finditer(data[:100_000]))
    if not found:
        return data
    one = found[rng.integers(len(found))]
    return data[: one.start()] + TOKENS[rng.integers(len(TOKENS))] + data[one.end() :]


def nested(rng, data, _):
    place, count = _place(rng, data), int(10 ** rng.uniform(0.0, 4.0))
    return data[:place] + OPENINGS[rng.integers(len(OPENINGS))] * count + data[place:]


def swapped_lines(rng, data, _):
    lines = data.split(b"\n")
    i, j = rng.integers(len(lines), size=2)
    lines[i], lines[j] = lines[j], lines[i]
    return b"\n".join(lines)


def forged_size(rng, data, _):
    """A count or length, of two, four or eight bytes, mostly where headers are."""
    letter, width = (("<H", 2), ("<I", 4), ("<Q", 8), (">I", 4))[rng.integers(4)]
    place = int(rng.integers(min(len(data), 100 if rng.integers(2) else len(data)) + 1))
    size = SIZES[rng.integers(len(SIZES))] % (1 << (8 * width))
    return data[:place] + struct.pack(letter, size) + data[place + width :]


def extreme_float(rng, data, _):
    letter = ("<f", "<d")[rng.integers(2)]
    value = (float("nan"), float("inf"), -0.0, 1e-40, 3e38)[rng.integers(5)]
    place = _place(rng, data)
    return data[:place] + struct.pack(letter, value) + data[place + struct.calcsize(letter) :]


def forged_record(rng, data, examples):
    """A record of a log, its content damaged, with check sums that are right again."""
    records = list(_records(data))
    if not records:
        return data
    place, opcode, body = records[rng.integers(len(records))]
    ways = (flipped, left_out, repeated, forged_size, extreme_float, extreme_number)
    way = ways[rng.integers(len(ways))]
    try:
        if opcode == 9:
            new = way(rng, body[:-4], examples)
            new += struct.pack("<I", zlib.crc32(new))
        elif opcode == 6:
            content = zstandard.ZstdDecompressor().decompress(body[44:], max_output_size=1 << 24)
            content = way(rng, content, examples)
            packed = zstandard.ZstdCompressor().compress(content)
            new = body[:16] + struct.pack("<QI", len(content), zlib.crc32(content)) + body[28:36]
            new += struct.pack("<Q", len(packed)) + packed
        else:
            new = way(rng, body, examples)
    except (zstandard.ZstdError, struct.error):
        return data
    return data[:place] + struct.pack("<BQ", opcode, len(new)) + new + data[place + 9 + len(body) :]


def doubled_record(rng, data, _):
    records = list(_records(data))
    if not records:
        return data
    place, opcode, body = records[rng.integers(len(records))]
    count = int(10 ** rng.uniform(0.0, 3.0))
    return data[:place] + (struct.pack("<BQ", opcode, len(body)) + body) * count + data[place:]


def _records(data):
    place = 8
    while place + 9 <= len(data) - 8:
        opcode, length = struct.unpack_from("<BQ", data, place)
        if place + 9 + length > len(data):
            return
        yield place, opcode, data[place + 9 : place + 9 + length]
        place += 9 + length


BYTES = (flipped, cut, left_out, spliced, repeated)
TEXT = (*BYTES, extreme_number, extreme_number, nested, swapped_lines)
BINARY = (*BYTES, forged_size, forged_size, extreme_float, extreme_number, nested)
LOG = (*BYTES, forged_size, forged_record, forged_record, forged_record, doubled_record)
