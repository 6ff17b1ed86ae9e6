"""Guards: a condition, how long it may be broken, and what is done then (guarded motion)."""

from dataclasses import dataclass, field

from palpate.errors import not_negative
from palpate.runtime.supervision.conditions import Condition
from palpate.runtime.supervision.reactions import Reaction, Stop


@dataclass(frozen=True, slots=True)
class Guard:
    """Trips when a condition is broken for long enough.

    Attributes:
        condition: What should hold.
        duration: How long it may be broken without a break [s].
        reaction: What is done then, one stage after the other; at its end the robot stands still.
    """

    condition: Condition
    duration: float = 0.0
    reaction: tuple[Reaction, ...] = field(default_factory=lambda: (Stop(),))

    def __post_init__(self) -> None:
        not_negative("guard duration", self.duration, "s")
