"""Load and slip of a contact, the two quantities that friction relates.

Signs are those of `palpate.sensing.Contact`: loads are what the object exerts on the finger, the normal points out
of the fingertip into the object. Slip is of the object over the finger, so that friction on the finger acts along
it, and load times slip is the power that friction turns into heat.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from palpate.quick_init import quick_init
from palpate.spatial import Vector

if TYPE_CHECKING:
    from palpate.sensing.contact import Contact


@quick_init
@dataclass(frozen=True, slots=True)
class ContactLoad:
    """The load of a contact, or a change of it, in any frame.

    Attributes:
        normal_force: -f.n [N], positive when pushing.
        tangential_force: f - (f.n) n, in the tangent plane [N].
        spin_torque: q.n, about the normal [N m].
    """

    normal_force: float
    tangential_force: Vector
    spin_torque: float

    @classmethod
    def of(cls, contact: Contact) -> ContactLoad:
        """Return the load of a contact, in the sensor frame. Unless the contact's status is OK it is NaN."""
        x, y, z = contact.tangential_force.tolist()
        return cls(float(contact.normal_force), (x, y, z), float(contact.spin_torque))

    @property
    def tangential_length(self) -> float:
        """|f_t| [N]."""
        return math.hypot(*self.tangential_force)


@dataclass(frozen=True, slots=True)
class Slip:
    """How the object slips over the finger, in the frame of the load that goes with it.

    Attributes:
        velocity: In the tangent plane [m/s].
        spin: About the normal [rad/s].
    """

    velocity: Vector
    spin: float
