"""What an estimator says of its own estimate: OK only if the assumptions of its model were tested, and held."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from enum import StrEnum


class Assumption(StrEnum):
    """What estimators assume; one vocabulary for payloads, tares, calibrations, friction, shapes and maps."""

    ENOUGH_DATA = "there are enough data"
    CONDITIONED = "the data determine every parameter"
    CONVERGED = "the iteration converged"
    WITHIN_BOUNDS = "nothing is at a bound"
    NOISE_LEVEL = "residuals are as large as the noise explains"
    WHITE_IN_TIME = "residuals do not depend on time"
    WHITE_IN_PLACE = "residuals do not depend on place"
    WHITE_IN_DIRECTION = "residuals do not depend on direction"
    EVEN_INFLUENCE = "no few data carry the estimate"
    NO_OUTLIERS = "no data are far from all others"
    RESOLVED = "the sampling is finer than what is measured"
    CONSISTENT = "independent kinds of data agree"
    UNIQUE = "nothing else explains the data as well"
    PLAUSIBLE = "values are plausible in their units"


@dataclass(frozen=True, slots=True)
class BrokenAssumption:
    """An assumption that the data contradict.

    Attributes:
        assumption: Which.
        finding: By how much, with value and limit: "lag-1 correlation 0.83, at most 0.2".
        remedy: What to do about it.
    """

    assumption: Assumption
    finding: str
    remedy: str

    def __str__(self) -> str:
        """One line."""
        return f"not so that {self.assumption}: {self.finding}; {self.remedy}"


def ill_conditioned(condition: float, largest: float, remedy: str) -> Iterator[BrokenAssumption]:
    """Return that a condition number is too large, if it is."""
    if condition > largest:
        finding = f"condition number {condition:.3g}, at most {largest:g}"
        yield BrokenAssumption(Assumption.CONDITIONED, finding, remedy)


@dataclass(frozen=True, slots=True)
class Verdict:
    """Which assumptions were tested and did not hold.

    Attributes:
        broken: Worst first; none: the estimate and its intervals can be used.
    """

    broken: tuple[BrokenAssumption, ...] = ()

    @property
    def ok(self) -> bool:
        """Whether all that was tested held."""
        return not self.broken

    def breaks(self, assumption: Assumption) -> bool:
        """Return whether an assumption was found broken."""
        return any(each.assumption is assumption for each in self.broken)

    @property
    def names(self) -> str:
        """Names of the assumptions that are broken, with commas between."""
        return ", ".join(each.assumption.name for each in self.broken)

    def lines(self) -> tuple[str, ...]:
        """Return one sentence per broken assumption; "OK" if there is none."""
        return tuple(map(str, self.broken)) or ("OK: all assumptions were tested on the data, and held",)

    def __str__(self) -> str:
        """All of it in one line."""
        return "; ".join(self.lines())

    def and_also(self, others: "Iterable[BrokenAssumption] | Verdict") -> "Verdict":
        """Return the verdict with more that is broken behind."""
        return Verdict((*self.broken, *(others.broken if isinstance(others, Verdict) else others)))


HELD = Verdict()
"""Everything held."""
