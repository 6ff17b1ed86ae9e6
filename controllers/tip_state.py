"""What a contact controller knows of its fingertip in one period, in base coordinates."""

from dataclasses import dataclass

from palpate.quick_init import quick_init
from palpate.spatial import Vector


@quick_init
@dataclass(frozen=True, slots=True)
class TipState:
    """The tip in one period; normal and lever are from when it last touched.

    Attributes:
        time: [s].
        position: Of the tip frame's origin [m].
        tip: Of the point that follows a path: the origin, or where a pivot of the tip would have carried it had
            the tip not turned [m].
        touching: Whether it touches.
        normal: Unit, into the object, as measured.
        lever: From the tip frame's origin to the contact [m].
    """

    time: float
    position: Vector
    tip: Vector
    touching: bool
    normal: Vector
    lever: Vector
