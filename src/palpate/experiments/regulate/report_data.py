"""What a report on one regulation of force is made from: numbers and arrays, no drawing."""

from dataclasses import dataclass

import numpy as np

from palpate.errors import FloatArray, InvalidValueError
from palpate.reporting.data import KeyFigure, TimeSeries
from palpate.runtime import RunTiming

ComplexArray = np.ndarray[tuple[int], np.dtype[np.complex128]]


@dataclass(frozen=True, slots=True, eq=False)
class StepCurves:
    """How a force answers to steps, each scaled to go from 0 to 1.

    Attributes:
        time: Since the step, shape (n,) [s].
        felt: Mean of the felt force, shape (n,); None if it is not known.
        true: Mean of the true force, shape (n,), if it is known.
        each: Every single step that `true` (or, without it, `felt`) is the mean of, shape (steps, n).
        rise: When 10 and 90 % were reached [s]; NaN if they were not.
        band: Half width of the band about 1 in which it counts as settled.
    """

    time: FloatArray
    felt: FloatArray | None
    true: FloatArray | None
    each: FloatArray
    rise: tuple[float, float]
    band: float

    def __post_init__(self) -> None:
        for name in ("felt", "true"):
            values = getattr(self, name)
            if values is not None and values.shape != self.time.shape:
                raise InvalidValueError(f"{name} has shape {values.shape}: must be {self.time.shape}, as time")


@dataclass(frozen=True, slots=True, eq=False)
class BodeCurve:
    """How a force answers to sines.

    Attributes:
        name: Which force.
        frequency: Rising, shape (n,) [Hz].
        gain: Amplitude ratio, shape (n,).
        phase_deg: Shape (n,) [degrees].
    """

    name: str
    frequency: FloatArray
    gain: FloatArray
    phase_deg: FloatArray

    def __post_init__(self) -> None:
        for name in ("gain", "phase_deg"):
            if getattr(self, name).shape != self.frequency.shape:
                raise InvalidValueError(
                    f"{name} has shape {getattr(self, name).shape}: must be {self.frequency.shape}, as frequency"
                )


@dataclass(frozen=True, slots=True, eq=False)
class RegulationReport:
    """All that a report on one regulation shows.

    Attributes:
        title: Heading.
        outcome: How it ended, one sentence or more.
        summary: Key figures, most important first.
        margins: Of the force control, likewise.
        settings: Name and value with unit of each setting.
        series: What happened over time.
        timing: How long the periods took.
        steps: The answer to steps, if the force stepped.
        tones: The answers to sines, if there were any.
        bandwidth: Where the (first) answer falls below -3 dB [Hz]; None if it does not, or there were no sines.
        limits: What bounds how fast the force follows, a sentence or two each.
        asked: What was asked for, in words.
        advice: What to do now, a sentence or two each.
        repeat: What is repeated, and the command that does so.
    """

    title: str
    outcome: str
    summary: tuple[KeyFigure, ...]
    margins: tuple[KeyFigure, ...]
    settings: tuple[tuple[str, str], ...]
    series: TimeSeries
    timing: RunTiming
    steps: StepCurves | None = None
    tones: tuple[BodeCurve, ...] = ()
    bandwidth: float | None = None
    limits: tuple[str, ...] = ()
    asked: str = ""
    advice: tuple[str, ...] = ()
    repeat: tuple[tuple[str, str], ...] = ()
