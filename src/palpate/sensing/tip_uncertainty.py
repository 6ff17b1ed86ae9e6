"""How uncertain the model of a fingertip is, and what that does to the contacts that are found on it.

A tip that sits elsewhere than believed, by d, has its contact where the believed one has it for the moment
m - d x f, moved by d. One that is turned by theta about its center has the contact of the wrench turned back. One
that is larger by e along its normals has that of the moment m + e f x n, moved by e n; so has one that yields by e
less. Hence the derivatives with respect to the model are those with respect to the wrench, combined.
"""

from dataclasses import dataclass

import numpy as np

from palpate.errors import FloatArray, not_negative
from palpate.sensing.contact import Contacts
from palpate.sensing.contact_jacobian import ContactJacobians, cross_matrices


@dataclass(frozen=True, slots=True)
class TipUncertainty:
    """Standard deviations of the model of a fingertip, independent of one another.

    Attributes:
        size: By how much the surface lies further out along its normals: the radius of a sphere [m].
        position: Of the tip in the sensor frame, each axis, or of the point that moments are about [m].
        rotation: Of the tip in the sensor frame, about each axis through its center [rad].
        stiffness: Of a compliant tip, relative.
    """

    size: float = 0.0
    position: float = 0.0
    rotation: float = 0.0
    stiffness: float = 0.0

    def __post_init__(self) -> None:
        for name, unit in (("size", "m"), ("position", "m"), ("rotation", "rad"), ("stiffness", "")):
            object.__setattr__(self, name, not_negative(name, getattr(self, name), unit))


EXACT = TipUncertainty()
"""Of a tip that is known."""


def model_derivatives(
    contacts: Contacts, jacobians: ContactJacobians, tip: TipUncertainty, center: FloatArray, yielding: FloatArray
) -> dict[str, FloatArray]:
    """Return derivatives times standard deviations of the model's 8 parameters, by field of a contact.

    Args:
        contacts: n contacts.
        jacobians: Theirs.
        tip: How uncertain the model is.
        center: Of the tip, sensor frame, shape (3,) [m].
        yielding: How much deeper each centroid lies per normal force, shape (n,) [m/N].

    Returns:
        Position (3), rotation (3), size, stiffness in the last axis: shape (n, 3, 8) for vectors, (n, 1, 8) for
        scalars.
    """
    f, n, c = contacts.force, contacts.normal, contacts.centroid
    moment = contacts.spin_torque[:, None] * n + np.cross(c, f)
    count = len(f)
    # the wrench whose believed contact it is: d(f, m) / d(parameters)
    wrench = np.zeros((count, 6, 8))
    arms = cross_matrices(f)
    wrench[:, 3:, :3] = tip.position * arms
    about = moment - np.cross(center, f)
    wrench[:, :3, 3:6] = tip.rotation * arms
    wrench[:, 3:, 3:6] = tip.rotation * (cross_matrices(about) + cross_matrices(center[None]) @ arms)
    further = np.column_stack([np.full(count, tip.size), tip.stiffness * yielding * contacts.normal_force])
    wrench[:, 3:, 6:] = np.cross(f, n)[:, :, None] * further[:, None, :]

    def turned(vector: FloatArray) -> FloatArray:
        moved = np.zeros((count, 3, 8))
        moved[:, :, 3:6] = -tip.rotation * cross_matrices(vector)
        return moved

    shifted = turned(c - center)
    shifted[:, :, :3] += tip.position * np.eye(3)
    shifted[:, :, 6:] += n[:, :, None] * further[:, None, :]
    return {
        "centroid": jacobians.centroid @ wrench + shifted,
        "normal": jacobians.normal @ wrench + turned(n),
        "normal_force": jacobians.normal_force[:, None] @ wrench,
        "tangential_force": jacobians.tangential_force @ wrench + turned(contacts.tangential_force),
        "spin_torque": jacobians.spin_torque[:, None] @ wrench,
    }
