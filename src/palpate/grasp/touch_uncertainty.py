"""What sensors do not know of their contacts, as what is not known of a grasp."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from palpate.errors import InvalidValueError
from palpate.grasp.from_touch import contact_place
from palpate.grasp.uncertainty import GraspUncertainty
from palpate.kinematics import Pose
from palpate.sensing.contact import Contact, ContactStatus
from palpate.sensing.uncertainty import ContactUncertainty

__all__ = ["uncertainty_from_touch"]


def uncertainty_from_touch(
    contacts: Sequence[Contact],
    uncertainties: Sequence[ContactUncertainty],
    poses_object_sensor: Sequence[Pose],
    friction: ArrayLike,
    spin_length: ArrayLike,
    load: ArrayLike | None = None,
) -> GraspUncertainty:
    """Return the uncertainty that goes with `grasp_from_touch`: of fingers whose contact is known, in their order.

    A centroid and the normal there err together, which is left out: on a tip of radius r a shift by dx turns the
    normal by dx / r, and a grasp feels both.

    Args:
        contacts: One per finger, whether it touches or not.
        uncertainties: Of them; those of contacts that are not OK are not looked at.
        poses_object_sensor: Where each finger's sensor frame is in the object's (or hand's) frame.
        friction: Of the fingers that touch: as in `GraspUncertainty`.
        spin_length: The same.
        load: As in `GraspUncertainty`.

    Raises:
        InvalidValueError: Not as many uncertainties or poses as contacts, or no contact that is OK.
    """
    if not len(contacts) == len(uncertainties) == len(poses_object_sensor):
        raise InvalidValueError(
            f"{len(contacts)} contacts, {len(uncertainties)} uncertainties, {len(poses_object_sensor)} poses: "
            f"give one of each per finger"
        )
    positions, normals = [], []
    for contact, known, pose in zip(contacts, uncertainties, poses_object_sensor, strict=True):
        if contact.status is not ContactStatus.OK:
            continue
        rotation, tangents = np.array(pose.rotation), np.array(contact_place(contact).frame)[:, 1:]
        positions.append(rotation @ known.centroid @ rotation.T)
        normals.append(tangents.T @ known.normal @ tangents)
    if not positions:
        raise InvalidValueError("contacts: none has status OK, so that there is no grasp")
    return GraspUncertainty(friction, spin_length, np.array(positions), np.array(normals), load)
