"""Damaged logs: refused with a reason, or read up to the damage; never a wrong value, never a crash."""

import struct
import tracemalloc
import zlib

import numpy as np
import pytest
import zstandard
from mcap.opcode import Opcode
from mcap.writer import Writer

from palpate.errors import InvalidValueError
from palpate.runtime.log import LogWriter, Recorder, read_log
from palpate.runtime.log import log_writer as log_writer_module
from runtime.log.log_examples import ONE_FINGER, PERIOD, SMALL, a_run, feed


class Original:
    """A whole log, its bytes and everything in it."""

    def __init__(self, path, periods):
        attachments = {"experiment.yaml": f"log: {path}\n" * 5, "versions.yaml": "palpate: 0\n"}
        recorder = Recorder(LogWriter(path, attachments))
        recorder.start(periods[0][0], periods[0][1], PERIOD)
        feed(recorder, periods)
        recorder.close()
        self.data = path.read_bytes()
        self.log = read_log(path)
        assert self.log.complete
        assert self.log.attachments == attachments
        self.rows = {int(n): row.tobytes() for n, row in zip(self.log.sequence, self.log.rows, strict=True)}
        self.records = list(record_places(self.data))
        assert len(self.records) > 25


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


def truncated(rng, originals):
    data = originals[0].data
    return data[: rng.integers(0, len(data))]


def flipped(rng, originals):
    data = bytearray(originals[0].data)
    for place in rng.integers(0, len(data), rng.integers(1, 4)):
        data[place] ^= 1 << rng.integers(0, 8)
    return bytes(data)


def flipped_at_the_start(rng, originals):
    """Header, schemas, channels, attachments: the part that a reader trusts most."""
    data = bytearray(originals[0].data)
    chunk = next(place for place, opcode, _ in originals[0].records if opcode == Opcode.CHUNK)
    data[rng.integers(0, chunk)] ^= 1 << rng.integers(0, 8)
    return bytes(data)


def overwritten(rng, originals):
    data = bytearray(originals[0].data)
    place, length = rng.integers(0, len(data)), rng.integers(1, 400)
    data[place : place + length] = rng.bytes(length)
    return bytes(data)


def cut_or_grown(rng, originals):
    data = originals[0].data
    place, length = rng.integers(0, len(data)), rng.integers(1, 400)
    if rng.integers(2):
        return data[:place] + data[place + length :]
    return data[:place] + rng.bytes(length) + data[place:]


def spliced(rng, originals):
    """The start of one log and the end of another, anywhere."""
    one, other = rng.choice(len(originals), 2, replace=False)
    a, b = originals[one].data, originals[other].data
    return a[: rng.integers(0, len(a))] + b[rng.integers(0, len(b)) :]


def spliced_at_records(rng, originals):
    """Whole records, with valid check sums, from elsewhere: left out, twice, in another order, of another run."""
    records = [data[place : place + 9 + length] for data, place, length in all_records(rng, originals)]
    for _ in range(rng.integers(1, 4)):
        i, j = rng.integers(0, len(records), 2)
        what = rng.integers(0, 4)
        if what == 0:
            del records[i]
        elif what == 1:
            records.insert(i, records[j % len(records)])
        elif what == 2:
            records[i], records[j] = records[j], records[i]
        else:
            donor = originals[rng.integers(1, len(originals))]
            place, _, length = donor.records[rng.integers(0, len(donor.records))]
            records.insert(i, donor.data[place : place + 9 + length])
    data = originals[0].data
    return data[:8] + b"".join(records) + data[-8:]


def all_records(rng, originals):
    return [(originals[0].data, place, length) for place, _, length in originals[0].records]


def forged_lengths(rng, originals):
    data = bytearray(originals[0].data)
    place, _, length = originals[0].records[rng.integers(0, len(originals[0].records))]
    forged = (0, 1, 2**31, 2**40, 2**63, 2**64 - 1, length + 1, max(length - 1, 0))[rng.integers(8)]
    inside = place + 1 + (0, 0, 8, 16, 24, 32, 36, 40, 44)[rng.integers(9)]
    data[inside : inside + 8] = struct.pack("<Q", forged)
    return bytes(data)


def random_bytes(rng, originals):
    data = rng.bytes(rng.integers(0, 2000))
    return originals[0].data[:8] + data if rng.integers(2) else data


KINDS = (
    truncated,
    flipped,
    flipped_at_the_start,
    overwritten,
    cut_or_grown,
    spliced,
    spliced_at_records,
    forged_lengths,
    random_bytes,
)


def is_refused_or_right(path, data, originals):
    """Read damaged bytes and check all that comes out; returns whether anything did."""
    path.write_bytes(data)
    try:
        log = read_log(path)
    except InvalidValueError as error:
        reason = str(error)
        log = None
    if log is None:
        assert reason.startswith(f"{path} cannot be read as a log of palpate's: ")
        return False
    original = next(x for x in originals if x.log.heading == log.heading)
    for number, row in zip(log.sequence, log.rows, strict=True):
        assert row.tobytes() == original.rows[int(number)]
    assert (np.diff(log.sequence) > 0).all()
    for found, known in ((log.events, original.log.events), (log.changes, original.log.changes)):
        places = [known.index(x) for x in found]
        assert places == sorted(set(places))
    for name, text in log.attachments.items():
        assert original.log.attachments[name] == text
    if data == original.data:
        assert log.complete
        return True
    assert not log.complete
    list(log.samples())
    list(log.commands())
    assert len(log.record()) == len(log)
    return True


def fuzz(folder, originals, trials, seed):
    read = 0
    for trial in range(trials):
        kind = KINDS[trial % len(KINDS)]
        rng = np.random.default_rng((seed, trial))
        try:
            read += is_refused_or_right(folder / "a.mcap", kind(rng, originals), originals)
        except Exception as error:
            raise AssertionError(f"{kind.__name__}, seed {(seed, trial)}") from error
    assert trials / 4 < read < trials  # the damage is not so great that nothing is tested


@pytest.mark.slow
def test_damaged_logs_are_refused_or_read_up_to_the_damage(tmp_path, originals):
    fuzz(tmp_path, originals, 360, seed=1)


@pytest.mark.slow
def test_ten_thousand_damaged_logs_are_refused_or_read_up_to_the_damage(tmp_path, originals):
    fuzz(tmp_path, originals, 10_000, seed=2)


@pytest.mark.slow
def test_a_truncated_log_gives_every_whole_chunk_before_the_cut(tmp_path, originals):
    path, original = tmp_path / "a.mcap", originals[0]
    chunks = [place + 9 + length for place, opcode, length in original.records if opcode == Opcode.CHUNK]
    rows_before = []
    for end in chunks:
        path.write_bytes(original.data[:end])
        log = read_log(path)
        rows_before.append(len(log))
        assert (log.damage, log.complete) == (None, False)
        path.write_bytes(original.data[: end + 5])
        log = read_log(path)
        assert len(log) == rows_before[-1]
        assert log.damage == f"cut off at byte {end + 5}"
    assert rows_before[-1] == 450
    assert sorted(rows_before) == rows_before


def test_a_damaged_chunk_is_left_out_and_those_after_it_are_read(tmp_path, originals):
    path, original = tmp_path / "a.mcap", originals[0]
    places = [(place, length) for place, opcode, length in original.records if opcode == Opcode.CHUNK]
    place, length = places[2]
    data = bytearray(original.data)
    data[place + length // 2] ^= 1
    path.write_bytes(data)
    log = read_log(path)
    assert f"the chunk at byte {place}" in log.damage
    assert not log.complete
    assert log.sequence[-1] == 449
    assert sum(gap.count for gap in log.gaps) == 450 - len(log) > 0


@pytest.mark.slow
def test_every_byte_counts(tmp_path, originals):
    """A log is complete only as it was written: any byte that differs is noticed, in indexes and summary too."""
    path, data = tmp_path / "a.mcap", originals[0].data
    rng = np.random.default_rng(3)
    tail = range(originals[0].records[-12][0], len(data))
    for place in [*rng.integers(0, len(data), 150), *rng.choice(tail, 60)]:
        changed = bytearray(data)
        changed[place] ^= 0x10
        path.write_bytes(changed)
        try:
            log = read_log(path)
        except InvalidValueError:
            continue
        assert log.damage is not None, place
        assert not log.complete, place


def records_of(original, opcode):
    return [original.data[p : p + 9 + n] for p, kind, n in original.records if kind == opcode]


@pytest.mark.parametrize("number", range(9))
def test_a_chunk_of_another_run_does_not_pass(number, tmp_path, originals):
    """Same layout, same sample times, valid check sums: only the start on the wall clock differs."""
    ours, theirs = (records_of(original, Opcode.CHUNK)[number] for original in originals[:2])
    (tmp_path / "a.mcap").write_bytes(originals[0].data.replace(ours, theirs))
    log = read_log(tmp_path / "a.mcap")
    assert "do not agree with themselves or with this run's start" in log.damage
    missing = (
        450 - len(log),
        len(originals[0].log.events) - len(log.events),
        len(originals[0].log.changes) - len(log.changes),
    )
    assert sum(x > 0 for x in missing) == 1  # each chunk holds rows, or an event, or a change


def test_an_attachment_of_another_run_does_not_pass(tmp_path, originals):
    ours, theirs = (records_of(original, Opcode.ATTACHMENT)[1] for original in originals[:2])
    (tmp_path / "a.mcap").write_bytes(originals[0].data.replace(ours, theirs))
    log = read_log(tmp_path / "a.mcap")
    assert "'experiment.yaml'" in log.damage
    assert "is of another run, or comes again" in log.damage
    assert set(log.attachments) == {"versions.yaml"}
    assert len(log) == 450


def test_damaged_schemas_are_refused(tmp_path, originals):
    """MCAP has no check sum for them; the heading does."""
    data = originals[0].data.replace(b"float64 compute_time", b"float32 compute_time", 1)
    (tmp_path / "a.mcap").write_bytes(data)
    with pytest.raises(InvalidValueError, match="its schemas or channels are damaged"):
        read_log(tmp_path / "a.mcap")


def forged_chunk(original, content, size, crc=None):
    """The log with one more chunk in front of its first, with valid check sums."""
    compressed = zstandard.ZstdCompressor().compress(content)
    crc = zlib.crc32(content) if crc is None else crc
    body = struct.pack("<QQQI", 0, 0, size, crc) + struct.pack("<I", 4) + b"zstd"
    body += struct.pack("<Q", len(compressed)) + compressed
    place = next(place for place, opcode, _ in original.records if opcode == Opcode.CHUNK)
    record = struct.pack("<BQ", Opcode.CHUNK, len(body)) + body
    return original.data[:place] + record + original.data[place:]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("size", "content_size"), [(2**30, 2**30), (1000, 2**30), (2**62, 1000), (2**24, 2**24)], ids=str
)
def test_a_bomb_does_not_go_off(size, content_size, tmp_path, originals):
    """What a chunk or its frame claims is not what is reserved."""
    path = tmp_path / "a.mcap"
    content = bytes(content_size) if content_size < 2**30 else None
    if content is None:
        compressor = zstandard.ZstdCompressor().compressobj(size=content_size)
        parts = [compressor.compress(bytes(2**24)) for _ in range(2**6)]
        frame = b"".join([*parts, compressor.flush()])
        data = forged_frame(originals[0], frame, size)
    else:
        data = forged_chunk(originals[0], content, size)
    path.write_bytes(data)
    del content, data
    tracemalloc.start()
    log = read_log(path)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 50e6
    assert len(log) == 450
    assert "the chunk at byte" in log.damage


def forged_frame(original, frame, size):
    body = (
        struct.pack("<QQQI", 0, 0, size, 1)
        + struct.pack("<I", 4)
        + b"zstd"
        + struct.pack("<Q", len(frame))
        + frame
    )
    place = next(place for place, opcode, _ in original.records if opcode == Opcode.CHUNK)
    record = struct.pack("<BQ", Opcode.CHUNK, len(body)) + body
    return original.data[:place] + record + original.data[place:]


def test_a_chunk_without_a_check_sum_is_damaged(tmp_path, originals):
    """MCAP allows 0 for none; palpate always writes one."""
    place = next(place for place, opcode, _ in originals[0].records if opcode == Opcode.CHUNK)
    data = bytearray(originals[0].data)
    data[place + 9 + 24 : place + 9 + 28] = bytes(4)
    (tmp_path / "a.mcap").write_bytes(data)
    assert f"the chunk at byte {place} is damaged (check sum)" in read_log(tmp_path / "a.mcap").damage


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (b"", "it is no MCAP file"),
        (b"time,force\n1,2\n", "it is no MCAP file"),
        (b"\x89MCAP0\r\n", "there is no 'palpate_log.json' where it should be"),
    ],
)
def test_what_is_no_log_is_refused(data, message, tmp_path):
    (tmp_path / "a.mcap").write_bytes(data)
    with pytest.raises(InvalidValueError, match=message):
        read_log(tmp_path / "a.mcap")


def test_another_program_s_mcap_is_refused(tmp_path):
    with (tmp_path / "a.mcap").open("wb") as file:
        writer = Writer(file)
        writer.start()
        channel = writer.register_channel("/x", "json", writer.register_schema("x", "jsonschema", b"{}"))
        writer.add_message(channel, 0, b"{}", 0)
        writer.finish()
    with pytest.raises(InvalidValueError, match=r"there is no 'palpate_log\.json'"):
        read_log(tmp_path / "a.mcap")


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (b'"format": 6', b'"format": 9', "its format is 9, .* reads 6: read it with the palpate that wrote it"),
        (b'"SEEK"', b'"PEEK"', "does not know its Phase 'PEEK'"),
        (b'"grips": 2', b'"grips": 0', "its heading cannot be understood"),
        (b'"period": 0.001', b'"period": "slow', "its heading cannot be understood"),
    ],
)
def test_a_log_of_the_future_is_refused(old, new, message, tmp_path, originals):
    data = originals[0].data
    place, _, length = next(x for x in originals[0].records if x[1] == Opcode.ATTACHMENT)
    assert data.count(old, place, place + 9 + length) == 1
    body = data[place + 9 : place + 5 + length].replace(old, new)
    record = struct.pack("<BQ", Opcode.ATTACHMENT, len(body) + 4) + body + struct.pack("<I", zlib.crc32(body))
    (tmp_path / "a.mcap").write_bytes(data[:place] + record + data[place + 9 + length :])
    with pytest.raises(InvalidValueError, match=message):
        read_log(tmp_path / "a.mcap")


def test_a_file_that_is_not_there_is_an_error_of_the_system(tmp_path):
    with pytest.raises(FileNotFoundError):
        read_log(tmp_path / "a.mcap")
