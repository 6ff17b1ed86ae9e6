"""What a run's log says before its first period: layout, clocks, the meaning of codes."""

from dataclasses import dataclass, field

import msgspec
import numpy as np
import numpy.typing as npt

from palpate.errors import FloatArray, InvalidValueError
from palpate.runtime.log.fields import Codes
from palpate.runtime.log.layout import Layout

FORMAT = 6
"""Goes up with every change that another palpate would misread."""

LAST_NANOSECOND = (2**31 - 1) * 10**9
"""Latest stamp that builtin_interfaces/Time can hold (the year 2038)."""

_FARTHEST = 4e9
"""[s], a century and more, and less than 2**62 ns. Sample times farther from the first one are garbage."""


@dataclass(frozen=True, slots=True)
class Heading:
    """What does not change during a run.

    Attributes:
        layout: How much of everything there is.
        period: Control period [s].
        first_time: Of the first sample, on the back end's clock [s].
        wall_start: When that was, on the wall clock [ns since 1970].
        written_by: Name and version of the program.
        codes: Names of phases, statuses and measures.
    """

    layout: Layout
    period: float
    first_time: float
    wall_start: int
    written_by: str
    codes: Codes = field(default_factory=Codes)

    def __post_init__(self) -> None:
        if not (0.0 < self.period < np.inf and abs(self.first_time) < np.inf):
            raise InvalidValueError(
                f"period = {self.period} s, first sample at {self.first_time} s: both must be finite, "
                f"the period above 0"
            )
        if not 0 <= self.wall_start <= LAST_NANOSECOND:
            raise InvalidValueError(f"wall_start = {self.wall_start} ns: must be from 1970 to 2038")

    def stamps(self, time: FloatArray) -> npt.NDArray[np.uint64]:
        """Return the stamps of sample times [s], shape (n,), on the wall clock [ns since 1970].

        Times that are not numbers get the stamp of the run's start.
        """
        with np.errstate(over="ignore", invalid="ignore"):
            since = np.clip(np.nan_to_num(time - self.first_time), -_FARTHEST, _FARTHEST)
        stamp = np.rint(since * 1e9).astype(np.int64) + self.wall_start
        return np.clip(stamp, 0, LAST_NANOSECOND).astype(np.uint64)

    def stamp(self, time: float) -> int:
        """Return the stamp of one time [s]."""
        return int(self.stamps(np.array([time]))[0])


class _Version(msgspec.Struct):
    format: int


class _Sealed(msgspec.Struct):
    """A heading as attached: with the format first, and the check sum of what stands before it in the file."""

    format: int
    preceding_crc: int
    heading: Heading


def encode_heading(heading: Heading, preceding_crc: int) -> bytes:
    """Return a heading as JSON; every digit is kept."""
    return msgspec.json.format(msgspec.json.encode(_Sealed(FORMAT, preceding_crc, heading)), indent=2)


def decode_heading(data: bytes) -> tuple[Heading, int]:
    """Return the heading and the check sum that `encode_heading` was given.

    Raises:
        InvalidValueError: It is something else, or of another format.
    """
    try:
        version = msgspec.json.decode(data, type=_Version).format
        if version != FORMAT:
            raise InvalidValueError(
                f"its format is {version}, and this palpate reads {FORMAT}: read it with the palpate that wrote it"
            )
        sealed = msgspec.json.decode(data, type=_Sealed)
    except (msgspec.DecodeError, UnicodeDecodeError, RecursionError) as error:
        raise InvalidValueError(f"its heading cannot be understood: {error}") from None
    sealed.heading.codes.check_known()
    return sealed.heading, sealed.preceding_crc
