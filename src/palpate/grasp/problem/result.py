"""What an optimiser of grasp forces returns."""

from dataclasses import dataclass
from enum import Enum

from palpate.errors import FloatArray

__all__ = ["GraspForces", "SolveStatus"]


class SolveStatus(Enum):
    """How it ended."""

    SOLVED = "solved"
    """Optimal, within all limits."""
    INFEASIBLE = "infeasible"
    """No forces within the limits hold the load: `certificate` proves it, or a largest margin below zero; where
    limits exclude each other whatever the load, `reason` names them, and forces are zero. Otherwise forces keep
    all limits and leave least of the load; those of max_margin balance it, and exceed the limits least."""
    MAX_ITERATIONS = "max iterations"
    """Undecided; forces keep all limits of the contacts and hold the load but for `equilibrium_residual`."""
    INVALID = "invalid"
    """The load is not finite, or so large that forces or effort would not be; forces are zero."""


@dataclass(frozen=True, slots=True, eq=False)
class GraspForces:
    """Forces of n contacts on the object.

    Attributes:
        forces: (f_n, f_t1, f_t2, tau_n) of each contact on the object, in its frame, shape (n, 4) [N, N, N, N m].
        objective: Its value: min_effort [N^2], max_margin and min_peak [N], load_factor a ratio, of one's
            own as it was given.
        margin: mu f_n - |(f_t, tau / e)|_p of each contact, shape (n,) [N].
        equilibrium_residual: G w + w_ext about the object's origin, shape (6,) [N, N m].
        dual: Multipliers of equilibrium, shape (6,): by what the least effort grows with the load.
        iterations: Of whatever solved it.
        status: How it ended.
        load_factor: Largest factor of the load that could be held; None where it was not asked for.
        certificate: Unit y (6,), where nothing holds: y . (G w + w_ext) > 0 for all forces within the limits, in
            exact arithmetic on the numbers given; None otherwise, and from max_margin.
        reach: Sum of the normal forces, at contacts without a largest one, up to which the certificate holds [N];
            infinite if it needs no bound, None without a certificate.
        local: Whether forces elsewhere may be better still: what was asked for is not convex, or not known to be.
        reason: Why it is not solved, where own objectives, own limits or shared actuators are part of it.
    """

    forces: FloatArray
    objective: float
    margin: FloatArray
    equilibrium_residual: FloatArray
    dual: FloatArray
    iterations: int
    status: SolveStatus
    load_factor: float | None = None
    certificate: FloatArray | None = None
    reach: float | None = None
    local: bool = False
    reason: str = ""
