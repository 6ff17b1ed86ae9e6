"""What a report on a replay is made from: numbers and arrays, no drawing."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from palpate.errors import FloatArray, InvalidValueError
from palpate.reporting.data import KeyFigure, TimeSeries


@dataclass(frozen=True, slots=True, eq=False)
class ReplaySeries:
    """One side of a comparison, one entry per control period.

    Attributes:
        time: Increasing, shape (k,) [s].
        phase: Name of the controller's phase, length k.
        velocity: Commanded velocity of the tip in base coordinates, shape (k, 3) [m/s].
        normal_force: That touch found, shape (k,) [N]; NaN without contact.

    Raises:
        InvalidValueError: Shapes differ.
    """

    time: FloatArray
    phase: Sequence[str]
    velocity: FloatArray
    normal_force: FloatArray

    def __post_init__(self) -> None:
        count = len(self.time)
        for name, shape in (("phase", (count,)), ("velocity", (count, 3)), ("normal_force", (count,))):
            found = np.shape(getattr(self, name))
            if found != shape:
                raise InvalidValueError(f"{name} has shape {found}: must be {shape}, one per time")
        object.__setattr__(self, "phase", tuple(str(name) for name in self.phase))

    @property
    def ground(self) -> TimeSeries:
        """Time and phases alone, as `palpate.reporting.phases` takes them."""
        unknown = np.full(len(self.time), np.nan)
        return TimeSeries(self.time, self.phase, unknown, unknown, unknown, unknown)


@dataclass(frozen=True, slots=True, eq=False)
class ReplayReport:
    """All that a report on a replay shows.

    Attributes:
        title: Heading.
        outcome: What came of it, one sentence or two.
        summary: Key figures, most important first.
        settings: Name and value with unit of what was replayed, and of what was changed.
        recorded: What was recorded.
        replayed: What came out, at the same times.
        asked: What was asked for, in words.
        advice: What to do now, a sentence or two each.
        repeat: What is repeated, and the command that does so.

    Raises:
        InvalidValueError: The two sides have different times.
    """

    title: str
    outcome: str
    summary: tuple[KeyFigure, ...]
    settings: tuple[tuple[str, str], ...]
    recorded: ReplaySeries
    replayed: ReplaySeries
    asked: str = ""
    advice: tuple[str, ...] = ()
    repeat: tuple[tuple[str, str], ...] = ()

    def __post_init__(self) -> None:
        if not np.array_equal(self.recorded.time, self.replayed.time, equal_nan=True):
            raise InvalidValueError("recorded and replayed have different times: must be of the same samples")
