"""Which of the records that arrive belong to the stream, and which are old, repeated, or none at all.

Datagrams may be lost, doubled and swapped, and on some wires a record carries no checksum that counts. What tells
is that counters of a device go on with time: a record follows if every counter has advanced, and by no more than
it can have since the last one arrived; and if all counters have advanced in the proportion in which they did when
the stream was new. Of random 32-bit numbers one in 200 000 could follow, of pairs of them one in 10^13. A device
that begins anew is believed when its records follow one another, and nothing else comes.
"""

from enum import Enum, auto

from palpate.hw.ft_stream.link import StreamCounts

MODULUS = 1 << 32
"""Counters are unsigned, 32 bits."""

_HALF = MODULUS >> 1

LATEST = 1.0
"""Longest that a record lies around before it is read [s]: more than a socket's buffer of 4 MiB holds at 7000 Hz
is rare. Counters may be ahead of the time of arrival by as much."""

ALIKE = 3
"""Records that must follow one another before a stream is believed to be the device's."""

UNDISTURBED = 0.02
"""Time without a record of the old stream before a new one replaces it [s]. Records that were swapped or held up
in transit look like a new stream that counts from less; they come with those of the old one."""


UNEVEN = 2.0
"""Factor by which two counters' advances may be out of proportion: samples per record round to 2 or 3."""


class Step(Enum):
    """What one record is."""

    NEXT = auto()
    """It follows."""
    OLDER = auto()
    """It is the last once more, or was overtaken."""
    UNPROVEN = auto()
    """It does not belong to the stream; it may be the first of another."""
    ANEW = auto()
    """The first of a new stream that is believed."""


class Succession:
    """Judges record after record, and counts what became of them; counters of one record belong together."""

    def __init__(self, fastest: tuple[float, ...], counts: StreamCounts) -> None:
        """Take the largest rate of each counter [1/s], far above what it should be, and where to count."""
        self._fastest = fastest
        self._counts = counts
        self._last: tuple[int, ...] | None = None
        self._arrival = 0.0
        self._proportion: tuple[float, ...] = ()
        self._candidate: tuple[int, ...] = ()
        self._candidate_first: tuple[int, ...] = ()
        self._candidate_arrival = 0.0
        self._alike = 0
        self._unproven = 0

    def judge(self, counters: tuple[int, ...], arrival: float) -> tuple[Step, int]:
        """Return what a record is, and by how much its first counter has advanced if it is the next.

        Args:
            counters: Of the record, each in [0, 2^32).
            arrival: When it was read [s].
        """
        last, counts = self._last, self._counts
        if last is not None:
            if self._follows(last, counters, arrival - self._arrival) and self._in_proportion(last, counters):
                advance = (counters[0] - last[0]) % MODULUS
                self._last, self._arrival = counters, arrival
                if self._alike:
                    self._alike = 0
                    self._give_up()
                counts.records += 1
                return Step.NEXT, advance
            if counters == last:
                counts.older += 1
                return Step.OLDER, 0
        if self._alike and self._follows(self._candidate, counters, arrival - self._candidate_arrival):
            self._alike += 1
        else:
            self._alike = 1
            self._candidate_first = counters
            self._give_up()
        self._candidate, self._candidate_arrival = counters, arrival
        if self._alike >= ALIKE and (last is None or arrival - self._arrival >= UNDISTURBED):
            self._last, self._arrival = counters, arrival
            records = (counters[0] - self._candidate_first[0]) % MODULUS
            self._proportion = tuple(
                [(new - old) % MODULUS / records for new, old in zip(counters, self._candidate_first, strict=True)]
            )
            self._alike = self._unproven = 0
            counts.restarts += last is not None
            counts.records += 1
            return Step.ANEW, 0
        if last is not None and self._overtaken(last, counters):
            counts.older += 1
            return Step.OLDER, 0
        self._unproven += 1
        return Step.UNPROVEN, 0

    def _give_up(self) -> None:
        self._counts.refused += self._unproven
        self._unproven = 0

    def _follows(self, before: tuple[int, ...], counters: tuple[int, ...], elapsed: float) -> bool:
        seconds = elapsed + LATEST
        for old, new, fastest in zip(before, counters, self._fastest, strict=True):
            if not 0 < (new - old) % MODULUS <= min(fastest * seconds, _HALF):
                return False
        return True

    def _in_proportion(self, before: tuple[int, ...], counters: tuple[int, ...]) -> bool:
        records = (counters[0] - before[0]) % MODULUS
        for old, new, proportion in zip(before, counters, self._proportion, strict=True):
            expected = proportion * records
            if not expected / UNEVEN - 1.0 <= (new - old) % MODULUS <= expected * UNEVEN + 1.0:
                return False
        return True

    def _overtaken(self, last: tuple[int, ...], counters: tuple[int, ...]) -> bool:
        """Whether it could have been sent at most `LATEST` before the last."""
        return all(
            0 <= (old - new) % MODULUS <= fastest * LATEST
            for old, new, fastest in zip(last, counters, self._fastest, strict=True)
        )
