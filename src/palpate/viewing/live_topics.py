"""A run's standard topics while it goes on, sent to other programs by a process of its own.

As for `LiveView` the loop writes one row per period into shared memory and never waits. The row is the log's,
and the process makes of it what joins the log when the run is over. Rows that it is too slow for are lost to who
watches, not to the log.
"""

import multiprocessing
import os
import signal
from contextlib import suppress
from dataclasses import replace
from multiprocessing.connection import Connection
from time import monotonic, sleep
from typing import Any

import numpy as np

from palpate.interruption import SIGNALS
from palpate.runtime.closing import Closing
from palpate.runtime.data import Command, Observation, Sample
from palpate.runtime.log.chunk import PERIOD_CHANNEL, PackedRows
from palpate.runtime.log.entry_codec import Entry
from palpate.runtime.log.heading import Heading
from palpate.runtime.log.log import Log
from palpate.runtime.log.period_codec import PeriodCodec
from palpate.runtime.log.row_packer import row_packer
from palpate.runtime.log.sink import RecordingSummary, Sink
from palpate.runtime.log.standard.topic import Block
from palpate.runtime.log.standard.topics import RobotNotes, StandardTopics
from palpate.viewing.live_view import INTERVAL, NICENESS, end_process, url_from
from palpate.viewing.publisher import Publisher, TopicViewer
from palpate.viewing.row_ring import RingReader, RingWriter, RowRing

RING = 2**20
"""Numbers in the shared memory, 8 MB: 15 s at 1 kHz of an arm with one finger."""

AT_ONCE = 10_000
"""Periods of a log that are sent at once at most: their messages take some megabytes."""


class LiveTopics(Closing):
    """Sends a run's topics. Its `observe` is an `Observer` of the loop.

    Attributes:
        url: What to open.
    """

    def __init__(self, tool: TopicViewer, notes: RobotNotes, host: str, port: int) -> None:
        """Start the process; takes a second.

        Args:
            tool: To which they are sent.
            notes: What is known of the robot.
            host: Where the tool's server is to listen, or where its viewer is.
            port: Likewise.

        Raises:
            ViewUnavailableError: The port is taken, there is no viewer, or the process did not start.
            InvalidValueError: There is no such port.
        """
        context = multiprocessing.get_context("spawn")
        ring, self._tool = RowRing(context, 1, RING), tool
        self._pipe, theirs = context.Pipe()
        self._sink = _HeadingSink(ring, self._pipe)
        self._process = context.Process(
            target=_serve,
            args=(ring, tool, notes, host, port, theirs),
            name=f"palpate for {tool.name}",
            daemon=True,
        )
        self._process.start()
        theirs.close()
        self.url = url_from(self._pipe, self._process, self.close)

    def observe(self, sample: Sample, now: Observation, command: Command) -> None:
        """Take a period; never waits, never raises."""
        sink = self._sink
        writer = sink.writer
        try:
            sink.pack(writer.memory, writer.begin(), sample, now, command, 0.0, 0.0)
        except Exception:  # whatever a device made up: the recorder counts it, and the run goes on
            return
        writer.end()

    @property
    def sinks(self) -> tuple[Sink, ...]:
        """What the run's recorder is to be given for it."""
        return (self._sink,)

    def run_over(self) -> tuple[str, ...]:
        """Return what was not as it should be, a sentence each."""
        if self._process.is_alive():
            return ()
        return (f"The process that sends topics to {self._tool.name} has ended: the log has them all",)

    def wait(self) -> None:
        """Return when the process ends; Ctrl-C raises KeyboardInterrupt."""
        self._process.join()

    def close(self) -> None:
        """End it; may be called more than once."""
        end_process(self._pipe, self._process)


class _HeadingSink:
    """A `Sink` that keeps nothing: it prepares the ring for the rows of a run, and tells the other process."""

    def __init__(self, ring: RowRing, pipe: Connection) -> None:
        self._ring, self._pipe = ring, pipe
        self._taken, self._row_bytes = 0, 1
        self.writer, self.pack = RingWriter(ring), _nothing

    def start(self, heading: Heading) -> None:
        """See `Sink`."""
        self._row_bytes = PeriodCodec(heading, PERIOD_CHANNEL).row_bytes
        seen = replace(heading, layout=replace(heading.layout, truth=()))
        self.writer = RingWriter(_divided(self._ring, PeriodCodec(seen, PERIOD_CHANNEL)))
        self.pack = row_packer(seen.layout)
        with suppress(OSError):  # it has ended: the run goes on
            self._pipe.send(seen)

    def rows(self, rows: PackedRows) -> None:
        """See `Sink`."""
        self._taken += len(rows.data) // self._row_bytes

    def entry(self, entry: Entry) -> None:
        """See `Sink`."""

    def close(self) -> RecordingSummary:
        """See `Sink`."""
        return RecordingSummary(rows_written=self._taken)


def _nothing(*_: Any) -> int:
    """Before the run has begun there is nothing to pack."""
    raise ValueError


def _divided(ring: RowRing, codec: PeriodCodec) -> RowRing:
    return ring.divided(codec.width + 2)


def play_topics(publisher: Publisher, log: Log, notes: RobotNotes, speed: float) -> None:
    """Send the topics of a recorded run as they were, and return at its end.

    Args:
        publisher: To whom.
        log: The run.
        notes: What is known of its robot.
        speed: How many times as fast as it was; infinite for all at once.
    """
    codec, times = log.codec, log.rows[:, 0] - log.rows[0, 0] if len(log) else np.empty(0)
    publisher.start(codec, StandardTopics(codec, notes))
    started, sent = monotonic(), 0
    while sent < len(times):
        passed = np.inf if np.isinf(speed) else speed * (monotonic() - started)
        until = min(int(np.searchsorted(times, passed, side="right")), sent + AT_ONCE)
        publisher.periods(Block.of(codec, log.rows[sent:until], log.sequence[sent:until]))
        sent = until
        sleep(INTERVAL)


def _serve(ring: RowRing, tool: TopicViewer, notes: RobotNotes, host: str, port: int, pipe: Connection) -> None:
    """What the process does, until the other end of the pipe is closed."""
    for number in SIGNALS:
        signal.signal(number, signal.SIG_IGN)  # they are for the loop, which ends this when it is done
    if hasattr(os, "nice"):
        os.nice(NICENESS)
    try:
        publisher = tool.publisher(host, port)
    except Exception as error:
        pipe.send(error)
        return
    try:
        pipe.send(publisher.url)
        heading: Heading = pipe.recv()
        codec = PeriodCodec(heading, PERIOD_CHANNEL)
        publisher.start(codec, StandardTopics(codec, notes))
        reader = RingReader(_divided(ring, codec))
        while True:
            pipe.poll(INTERVAL)  # until it is closed nothing comes
            rows = reader.read()
            if len(rows):
                publisher.periods(Block.of(codec, rows[:, 1:-1], rows[:, 0].astype(np.int64)))
            if pipe.poll():
                pipe.recv()
    except (EOFError, OSError):
        return  # the loop's process has closed the pipe, or is gone
    finally:
        publisher.close()
