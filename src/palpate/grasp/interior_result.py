"""What an interior point method returns."""

from dataclasses import dataclass
from enum import Enum

from palpate.errors import FloatArray

__all__ = ["InteriorPointResult", "InteriorPointStatus"]


class InteriorPointStatus(Enum):
    """How it ended."""

    SOLVED = "solved"
    """Optimal: residuals within 1e-9 of the load's scale, relative gap within 1e-8."""
    NEARLY = "nearly solved"
    """Optimal for a load that differs by 3e-10 of its size: next to the largest there is no better."""
    INFEASIBLE = "infeasible"
    """No forces within the limits hold the load: `certificate` proves it."""
    UNBOUNDED = "unbounded"
    """Theta may grow without end: forces are the direction in which they grow with it, to a theta of 1."""
    MAX_ITERATIONS = "max iterations"
    """Undecided."""


@dataclass(frozen=True, slots=True, eq=False)
class InteriorPointResult:
    """What `InteriorPoint.solve` found, in the units of its input.

    Attributes:
        status: How it ended.
        forces: (f, u1, u2, u3) of each contact, shape (n, 4).
        theta: Margin, peak or load factor; 0 for min_effort, infinity if unbounded.
        dual: Multipliers y of equilibrium, shape (6,): cost - z.limits + y.(equilibrium) is stationary.
        multipliers: Those of each contact's cone and rows (see `statement`), shape (n, 4 + m).
        iterations: How many.
        primal_residual: Largest violation of equilibrium or of a limit, over the load's scale.
        gap: What the forces cost more than they must, relative, at most.
        certificate: Unit y (6,), if infeasible: y . (sum wrench(x) + load) > 0 for all x within the limits.
    """

    status: InteriorPointStatus
    forces: FloatArray
    theta: float
    dual: FloatArray
    multipliers: FloatArray
    iterations: int
    primal_residual: float
    gap: float
    certificate: FloatArray | None
