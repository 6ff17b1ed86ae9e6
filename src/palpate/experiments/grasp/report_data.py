"""What a report on one grasp is made from: numbers and arrays, no drawing."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from palpate.errors import FloatArray, InvalidValueError
from palpate.friction import LimitSurface
from palpate.grasp import GraspContacts
from palpate.reporting.data import KeyFigure
from palpate.runtime import RunTiming

BoolArray = npt.NDArray[np.bool_]


@dataclass(frozen=True, slots=True, eq=False)
class GraspSeries:
    """One grasp over time, one entry per period (n) and finger (k).

    Attributes:
        time: Increasing, shape (n,) [s].
        stage: What it was at, length n.
        wanted: Grip that was wanted, shape (n,) [N].
        felt: True grip, mean over the fingers, shape (n,) [N].
        least: Least grip of the true load, shape (n,) [N]; NaN where the fingers do not bear it alone.
        slip: Since the lift began, shape (n, k) [m].
        spin: Likewise, shape (n, k) [rad].
        loads: True normal force [N], tangential force [N], spin torque [N m], shape (n, k, 3).
        slipping: Shape (n, k).
        counted: In which periods it was pulled, shape (n,).
        aloft: In which it was in the air, from the lift on, shape (n,).
        alarms: When slip was told [s].
    """

    time: FloatArray
    stage: tuple[str, ...]
    wanted: FloatArray
    felt: FloatArray
    least: FloatArray
    slip: FloatArray
    spin: FloatArray
    loads: FloatArray
    slipping: BoolArray
    counted: BoolArray
    aloft: BoolArray
    alarms: tuple[float, ...]

    def __post_init__(self) -> None:
        n = len(self.time)
        for name in ("stage", "wanted", "felt", "least", "slip", "spin", "loads", "slipping", "counted", "aloft"):
            if len(getattr(self, name)) != n:
                raise InvalidValueError(
                    f"{name} has {len(getattr(self, name))} entries: must be {n}, one per time"
                )


@dataclass(frozen=True, slots=True, eq=False)
class HeaviestLoad:
    """The least forces that hold the load where it takes most grip; object frame turned as the base is.

    Attributes:
        time: When [s].
        grasp: Contacts, and what they really bear.
        forces: On the object, shape (k, 4) [N, N, N, N m].
        load: What else acts on it, shape (6,) [N, N m].
        disturbance: The largest further load that the true grip held in the worst direction, shape (6,) [N, N m];
            None where that is not known.
    """

    time: float
    grasp: GraspContacts
    forces: FloatArray
    load: FloatArray
    disturbance: FloatArray | None


@dataclass(frozen=True, slots=True, eq=False)
class GraspReport:
    """All that a report on one grasp shows.

    Attributes:
        title: Heading.
        outcome: How it ended, a sentence or more.
        summary: Key figures, most important first.
        compared: Name, figure, figure of the control that ignores spin, unit; empty if there is none.
        account: What was seen, a paragraph each.
        settings: Name and value with unit of each setting.
        surface: What the contacts really bear; where nobody knows, what they are believed to.
        series: What happened.
        beside: What happened with a control that ignores spin; None if that was not asked for.
        timing: How long the periods took.
        heaviest: The least forces at one moment; None if it was not held.
        truth_known: Whether it is known what really happened: not on a real robot.
        asked: What was asked for, in words.
        advice: What to do now, a sentence or two each.
        repeat: What is repeated, and the command that does so.
    """

    title: str
    outcome: str
    summary: tuple[KeyFigure, ...]
    compared: tuple[tuple[str, str, str, str], ...]
    account: tuple[str, ...]
    settings: tuple[tuple[str, str], ...]
    surface: LimitSurface
    series: GraspSeries
    beside: GraspSeries | None
    timing: RunTiming
    heaviest: HeaviestLoad | None = None
    truth_known: bool = True
    asked: str = ""
    advice: tuple[str, ...] = ()
    repeat: tuple[tuple[str, str], ...] = ()
