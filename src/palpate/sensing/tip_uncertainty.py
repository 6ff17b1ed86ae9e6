"""How uncertain the model of a fingertip is, and what that does to the contacts that are found on it.

A tip that sits elsewhere than believed, by d, has its contact where the believed one has it for the moment
m - d x f, moved by d. One that is turned by theta about its center has the contact of the wrench turned back. One
that is larger by e along its normals has that of the moment m + e f x n, moved by e n; so has one that yields by e
less. Hence the derivatives with respect to the model are those with respect to the wrench, combined.
"""

from dataclasses import dataclass

import numpy as np

from palpate.errors import FloatArray, not_negative
from palpate.estimation.covariance import covariance_matrix
from palpate.sensing.contact import Contacts
from palpate.sensing.contact_jacobian import ContactJacobians, cross_matrices

PARAMETERS = 8
"""Of the model: position (3), rotation (3), size, stiffness."""

POSITION, ROTATION, SIZE, STIFFNESS = slice(0, 3), slice(3, 6), 6, 7
"""Where each of them stands."""


@dataclass(frozen=True, slots=True, eq=False)
class TipUncertainty:
    """Covariance of the model of a fingertip, whose errors are the same for every contact.

    Attributes:
        covariance: Shape (8, 8), of position (3) of the tip in the sensor frame, or of the point that moments are
            about [m]; rotation (3) about the sensor's axes through the tip's center [rad]; size, by which the
            surface lies further out along its normals [m]; stiffness of a compliant tip, relative.

    Raises:
        InvalidValueError: It is no covariance.
    """

    covariance: FloatArray

    def __post_init__(self) -> None:
        remedy = "TipUncertainty.independent makes one of standard deviations"
        checked = covariance_matrix("covariance of the tip", self.covariance, PARAMETERS, remedy=remedy)
        object.__setattr__(self, "covariance", checked)

    @classmethod
    def independent(
        cls, size: float = 0.0, position: float = 0.0, rotation: float = 0.0, stiffness: float = 0.0
    ) -> "TipUncertainty":
        """Return that of standard deviations that are independent of one another.

        Args:
            size: By how much the surface lies further out along its normals: the radius of a sphere [m].
            position: Of the tip in the sensor frame, each axis, or of the point that moments are about [m].
            rotation: Of the tip in the sensor frame, about each axis through its center [rad].
            stiffness: Of a compliant tip, relative.

        Raises:
            InvalidValueError: One of them is negative or not finite.
        """
        each = (
            *[not_negative("position", position, "m")] * 3,
            *[not_negative("rotation", rotation, "rad")] * 3,
            not_negative("size", size, "m"),
            not_negative("stiffness", stiffness, ""),
        )
        return cls(np.diag(np.square(each)))

    @property
    def exact(self) -> bool:
        """Whether the tip is known exactly."""
        return not self.covariance.any()

    @property
    def size_sd(self) -> float:
        """Standard deviation of the size [m]."""
        return float(np.sqrt(self.covariance[SIZE, SIZE]))


EXACT = TipUncertainty.independent()
"""Of a tip that is known."""


def model_derivatives(
    contacts: Contacts, jacobians: ContactJacobians, center: FloatArray, yielding: FloatArray
) -> dict[str, FloatArray]:
    """Return derivatives with respect to the model's 8 parameters, by field of a contact.

    Args:
        contacts: n contacts.
        jacobians: Theirs.
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
    wrench = np.zeros((count, 6, PARAMETERS))
    arms = cross_matrices(f)
    wrench[:, 3:, POSITION] = arms
    about = moment - np.cross(center, f)
    wrench[:, :3, ROTATION] = arms
    wrench[:, 3:, ROTATION] = cross_matrices(about) + cross_matrices(center[None]) @ arms
    further = np.column_stack([np.ones(count), yielding * contacts.normal_force])
    wrench[:, 3:, SIZE:] = np.cross(f, n)[:, :, None] * further[:, None, :]

    def turned(vector: FloatArray) -> FloatArray:
        moved = np.zeros((count, 3, PARAMETERS))
        moved[:, :, ROTATION] = -cross_matrices(vector)
        return moved

    shifted = turned(c - center)
    shifted[:, :, POSITION] += np.eye(3)
    shifted[:, :, SIZE:] += n[:, :, None] * further[:, None, :]
    return {
        "centroid": jacobians.centroid @ wrench + shifted,
        "normal": jacobians.normal @ wrench + turned(n),
        "normal_force": jacobians.normal_force[:, None] @ wrench,
        "tangential_force": jacobians.tangential_force @ wrench + turned(contacts.tangential_force),
        "spin_torque": jacobians.spin_torque[:, None] @ wrench,
    }
