"""What is known to come of a load: an arm's own motion, or what somebody announces."""

import math
from dataclasses import dataclass

from palpate.errors import InvalidValueError, check_not_negative
from palpate.sensing.ft.poses import STANDARD_GRAVITY


@dataclass(frozen=True, slots=True)
class ExpectedLoad:
    """A load that is expected to come on top of what hangs now, in whatever direction.

    Attributes:
        begin: When it begins at the earliest [s].
        end: When fingers feel it, or it is over [s]: from then on what is felt counts.
        force: On the object [N].
        moment: About the line of the contacts [N m].
        acceleration: Of the hand [m/s^2]: what hangs pulls by a / g more.
    """

    begin: float
    end: float
    force: float = 0.0
    moment: float = 0.0
    acceleration: float = 0.0

    def __post_init__(self) -> None:
        if not (math.isfinite(self.begin) and self.begin <= self.end < math.inf):
            raise InvalidValueError(
                f"begin = {self.begin!r}, end = {self.end!r} s: must be finite, the end not before the beginning"
            )
        check_not_negative(self, force="N", moment="N m", acceleration="m/s^2")

    @property
    def more(self) -> float:
        """Share by which what hangs pulls more."""
        return self.acceleration / STANDARD_GRAVITY
