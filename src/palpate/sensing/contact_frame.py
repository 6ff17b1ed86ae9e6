"""The soft finger's contact frame (Bicchi 1990, section 2), in plain floats.

Its origin is the contact centroid c, its z axis the **inward** normal of the fingertip (-n, since n points outward
here), its y axis is perpendicular to the contact force f; so x points where the friction acts on the finger.
In it the contact needs three numbers:

    force  (f_x, 0, f_z):  f_x = |tangential force| >= 0,  f_z = f.(-n) = normal_force >= 0
    torque (0, 0, q_z):    q_z = q.(-n) = -spin_torque
"""

import math
from dataclasses import dataclass

from palpate.errors import InvalidValueError, positive
from palpate.sensing.contact import Contact, ContactStatus
from palpate.spatial import Matrix, Vector, add_scaled, as_vector, cross, dot, norm, scale, unit


@dataclass(frozen=True, slots=True)
class ContactFrame:
    """Where the soft finger frame is, and the contact in it.

    Attributes:
        origin: The contact centroid, sensor frame [m].
        rotation_sensor_contact: Maps contact to sensor coordinates; its columns are x, y, z.
        friction_force: f.x [N]: all of the tangential force, never negative, while `is_along_friction`.
        normal_force: f.z [N], positive when pushing; the same as that of `Contact`.
        spin_torque: q.z [N m]: about the inward normal, so **minus** that of `Contact`.
        is_along_friction: Whether x is the friction's direction; else friction is too small to have one, x is
            near where it was, and the tangential force has a part along y.
    """

    origin: Vector
    rotation_sensor_contact: Matrix
    friction_force: float
    normal_force: float
    spin_torque: float
    is_along_friction: bool

    @property
    def x(self) -> Vector:
        """The x axis in the sensor frame; give it to the next `contact_frame`."""
        a, b, c = self.rotation_sensor_contact
        return (a[0], b[0], c[0])


def contact_frame(contact: Contact, friction_noise: float, x_before: Vector | None = None) -> ContactFrame:
    """Return the soft finger frame of a contact.

    Friction below the noise has no direction, and no rule without memory can put another in its place
    continuously: x would have to be continuous over the disc of small forces and equal the friction's direction
    all around it, which no map does (Brouwer). So x remembers. Below `friction_noise` it is `x_before`, laid
    into the contact plane; above twice that it is exactly the friction's direction; between, x turns from the
    first towards the second by the share of the way. It is then continuous in contact and `x_before`, except
    where friction beyond the noise turns by half a circle at once.

    Args:
        contact: With status OK.
        friction_noise: Tangential force that may be noise [N]: three standard deviations are a good choice
            (`palpate.sensing.uncertainty`).
        x_before: x of the frame one period ago, sensor frame. None where there is none yet: then x is the sensor's
            x axis, carried along by the shortest turn that takes the sensor's z axis to n; defined everywhere
            but at n = -z, behind the finger.

    Raises:
        InvalidValueError: The contact's status is not OK, or the noise is not above zero.
    """
    positive("friction_noise", friction_noise, "N")
    if contact.status is not ContactStatus.OK:
        raise InvalidValueError(
            f"contact.status = {contact.status.name}: only a contact with status OK has a frame"
        )
    n = as_vector(contact.normal)
    friction = as_vector(contact.tangential_force)
    size = norm(friction)
    along = size >= 2.0 * friction_noise
    if along:
        x = _laid_into_plane(friction, n) or _carried_axis(n)
    else:
        kept = (x_before and _laid_into_plane(x_before, n)) or _carried_axis(n)
        share = max(0.0, size / friction_noise - 1.0)
        x = _turned(kept, _laid_into_plane(friction, n), n, share)
    z = scale(-1.0, n)
    y = cross(z, x)
    return ContactFrame(
        origin=as_vector(contact.centroid),
        rotation_sensor_contact=((x[0], y[0], z[0]), (x[1], y[1], z[1]), (x[2], y[2], z[2])),
        friction_force=dot(friction, x),
        normal_force=contact.normal_force,
        spin_torque=-contact.spin_torque,
        is_along_friction=along,
    )


_FLAT = 1e-9
"""A direction whose part in the plane is a smaller share than this is across the plane: rounding decides it."""


def _laid_into_plane(a: Vector, n: Vector) -> Vector | None:
    """Return the unit vector along the part of a across n; None where a is along n or zero."""
    part = add_scaled(a, -dot(a, n), n)
    length = norm(part)
    if length <= _FLAT * norm(a):
        return None
    # once more, since the first projection leaves a rounding error along n
    part = scale(1.0 / length, part)
    return unit(add_scaled(part, -dot(part, n), n))


def _carried_axis(n: Vector) -> Vector:
    """Return the sensor's x axis after the shortest turn that takes z to n."""
    x, y, z = n
    if z < -1.0 + 1e-12:
        return (1.0, 0.0, 0.0)  # the one direction without a shortest turn
    return unit((1.0 - x * x / (1.0 + z), -x * y / (1.0 + z), -x))


def _turned(start: Vector, end: Vector | None, n: Vector, share: float) -> Vector:
    """Return start turned about n by a share of the way to end; all across n."""
    if end is None or share == 0.0:
        return start
    aside = cross(n, start)
    angle = share * math.atan2(dot(end, aside), dot(end, start))
    return unit(add_scaled(scale(math.cos(angle), start), math.sin(angle), aside))
