"""What a report says of how a map grew: a few numbers at many moments, pictures at a few."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from palpate.errors import FloatArray, InvalidValueError
from palpate.mapping import SurfaceMesh
from palpate.spatial import Vector


class MarkLike(Protocol):
    """A place with a word, as strategies leave them."""

    @property
    def event(self) -> str:
        """What it was, in a word."""
        ...

    @property
    def position(self) -> Vector:
        """Where, base frame [m]."""
        ...


@dataclass(frozen=True, slots=True, eq=False)
class GrowthCurve:
    """How much was known when, k moments.

    Attributes:
        time: From the beginning of the run, shape (k,) [s].
        contacts: So far, shape (k,).
        way: Of the tip so far, lifted or not, shape (k,) [m].
        area: Observed, shape (k,) [m^2].
        middle: Standard deviation that half of that area stays below, shape (k,) [m]; NaN without area.
        tail: Likewise for 95 % of it, shape (k,) [m].

    Raises:
        InvalidValueError: Lengths differ.
    """

    time: FloatArray
    contacts: FloatArray
    way: FloatArray
    area: FloatArray
    middle: FloatArray
    tail: FloatArray

    def __post_init__(self) -> None:
        for name in self.__slots__:
            if len(getattr(self, name)) != len(self.time):
                raise InvalidValueError(
                    f"{name} has {len(getattr(self, name))} entries: must be {len(self.time)}, one per moment"
                )

    def __len__(self) -> int:
        """Number of moments."""
        return len(self.time)


@dataclass(frozen=True, slots=True, eq=False)
class GrowthSnapshot:
    """The map at one moment.

    Attributes:
        moment: Which of the curve's it is.
        mesh: What was observed by then.
        done: Where the tip was by then, shape (n, 3) [m].
        to_go: Of the leg of that moment, what the tip had still to go, shape (m, 3) [m]; empty if what is felt
            leads.
        marks: By then.
    """

    moment: int
    mesh: SurfaceMesh
    done: FloatArray
    to_go: FloatArray
    marks: Sequence[MarkLike]


@dataclass(frozen=True, slots=True, eq=False)
class GrowthReport:
    """How a map grew.

    Attributes:
        curve: Over all moments.
        snapshots: In order, at least one.

    Raises:
        InvalidValueError: There is no snapshot, or one of a moment that the curve does not have.
    """

    curve: GrowthCurve
    snapshots: tuple[GrowthSnapshot, ...]

    def __post_init__(self) -> None:
        if not self.snapshots:
            raise InvalidValueError("there are no snapshots: a growth needs at least one")
        for each in self.snapshots:
            if not 0 <= each.moment < len(self.curve):
                raise InvalidValueError(f"moment = {each.moment}: must be from 0 to {len(self.curve) - 1}")

    @property
    def largest_sd(self) -> float:
        """Standard deviation that 98 % of all vertices stay below [m]: where a common scale of colours ends."""
        found = np.concatenate([np.zeros(0), *(each.mesh.sd for each in self.snapshots)])
        found = found[np.isfinite(found)]
        return float(np.percentile(found, 98.0)) if len(found) else 0.0
