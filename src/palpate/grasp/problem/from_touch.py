"""Conversion of measured contacts to a grasp, and back.

A contact is given from its sensor's side: what the object exerts on the finger, in the sensor frame. A grasp, from
the object: what fingers exert on it. Points and directions change frame by a pose; of the four numbers that a soft
contact bears, `other_side` alone changes signs.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from palpate.errors import FloatArray, InvalidValueError
from palpate.friction import LimitSurface
from palpate.grasp.problem.contacts import GraspContacts
from palpate.kinematics import Pose
from palpate.kinematics.pose import times
from palpate.sensing.contact import Contact, ContactStatus
from palpate.spatial import Matrix, Vector, Wrench, add, add_scaled, as_vector, cross, dot, rotate, scale, unit

__all__ = [
    "ContactPlace",
    "TouchedGrasp",
    "contact_place",
    "force_on_object",
    "grasp_from_touch",
    "other_side",
    "wrench_on_finger",
]

SoftLoad = tuple[float, float, float, float]
"""(f_n, f_t1, f_t2, tau_n) in a contact's frame [N, N, N, N m]."""

BEHIND = 1e-12
"""How near to -z, from the finger into its own sensor, a normal has no shortest turn from z."""


def other_side(load: SoftLoad) -> SoftLoad:
    """Return the reaction of the other side of a contact; its own inverse.

    On the finger's side it is (normal_force, t1 . tangential_force, t2 . tangential_force, spin_torque) of
    `Contact`, on the object's side a row of grasp forces. Both call pushing positive, so that f_n stays; friction
    and spin change sign.
    """
    f, a, b, tau = load
    return (f, -a, -b, -tau)


@dataclass(frozen=True, slots=True)
class ContactPlace:
    """Where a contact is and how its frame stands; in the sensor's frame or in the object's.

    Attributes:
        position: The centroid [m].
        frame: n, t1, t2 as columns; n points into the object.
    """

    position: Vector
    frame: Matrix

    def seen_from(self, pose: Pose) -> "ContactPlace":
        """Return it in frame a, given in frame b, with pose_a_b."""
        return ContactPlace(
            add(pose.position, rotate(pose.rotation, self.position)), times(pose.rotation, self.frame)
        )


@dataclass(frozen=True, slots=True, eq=False)
class TouchedGrasp:
    """A grasp by those fingers that touch.

    Attributes:
        grasp: In the object's frame.
        fingers: Which finger each of its contacts is.
    """

    grasp: GraspContacts
    fingers: tuple[int, ...]


def contact_place(contact: Contact) -> ContactPlace:
    """Return a contact's place in the sensor frame.

    t1 is the sensor's x axis, carried along by the shortest turn that takes the sensor's z axis to n: no memory,
    no friction to follow, and smooth in n everywhere but at n = -z, from the fingertip back into its own sensor,
    where none is touched. (A field of tangents on the whole sphere has to jump somewhere.) The object's frame has
    no part in it, so that t1 turns with the finger.

    Args:
        contact: With status OK.

    Raises:
        InvalidValueError: Any other status: its numbers are NaN.
    """
    _check_status(contact)
    x, y, z = as_vector(contact.centroid)
    n = unit(as_vector(contact.normal))
    if n[2] < -1.0 + BEHIND:
        t1: Vector = (1.0, 0.0, 0.0)
    else:
        t1 = (1.0 - n[0] * n[0] / (1.0 + n[2]), -n[0] * n[1] / (1.0 + n[2]), -n[0])
    t1 = unit(add_scaled(t1, -dot(t1, n), n))
    t2 = cross(n, t1)
    return ContactPlace((x, y, z), ((n[0], t1[0], t2[0]), (n[1], t1[1], t2[1]), (n[2], t1[2], t2[2])))


def grasp_from_touch(
    contacts: Sequence[Contact],
    poses_object_sensor: Sequence[Pose],
    surfaces: Sequence[LimitSurface],
    force_min: float = 0.0,
    force_max: float = np.inf,
) -> TouchedGrasp | None:
    """Return the grasp by all fingers whose contact is known (status OK), in their order; None if there is none.

    Fingers that come and go change the number of contacts: compare `fingers` with those of the period before.

    Args:
        contacts: One per finger, whether it touches or not.
        poses_object_sensor: Where each finger's sensor frame is in the object's (or hand's) frame.
        surfaces: What each finger's contact bears.
        force_min: Least normal force of each [N].
        force_max: Largest normal force of each [N].

    Raises:
        InvalidValueError: Not as many poses or surfaces as contacts.
    """
    if not len(contacts) == len(poses_object_sensor) == len(surfaces):
        raise InvalidValueError(
            f"{len(contacts)} contacts, {len(poses_object_sensor)} poses, {len(surfaces)} surfaces: give "
            f"one of each per finger"
        )
    fingers = tuple(i for i, each in enumerate(contacts) if each.status is ContactStatus.OK)
    if not fingers:
        return None
    places = [contact_place(contacts[i]).seen_from(poses_object_sensor[i]) for i in fingers]
    borne = [surfaces[i] for i in fingers]
    grasp = GraspContacts(
        positions=np.array([each.position for each in places]),
        frames=np.array([each.frame for each in places]),
        friction=np.array([each.friction for each in borne]),
        spin_length=np.array([each.spin_length for each in borne]),
        force_min=np.full(len(borne), force_min),
        force_max=np.full(len(borne), force_max),
        load_exponent=np.array([each.load_exponent for each in borne]),
        norm_exponent=np.array([each.norm_exponent for each in borne]),
    )
    return TouchedGrasp(grasp, fingers)


def force_on_object(contact: Contact) -> SoftLoad:
    """Return what a finger exerts on the object: a row of grasp forces, in the frame of `contact_place`.

    Args:
        contact: With status OK.

    Raises:
        InvalidValueError: Any other status.
    """
    frame = contact_place(contact).frame
    friction = as_vector(contact.tangential_force)
    a = frame[0][1] * friction[0] + frame[1][1] * friction[1] + frame[2][1] * friction[2]
    b = frame[0][2] * friction[0] + frame[1][2] * friction[1] + frame[2][2] * friction[2]
    return other_side((float(contact.normal_force), a, b, float(contact.spin_torque)))


def wrench_on_finger(force: SoftLoad | FloatArray, place: ContactPlace) -> Wrench:
    """Return what a finger feels that exerts a row of grasp forces on the object, about the frame's origin.

    Args:
        force: (f_n, f_t1, f_t2, tau_n) on the object.
        place: Of the contact, in the sensor's frame for what its sensor says (weight and inertia aside).
    """
    pushing, a, b, tau = (float(each) for each in force)
    normal, one, two, spin = other_side((pushing, a, b, tau))
    # the object pushes back along -n
    f = rotate(place.frame, (-normal, one, two))
    m = add(cross(place.position, f), scale(spin, (place.frame[0][0], place.frame[1][0], place.frame[2][0])))
    return (*f, *m)


def _check_status(contact: Contact) -> None:
    if contact.status is not ContactStatus.OK:
        raise InvalidValueError(
            f"contact.status = {contact.status.name}: only a contact with status OK has a place; leave it out, as "
            f"grasp_from_touch does"
        )
