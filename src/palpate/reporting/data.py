"""What a report on one exploration is made from: numbers and arrays, no drawing."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from palpate.errors import FloatArray, InvalidValueError
from palpate.experiments.explore.growth_data import GrowthReport
from palpate.experiments.explore.map_data import MapReport, ShapeReport
from palpate.mapping import TouchCloud
from palpate.runtime import RunTiming

IndexArray = npt.NDArray[np.integer]


@dataclass(frozen=True, slots=True)
class KeyFigure:
    """One line of a report's summary.

    Attributes:
        name: What it is.
        value: A number, or words.
        unit: Its unit, "" for a ratio, a count or words.
        note: What to compare it with, or "".
        digits: Significant digits shown of a number that is not whole.
    """

    name: str
    value: float | str
    unit: str = ""
    note: str = ""
    digits: int = 4

    @property
    def text(self) -> str:
        """The value as shown; a dash where there is none."""
        if isinstance(self.value, str):
            return self.value
        if math.isnan(self.value):
            return "-"
        if math.isfinite(self.value) and self.value == round(self.value) and abs(self.value) < 1e6:
            return f"{self.value:.0f}"
        if 10.0**self.digits <= abs(self.value) < 1e6:
            return f"{self.value:.0f}"
        return f"{self.value:#.{self.digits}g}".rstrip(".")


@dataclass(frozen=True, slots=True, eq=False)
class TrueSurface:
    """The surface that was explored, where it is known (simulation), as triangles in the base frame.

    Attributes:
        vertices: Shape (n, 3) [m].
        triangles: Indices of vertices, shape (m, 3).
    """

    vertices: FloatArray
    triangles: IndexArray

    def __post_init__(self) -> None:
        if self.vertices.ndim != 2 or self.vertices.shape[1] != 3:
            raise InvalidValueError(f"vertices have shape {self.vertices.shape}: must be (n, 3) [m]")
        if self.triangles.ndim != 2 or self.triangles.shape[1] != 3:
            raise InvalidValueError(f"triangles have shape {self.triangles.shape}: must be (m, 3)")
        if self.triangles.size and not 0 <= self.triangles.min() <= self.triangles.max() < len(self.vertices):
            raise InvalidValueError(
                f"triangles name vertices {self.triangles.min()} to {self.triangles.max()}: "
                f"must be 0 to {len(self.vertices) - 1}"
            )


@dataclass(frozen=True, slots=True, eq=False)
class TimeSeries:
    """What happened over time, one entry per control period.

    Attributes:
        time: Increasing, shape (k,) [s].
        phase: Name of the controller's phase, length k; any sequence of strings is taken.
        measured_force: Normal force that touch found, shape (k,) [N]; NaN without contact.
        set_force: Normal force asked for, shape (k,) [N].
        spin_torque: Spin torque that touch found, shape (k,) [N m]; NaN without contact.
        speed: Speed of the fingertip, shape (k,) [m/s].
        true_force: Normal force of the simulation, shape (k,) [N], if known.
        true_spin_torque: Spin torque of the simulation, shape (k,) [N m], if known.

    Raises:
        InvalidValueError: Lengths differ.
    """

    time: FloatArray
    phase: Sequence[str]
    measured_force: FloatArray
    set_force: FloatArray
    spin_torque: FloatArray
    speed: FloatArray
    true_force: FloatArray | None = None
    true_spin_torque: FloatArray | None = None

    def __post_init__(self) -> None:
        count = len(self.time)
        names = ("phase", "measured_force", "set_force", "spin_torque", "speed", "true_force", "true_spin_torque")
        for name in names:
            values = getattr(self, name)
            if values is not None and len(values) != count:
                raise InvalidValueError(f"{name} has {len(values)} entries: must be {count}, one per time")
        object.__setattr__(self, "phase", tuple(str(name) for name in self.phase))


@dataclass(frozen=True, slots=True, eq=False)
class ExplorationReport:
    """All that a report on one exploration shows.

    Attributes:
        title: Heading.
        outcome: How it ended, one sentence.
        summary: Key figures, most important first.
        settings: Name and value with unit of each setting.
        cloud: What was felt.
        series: What happened over time.
        timing: How long the periods took.
        map: The touched surface, if enough was felt.
        shape: Which shape it is, if enough was felt to say.
        growth: How the map grew, if there is one.
        true_surface: What was explored, if known; for pictures only.
        point_error: Signed distance of each point of `cloud` from the true surface, positive outside, shape
            (n,) [m], if known.
        error_note: A sentence on where those errors come from, or "".
        asked: What was asked for, in words.
        advice: What to do now, a sentence or two each.
        repeat: What is repeated, and the command that does so.

    Raises:
        InvalidValueError: `point_error` has another length than `cloud`, or is not finite.
    """

    title: str
    outcome: str
    summary: tuple[KeyFigure, ...]
    settings: tuple[tuple[str, str], ...]
    cloud: TouchCloud
    series: TimeSeries
    timing: RunTiming
    map: MapReport | None = None
    shape: ShapeReport | None = None
    growth: GrowthReport | None = None
    true_surface: TrueSurface | None = None
    point_error: FloatArray | None = None
    error_note: str = ""
    asked: str = ""
    advice: tuple[str, ...] = ()
    repeat: tuple[tuple[str, str], ...] = ()

    def __post_init__(self) -> None:
        if self.point_error is None:
            return
        if self.point_error.shape != (len(self.cloud),):
            raise InvalidValueError(
                f"point_error has shape {self.point_error.shape}: must be ({len(self.cloud)},), one per contact"
            )
        if not np.isfinite(self.point_error).all():
            raise InvalidValueError("point_error: must be finite [m]; leave contacts without one out of the cloud")
