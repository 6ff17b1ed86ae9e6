"""Hands every period of a run to sinks, for a few microseconds of the loop's time."""

import math
import time as wall_clock
from dataclasses import replace

from palpate.errors import InvalidValueError
from palpate.runtime.data import Command, Observation, Sample
from palpate.runtime.live import Change
from palpate.runtime.log.chunk import PERIOD_CHANNEL, PackedRows
from palpate.runtime.log.entries import Event, Level
from palpate.runtime.log.entry_codec import Entry
from palpate.runtime.log.heading import Heading
from palpate.runtime.log.layout import Layout
from palpate.runtime.log.period_codec import PeriodCodec
from palpate.runtime.log.row_packer import Pack, row_packer, with_truth
from palpate.runtime.log.sink import RecordingSummary, Sink
from palpate.runtime.truth import TruthSource
from palpate.version import __version__

BLOCK_TIME = 0.2
"""So many seconds of periods are handed over at once; a process that is killed loses them. At 1 kHz the writer
then works in one period of 200, which keeps what it costs the loop beyond the 99th percentile."""

LONGEST_WAIT = 0.25
"""Rows are handed over after this time [s], by the samples' clock, where periods are slower than they ought to."""

LARGEST_BLOCK = 2**20
"""Bytes."""


class Recorder:
    """Packs each period into one row of float64 and hands the rows to the sinks, a block at a time.

    `start` does all that is slow. `record`, `event` and `change` never raise and never wait; a period that does
    not fit the first sample's layout is dropped and counted in the summary. One recorder records one run.
    """

    def __init__(self, *sinks: Sink) -> None:
        """Take the sinks."""
        self._sinks = sinks
        self._recording = False
        self._summary: RecordingSummary | None = None
        self._pack: Pack = _ignore
        self._block, self._size = bytearray(), 1
        self._place = self._handed = 0
        self._end = -1
        self._deadline = math.inf
        self._first = self._entry = self._dropped = 0
        self._misfit = ""

    def start(self, first: Sample, now: Observation, period: float, truth: TruthSource | None = None) -> None:
        """Lay out the rows and start the sinks.

        Args:
            first: First sample of the run; all must have as many joints, fingers and channels.
            now: What touch makes of it.
            period: Control period [s].
            truth: Knows what really happens at each sample; None: nobody does.

        Raises:
            InvalidValueError: This recorder was started before, the sample cannot be laid out, or a sink refuses.
            OSError: A sink cannot write.
        """
        if self._recording or self._summary is not None:
            raise InvalidValueError("this Recorder was started before: make a new one for each run")
        if len(now.fingers) != len(first.wrenches):
            raise InvalidValueError(
                f"{len(now.fingers)} fingers, but {len(first.wrenches)} wrenches: must be as many"
            )
        layout, start = Layout.of(first, () if truth is None else truth.truth_columns), wall_clock.time_ns()
        heading = Heading(layout, float(period), float(first.time), start, f"palpate {__version__}")
        self._size = PeriodCodec(heading, PERIOD_CHANNEL).row_bytes
        rows = max(1, min(round(BLOCK_TIME / period), LARGEST_BLOCK // self._size))
        for sink in self._sinks:
            sink.start(heading)
        self._end = rows * self._size
        self._block = bytearray(self._end)
        self._deadline = first.time + LONGEST_WAIT
        self._pack = row_packer(layout) if truth is None else with_truth(row_packer(layout), truth)
        self._recording = True

    def record(
        self, sample: Sample, now: Observation, command: Command, compute_time: float, lateness: float
    ) -> None:
        """Keep one period.

        Args:
            sample: What the devices reported.
            now: What touch made of it.
            command: What was commanded, after the supervisor.
            compute_time: That sensing, control and supervision took [s].
            lateness: Of the wake-up that the period began with [s].
        """
        try:
            self._place = place = self._pack(
                self._block, self._place, sample, now, command, compute_time, lateness
            )
        except Exception as error:  # whatever a device or a controller made up: it must not end the run
            self._drop(error)
            return
        if place == self._end or sample.time > self._deadline:
            self._hand_over()
            self._deadline = sample.time + LONGEST_WAIT

    def event(self, time: float, level: Level, source: str, text: str) -> None:
        """Note what happened, for people.

        Args:
            time: On the back end's clock [s].
            level: How grave it is.
            source: Who says so.
            text: What happened.
        """
        self._note(Event(time, level, source, text))

    def change(self, time: float, name: str, value: float) -> None:
        """Note that a live parameter was given a new value to go to, for replay.

        Args:
            time: Of the first period that it acts in [s].
            name: Of the parameter.
            value: What it is to become.
        """
        self._note(Change(time, name, value))

    def flush(self) -> None:
        """Hand over what there is, for a look at a run that goes on."""
        if self._recording:
            self._hand_over()

    def close(self) -> RecordingSummary:
        """Finish the recording; never raises, may be called twice."""
        if self._summary is None:
            self.flush()
            self._recording, self._pack, self._end, self._deadline = False, _ignore, -1, math.inf
            found = RecordingSummary.joined([sink.close() for sink in self._sinks])
            if self._dropped:
                problem = f"{self._dropped} periods did not fit the layout of the first: {self._misfit}"
                found = replace(
                    found,
                    rows_lost=found.rows_lost + self._dropped,
                    problem=problem if found.problem is None else f"{problem}; {found.problem}",
                )
            self._summary = found
        return self._summary

    def _note(self, what: Event | Change) -> None:
        if self._recording:
            self._hand_over()  # the order of rows and entries is kept
            for sink in self._sinks:
                sink.entry(Entry(self._entry, what))
            self._entry += 1

    def _hand_over(self) -> None:
        """Give the sinks the rows that they have not got, and begin a new block where this one is full."""
        if self._place > self._handed:
            rows = PackedRows(self._first, memoryview(self._block)[self._handed : self._place])
            for sink in self._sinks:
                sink.rows(rows)
            self._first += (self._place - self._handed) // self._size
        if self._place == self._end:
            self._block, self._place = bytearray(self._end), 0
        self._handed = self._place

    def _drop(self, error: Exception) -> None:
        """Go on without a period: the gap in the numbers shows where it was."""
        self._hand_over()
        self._first += 1
        self._dropped += 1
        self._misfit = self._misfit or f"{type(error).__name__}: {error}"


def _ignore(
    block: bytearray,
    place: int,
    sample: Sample,
    now: Observation,
    command: Command,
    compute_time: float,
    lateness: float,
) -> int:
    """Pack nothing: the recorder was not started, or is closed."""
    return place
