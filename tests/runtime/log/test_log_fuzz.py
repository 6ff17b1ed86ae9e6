"""Damaged logs: refused with a reason, or read up to the damage; never a wrong value, never a crash."""

import io
import struct
import tracemalloc
import zlib

import numpy as np
import pytest
import zstandard
from mcap.opcode import Opcode
from mcap.writer import Writer

from palpate.errors import InvalidValueError
from palpate.runtime.log import log_writer as log_writer_module
from palpate.runtime.log import read_log
from runtime.log.log_examples import ONE_FINGER, SMALL, a_run, write


class Original:
    """A whole log, its bytes and everything in it."""

    def __init__(self, path, periods):
        attachments = {"experiment.yaml": f"log: {path}\n" * 5, "versions.yaml": "palpate: 0\n"}
        write(path, periods, attachments)
        self.data, self.log = path.read_bytes(), read_log(path)
        assert (self.log.complete, self.log.attachments) == (True, attachments)
        self.rows = {int(n): row.tobytes() for n, row in zip(self.log.sequence, self.log.rows, strict=True)}
        self.records = list(record_places(self.data))
        assert len(self.records) > 25

    def of(self, opcode):
        """Where records of one kind begin, and where they end."""
        return [(place, place + 9 + length) for place, kind, length in self.records if kind == opcode]

    def bytes_of(self, opcode):
        return [self.data[begin:end] for begin, end in self.of(opcode)]

    def changed(self, place, bits=1):
        """The bytes with some bits of one of them flipped."""
        return self.data[:place] + bytes((self.data[place] ^ bits,)) + self.data[place + 1 :]


@pytest.fixture
def read(tmp_path):
    """Read the log that some bytes are."""

    def written(data):
        (tmp_path / "a.mcap").write_bytes(data)
        return read_log(tmp_path / "a.mcap")

    return written


@pytest.fixture(scope="module")
def originals(tmp_path_factory):
    folder = tmp_path_factory.mktemp("originals")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(log_writer_module, "LARGEST_CHUNK", 1)  # many chunks in a small file
        return [
            Original(folder / f"{i}.mcap", a_run(450, layout, seed=i))
            for i, layout in enumerate((SMALL, SMALL, ONE_FINGER))
        ]


def record_places(data):
    place = 8
    while place < len(data) - 8:
        opcode, length = struct.unpack_from("<BQ", data, place)
        yield place, opcode, length
        place += 9 + length


def flipped(rng, originals):
    """Bits anywhere, or in header, schemas, channels and attachments: the part that a reader trusts most."""
    data = bytearray(originals[0].data)
    end = len(data) if rng.integers(2) else originals[0].of(Opcode.CHUNK)[0][0]
    for place in rng.integers(0, end, rng.integers(1, 4)):
        data[place] ^= 1 << rng.integers(0, 8)
    return bytes(data)


def replaced(rng, originals):
    """A piece cut out, put in, or overwritten, or all behind a place gone."""
    data = originals[0].data
    place, length = rng.integers(0, len(data)), rng.integers(1, 400)
    gone, come = ((length, 0), (0, length), (length, length), (len(data), 0))[rng.integers(4)]
    return data[:place] + rng.bytes(come) + data[place + gone :]


def random_bytes(rng, originals):
    return originals[0].data[: 8 * rng.integers(2)] + rng.bytes(rng.integers(0, 2000))


def spliced(rng, originals):
    """The start of one log and the end of another, anywhere."""
    one, other = rng.choice(len(originals), 2, replace=False)
    a, b = originals[one].data, originals[other].data
    return a[: rng.integers(0, len(a))] + b[rng.integers(0, len(b)) :]


def spliced_at_records(rng, originals):
    """Whole records, with valid check sums, from elsewhere: left out, twice, in another order, of another run."""
    data = originals[0].data
    records = [data[place : place + 9 + length] for place, _, length in originals[0].records]
    for _ in range(rng.integers(1, 4)):
        i, j = rng.integers(0, len(records), 2)
        donor = originals[rng.integers(1, len(originals))]
        place, _, length = donor.records[rng.integers(0, len(donor.records))]
        moved = records.pop(i)
        foreign = donor.data[place : place + 9 + length]
        records[j:j] = ([], [moved], [moved, moved], [foreign, moved])[rng.integers(4)]
    return data[:8] + b"".join(records) + data[-8:]


def forged_lengths(rng, originals):
    data = bytearray(originals[0].data)
    place, _, length = originals[0].records[rng.integers(0, len(originals[0].records))]
    forged = (0, 1, 2**31, 2**40, 2**63, 2**64 - 1, length + 1, max(length - 1, 0))[rng.integers(8)]
    inside = place + 1 + (0, 0, 8, 16, 24, 32, 36, 40, 44)[rng.integers(9)]
    data[inside : inside + 8] = struct.pack("<Q", forged)
    return bytes(data)


KINDS = (flipped, replaced, spliced, spliced_at_records, forged_lengths, random_bytes)


def is_refused_or_right(path, data, originals):
    """Read damaged bytes and check all that comes out; returns whether anything did."""
    path.write_bytes(data)
    try:
        log = read_log(path)
    except InvalidValueError as error:
        if str(error).startswith(f"{path} cannot be read as a log of palpate's: "):
            return False
        raise
    original = next(x for x in originals if x.log.heading == log.heading)
    assert [row.tobytes() for row in log.rows] == [original.rows[int(number)] for number in log.sequence]
    assert (np.diff(log.sequence) > 0).all()
    for found, known in ((log.events, original.log.events), (log.changes, original.log.changes)):
        places = [known.index(x) for x in found]
        assert places == sorted(set(places))
    assert log.attachments.items() <= original.log.attachments.items()
    assert log.complete == (data == original.data)
    assert len(list(log.samples())) == len(list(log.commands())) == len(log.record()) == len(log)
    return True


@pytest.mark.parametrize(("trials", "seed"), [(70, 1), pytest.param(10_000, 2, marks=pytest.mark.slow)])
def test_damaged_logs_are_refused_or_read_up_to_the_damage(tmp_path, originals, trials, seed):
    read = 0
    for trial in range(trials):
        kind = KINDS[trial % len(KINDS)]
        rng = np.random.default_rng((seed, trial))
        try:
            read += is_refused_or_right(tmp_path / "a.mcap", kind(rng, originals), originals)
        except Exception as error:
            raise AssertionError(f"{kind.__name__}, seed {(seed, trial)}") from error
    assert trials / 4 < read < trials  # the damage is not so great that nothing is tested


def test_a_truncated_log_gives_every_whole_chunk_before_the_cut(read, originals):
    rows_before = []
    for _, end in originals[0].of(Opcode.CHUNK):
        whole, torn = (read(originals[0].data[: end + more]) for more in (0, 5))
        assert (whole.damage, whole.complete, len(torn)) == (None, False, len(whole))
        assert torn.damage == f"cut off at byte {end + 5}"
        rows_before.append(len(whole))
    assert rows_before == sorted(rows_before)
    assert rows_before[-1] == 450


def test_a_damaged_chunk_is_left_out_and_those_after_it_are_read(read, originals):
    begin, end = originals[0].of(Opcode.CHUNK)[2]
    log = read(originals[0].changed((begin + end) // 2))
    assert f"the chunk at byte {begin}" in log.damage
    assert (log.complete, log.sequence[-1]) == (False, 449)
    assert sum(gap.count for gap in log.gaps) == 450 - len(log) > 0
    # MCAP allows a check sum of 0 for none; palpate always writes one
    without = read(originals[0].data[: begin + 33] + bytes(4) + originals[0].data[begin + 37 :])
    assert f"the chunk at byte {begin} is damaged (check sum)" in without.damage


@pytest.mark.slow
def test_every_byte_counts(read, originals):
    """A log is complete only as it was written: any byte that differs is noticed, in indexes and summary too."""
    original, rng, noticed = originals[0], np.random.default_rng(3), 0
    size, tail = len(original.data), original.records[-12][0]
    places = [*rng.integers(0, size, 150).tolist(), *rng.integers(tail, size, 60).tolist()]
    for place in places:
        try:
            log = read(original.changed(place, 0x10))
            noticed += log.damage is not None and not log.complete
        except InvalidValueError:
            noticed += 1
    assert noticed == len(places)


@pytest.mark.parametrize("number", range(9))
def test_a_chunk_of_another_run_does_not_pass(number, read, originals):
    """Same layout, same sample times, valid check sums: only the start on the wall clock differs."""
    whole, (ours, theirs) = (
        originals[0].log,
        (original.bytes_of(Opcode.CHUNK)[number] for original in originals[:2]),
    )
    log = read(originals[0].data.replace(ours, theirs))
    assert "do not agree with themselves or with this run's start" in log.damage
    # each chunk holds rows, or an event, or a change
    kept = (len(log) == 450, len(log.events) == len(whole.events), len(log.changes) == len(whole.changes))
    assert sum(kept) == 2


def test_an_attachment_of_another_run_does_not_pass(read, originals):
    ours, theirs = (original.bytes_of(Opcode.ATTACHMENT)[1] for original in originals[:2])
    log = read(originals[0].data.replace(ours, theirs))
    assert "'experiment.yaml'" in log.damage
    assert "is of another run, or comes again" in log.damage
    assert (set(log.attachments), len(log)) == ({"versions.yaml"}, 450)


def forged_chunk(original, frame, size, crc=1):
    """The log with one more chunk in front of its first."""
    body = struct.pack("<QQQII4sQ", 0, 0, size, crc, 4, b"zstd", len(frame)) + frame
    place = original.of(Opcode.CHUNK)[0][0]
    return original.data[:place] + struct.pack("<BQ", Opcode.CHUNK, len(body)) + body + original.data[place:]


def zeros_compressed(size):
    """A frame that says its size, of so many zeros."""
    compressor, piece = zstandard.ZstdCompressor().compressobj(size=size), min(size, 2**24)
    return b"".join([*(compressor.compress(bytes(piece)) for _ in range(size // piece)), compressor.flush()])


@pytest.mark.slow
@pytest.mark.parametrize(
    ("size", "content_size"), [(2**30, 2**30), (1000, 2**30), (2**62, 1000), (2**24, 2**24)], ids=str
)
def test_a_bomb_does_not_go_off(size, content_size, read, originals):
    """Memory is not reserved by the size that a chunk or its frame states."""
    crc = zlib.crc32(bytes(content_size)) if content_size < 2**30 else 1
    data = forged_chunk(originals[0], zeros_compressed(content_size), size, crc)
    tracemalloc.start()
    log = read(data)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 50e6
    assert len(log) == 450
    assert "the chunk at byte" in log.damage


def another_program_s():
    file = io.BytesIO()
    writer = Writer(file)
    writer.start()
    channel = writer.register_channel("/x", "json", writer.register_schema("x", "jsonschema", b"{}"))
    writer.add_message(channel, 0, b"{}", 0)
    writer.finish()
    return file.getvalue()


def with_heading(original, old, new):
    """The log with another word in its heading, and the check sum that belongs to it."""
    (place, end), data = original.of(Opcode.ATTACHMENT)[0], original.data
    assert data.count(old, place, end) == 1
    body = data[place + 9 : end - 4].replace(old, new)
    record = struct.pack("<BQ", Opcode.ATTACHMENT, len(body) + 4) + body + struct.pack("<I", zlib.crc32(body))
    return data[:place] + record + data[end:]


NO_LOGS = {
    "empty": (lambda original: b"", "it is no MCAP file"),
    "CSV": (lambda original: b"time,force\n1,2\n", "it is no MCAP file"),
    "MCAP's magic only": (
        lambda original: original.data[:8],
        r"there is no 'palpate_log\.json' where it should be",
    ),
    "another program's MCAP": (lambda original: another_program_s(), r"there is no 'palpate_log\.json'"),
    # MCAP has no check sum for schemas; the heading does
    "damaged schemas": (
        lambda original: original.data.replace(b"float64 compute_time", b"float32 compute_time", 1),
        "its schemas or channels are damaged",
    ),
    "future format": (
        lambda original: with_heading(original, b'"format": 6', b'"format": 9'),
        "its format is 9, .* reads 6: read it with the palpate that wrote it",
    ),
    "unknown phase": (
        lambda original: with_heading(original, b'"SEEK"', b'"PEEK"'),
        "does not know its Phase 'PEEK'",
    ),
    "no grips": (
        lambda original: with_heading(original, b'"grips": 2', b'"grips": 0'),
        "its heading cannot be understood",
    ),
    "period in words": (
        lambda original: with_heading(original, b'"period": 0.001', b'"period": "slow'),
        "its heading cannot be understood",
    ),
}


@pytest.mark.parametrize(("data", "message"), NO_LOGS.values(), ids=NO_LOGS)
def test_bytes_that_are_no_log_are_refused(data, message, read, originals):
    with pytest.raises(InvalidValueError, match=message):
        read(data(originals[0]))


def test_a_missing_file_is_an_error_of_the_system(tmp_path):
    with pytest.raises(FileNotFoundError):
        read_log(tmp_path / "a.mcap")
