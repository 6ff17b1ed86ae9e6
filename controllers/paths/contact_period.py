"""What a strategy observes while the tip slides."""

from dataclasses import dataclass

from palpate.quick_init import quick_init
from palpate.spatial import Vector


@quick_init
@dataclass(frozen=True, slots=True)
class ContactPeriod:
    """One period in contact.

    Attributes:
        tip: Origin of the tip frame, base coordinates [m].
        contact: Contact centroid, base coordinates [m].
        normal: The object's outward unit normal there, base coordinates: minus that of the finger's contact.
    """

    tip: Vector
    contact: Vector
    normal: Vector
