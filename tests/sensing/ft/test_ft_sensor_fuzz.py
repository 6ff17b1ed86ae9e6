"""Damaged sensor files: each loads to a sensor that can be, or is refused with InvalidValueError."""

import math
import random

import msgspec
import pytest

from palpate.errors import InvalidValueError
from palpate.sensing.ft.sensor_reader import load_sensor_file, read_sensor
from palpate.sensing.ft.sensor_writer import sensor_text
from sensing.ft.sensor_examples import fingertip

TEXT = sensor_text(fingertip())
# fmt: off
WORDS = (
    ".nan", "-.inf", "1e999", "-1", "0", "1e-320", "9" * 26, "9" * 5000, "true", "no", "null", "~", "", "''",
    "[]", "{}", "[1,2,3]", "{a: 1}", "*x", "&x", "!!int", "!!timestamp", "!!binary",
    "!!python/object:os.system", "-", ":", "?", "|", ">", "%", "@", "`", "\t", "0x1F", "1_000", "12:30:45",
    "2026-11-21", "<<", '"\\ud83d"', '"\\x00"', "\ufeff", "\u2028", "é", "---", "...",
)
# fmt: on


def mutated_bytes(rng):
    data = bytearray(TEXT.encode())
    for _ in range(rng.choice((1, 1, 2, 5, 50))):
        data[rng.randrange(len(data))] = rng.randrange(256)
    return bytes(data)


def truncated(rng):
    data = TEXT.encode()
    start = rng.randrange(len(data)) if rng.random() < 0.2 else 0
    return data[start : rng.randrange(len(data) + 1)]


def swapped_lines(rng):
    lines = TEXT.splitlines()
    for _ in range(rng.randrange(1, 4)):
        i, j = rng.randrange(len(lines)), rng.randrange(len(lines))
        if rng.random() < 0.5:
            lines[i], lines[j] = lines[j], lines[i]
        else:
            lines.insert(i, lines[j])
    return "\n".join(lines).encode()


def swapped_values(rng):
    lines = TEXT.splitlines()
    for _ in range(rng.randrange(1, 3)):
        i = rng.randrange(len(lines))
        cut = rng.choice((":", "[", ",", "- "))
        if cut in lines[i]:
            head, _, tail = lines[i].partition(cut)
            rest = tail.partition(",")[2] if rng.random() < 0.5 else ""
            lines[i] = f"{head}{cut} {rng.choice(WORDS)}{',' if rest else ''}{rest}"
    return "\n".join(lines).encode("utf-8", "surrogatepass")


def inserted(rng):
    i = rng.randrange(len(TEXT))
    return (TEXT[:i] + rng.choice(WORDS) + TEXT[i + rng.randrange(3) :]).encode()


KINDS = (mutated_bytes, truncated, swapped_lines, swapped_values, inserted)


def numbers(value):
    if isinstance(value, float):
        yield value
    elif isinstance(value, dict):
        for item in value.values():
            yield from numbers(item)
    elif isinstance(value, list | tuple):
        for item in value:
            yield from numbers(item)


def try_files(count, seed, path):
    """Return how many loaded and how many were refused; anything else raises."""
    rng = random.Random(seed)
    loaded = refused = 0
    for k in range(count):
        data = KINDS[k % len(KINDS)](rng)
        path.write_bytes(data)
        try:
            sensor = load_sensor_file(path)
        except InvalidValueError as error:
            str(error).encode()  # can be shown: no lone surrogates
            refused += 1
            continue
        assert all(map(math.isfinite, numbers(msgspec.to_builtins(sensor)))), data
        assert read_sensor(sensor_text(sensor)) == sensor, data
        loaded += 1
    return loaded, refused


@pytest.mark.slow
def test_500_damaged_files_are_loaded_or_refused(tmp_path):
    loaded, refused = try_files(500, 1, tmp_path / "sensor.yaml")
    # Both must happen, or the fuzzer tries only one side.
    assert loaded > 25
    assert refused > 250


@pytest.mark.slow
def test_10000_damaged_files_are_loaded_or_refused(tmp_path):
    loaded, refused = try_files(10_000, 2, tmp_path / "sensor.yaml")
    assert loaded + refused == 10_000
