"""What a report on friction is made from: numbers and arrays, no drawing."""

from dataclasses import dataclass

from palpate.errors import FloatArray, InvalidValueError
from palpate.friction import LimitSurface
from palpate.friction.materials.trials import Confusion
from palpate.reporting.data import KeyFigure, TimeSeries
from palpate.runtime import RunTiming


@dataclass(frozen=True, slots=True)
class Measured:
    """A number with its 95 % interval, or a lower bound.

    Attributes:
        at: Where: a load [N] or a speed [m/s].
        value: As measured; the bound itself if it is one.
        lower: End of the interval.
        upper: The other; infinite for a bound.
        true: As it is simulated, if that is known.
        bound: Whether it is a lower bound.
        why: Of a bound: why it is no more, in words.
    """

    at: float
    value: float
    lower: float
    upper: float
    true: float | None = None
    bound: bool = False
    why: str = ""


@dataclass(frozen=True, slots=True, eq=False)
class StrokeCurve:
    """Tangential over normal force along one way of a stroke.

    Attributes:
        load: Normal force [N].
        back: Whether on the way back.
        travel: Since it began to move, shape (n,) [m].
        ratio: Against the motion, shape (n,).
    """

    load: float
    back: bool
    travel: FloatArray
    ratio: FloatArray

    def __post_init__(self) -> None:
        if self.travel.shape != self.ratio.shape:
            raise InvalidValueError(f"ratio has shape {self.ratio.shape}: must be {self.travel.shape}, as travel")


@dataclass(frozen=True, slots=True, eq=False)
class SurfacePoints:
    """Loads in full slip, over what the contact bears of each alone.

    Attributes:
        surface: As found.
        true: As simulated, if that is known.
        exponent_measured: Whether p of `surface` was measured, not assumed.
        points: f_t / (mu f_n) and tau / (mu e f_n), shape (n, 2).
        errors: Half of the 95 % interval of each, shape (n, 2).
        loads: Normal force that was asked for at each, shape (n,) [N].
        exponents: Between which p lies.
    """

    surface: LimitSurface
    true: LimitSurface | None
    exponent_measured: bool
    points: FloatArray
    errors: FloatArray
    loads: FloatArray
    exponents: tuple[float, float]


@dataclass(frozen=True, slots=True)
class MaterialMatch:
    """What touches say of one material of a library.

    Attributes:
        name: Of the material.
        likelihood: Of the touches, over that under the material under which they are likeliest, natural logarithm.
        posterior: That it is this one, given that it is one of the library.
        fit: Probability that touches of the material itself fit it no better.
    """

    name: str
    likelihood: float
    posterior: float
    fit: float


@dataclass(frozen=True, slots=True, eq=False)
class RecognitionReport:
    """Which surface of a library it may be.

    Attributes:
        words: The answer and the next best touch, in sentences.
        matches: Every material of the library, the likeliest first.
        confusion: How often the library's materials are taken for each other after touches like these; None if
            nothing slipped.
        setting: Which touches those are, and how many of each material, in a sentence; "" without them.
        fits: Whether any material fits.
    """

    words: str
    matches: tuple[MaterialMatch, ...]
    confusion: Confusion | None
    setting: str
    fits: bool = True


@dataclass(frozen=True, slots=True, eq=False)
class FrictionReport:
    """All that a report on friction shows.

    Attributes:
        title: Heading.
        outcome: How it ended, and what could not be told, in sentences.
        summary: Key figures, most important first.
        settings: Name and value with unit of each setting.
        series: What happened over time.
        timing: How long the periods took.
        strokes: mu along the strokes of the main speed.
        friction: mu at each load, as measured.
        lengths: e at each load [m], as far as it slipped.
        growth: c [m] and gamma of the line through them; None if there is none.
        speeds: mu at each speed.
        curve: Speeds [m/s] and mu of the curve through them, shape (2, n); None without one.
        creeping: Whether friction at some speed was proportional to it.
        bent: Whether the surface's normal turns along a stroke.
        surface: The limit surface with what was measured of it; None if nothing spun.
        recognition: Which surface of a library it may be; None without a library.
        asked: What was asked for, in words.
        advice: What to do now, a sentence or two each.
        repeat: What is repeated, and the command that does so.
    """

    title: str
    outcome: str
    summary: tuple[KeyFigure, ...]
    settings: tuple[tuple[str, str], ...]
    series: TimeSeries
    timing: RunTiming
    strokes: tuple[StrokeCurve, ...] = ()
    friction: tuple[Measured, ...] = ()
    lengths: tuple[Measured, ...] = ()
    growth: tuple[float, float] | None = None
    speeds: tuple[Measured, ...] = ()
    curve: FloatArray | None = None
    creeping: bool = False
    bent: bool = False
    surface: SurfacePoints | None = None
    recognition: RecognitionReport | None = None
    asked: str = ""
    advice: tuple[str, ...] = ()
    repeat: tuple[tuple[str, str], ...] = ()
