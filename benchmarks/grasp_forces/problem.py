"""What every solver is given: a grasp and its loads in numbers of about one, and how an answer is judged.

Forces are in units of the first load's size, lengths in units of the grasp's, and spin counts as u3 = tau / e, so
that no solver fails for want of scaling. x = (f, u1, u2, u3) of each contact.
"""

from dataclasses import dataclass, replace
from enum import Enum
from typing import Any, Protocol

import numpy as np

from palpate.errors import FloatArray
from palpate.grasp import GraspContacts
from palpate.grasp.problem.scaled import ScaledGrasp

WEIGHT = 0.01
"""eps of min_effort."""


@dataclass(frozen=True, slots=True, eq=False)
class Load:
    """A load as palpate takes it, shape (6,) [N, N m], and scaled, shape (6,)."""

    wrench: FloatArray
    scaled: FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class Problem:
    """A grasp, scaled.

    Attributes:
        grasp: In SI units.
        scaling: Moments about the middle of the contacts, lengths over the grasp's size.
        unit: Of force [N].
        rows: Contacts as palpate's solvers take them, forces in `unit`, shape (n, 17).
        columns: Equilibrium is columns @ x + load = 0, shape (6, 4 n).
        friction: mu, shape (n,).
        least: Of the normal forces, shape (n,).
        most: Of the normal forces, shape (n,); may be infinite.
    """

    grasp: GraspContacts
    scaling: ScaledGrasp
    unit: float
    rows: FloatArray
    columns: FloatArray
    friction: FloatArray
    least: FloatArray
    most: FloatArray

    @classmethod
    def of(cls, grasp: GraspContacts, wrench: FloatArray) -> "Problem":
        """Scale a grasp by a load that it is to hold, shape (6,) [N, N m]."""
        scaling = ScaledGrasp.of(grasp)
        unit = scaling.load(wrench)[1]
        columns = replace(grasp, positions=grasp.positions - scaling.center).grasp_map.copy()
        columns[:, 3::4] *= grasp.spin_length
        columns[3:] /= scaling.length
        return cls(
            grasp,
            scaling,
            unit,
            scaling.sized(unit),
            columns,
            grasp.friction,
            grasp.force_min / unit,
            grasp.force_max / unit,
        )

    def __len__(self) -> int:
        return len(self.friction)

    def load(self, wrench: FloatArray) -> Load:
        scaled, size = self.scaling.load(wrench)
        return Load(np.ascontiguousarray(wrench, float), scaled * (size / self.unit))

    def from_newtons(self, forces: FloatArray) -> FloatArray:
        """Return x, shape (n, 4), of forces [N, N, N, N m]."""
        x = forces / self.unit
        x[:, 3] /= self.grasp.spin_length
        return x

    def effort(self, x: FloatArray) -> float:
        return float((x[:, 0] ** 2).sum() + WEIGHT * (x[:, 1:] ** 2).sum())

    def violation(self, x: FloatArray, load: FloatArray) -> float:
        """Return the largest violation of equilibrium, cones or bounds, over the load's size."""
        left = np.abs(self.columns @ x.ravel() + load).max()
        cone = (np.linalg.norm(x[:, 1:], axis=1) - self.friction * x[:, 0]).max()
        bounds = max((self.least - x[:, 0]).max(), (x[:, 0] - self.most).max())
        return float(max(left, cone, bounds) / np.linalg.norm(load))


class Ended(Enum):
    """What a solver says of its own answer."""

    SOLVED = "solved"
    INFEASIBLE = "infeasible"
    UNDECIDED = "undecided"


@dataclass(frozen=True, slots=True, eq=False)
class Answer:
    """What a solver says, in the problem's units.

    Attributes:
        ended: Its own word.
        x: Forces, shape (n, 4).
        theta: Margin, peak or load factor; 0 for min_effort.
        evaluations: Or iterations, where the solver tells.
    """

    ended: Ended
    x: FloatArray
    theta: float = 0.0
    evaluations: int = 0


class Solver(Protocol):
    """A solver of one grasp, ready to be called once per period."""

    def solve(self, load: Load, *, warm: bool) -> Any:
        """Solve; only this is timed. Warm: from whatever is left of the last load."""
        ...

    def answer(self) -> Answer:
        """Return what was found last."""
        ...
