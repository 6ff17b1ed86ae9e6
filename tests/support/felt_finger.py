"""What a finger that presses feels, made up."""

import numpy as np

from palpate.runtime.data import FingerObservation
from palpate.sensing.contact import Contact, ContactStatus
from palpate.sensing.ft.health import HEALTHY


def finger(tangential=0.0, torque=0.0, normal=3.0, *, touching=True, health=HEALTHY, time=0.0):
    """A finger that presses along x of its sensor, with the load along y."""
    contact = Contact(
        centroid=np.zeros(3),
        normal=np.array([1.0, 0.0, 0.0]),
        force=np.array([-normal, tangential, 0.0]),
        normal_force=normal,
        tangential_force=np.array([0.0, tangential, 0.0]),
        spin_torque=torque,
        condition=1.0,
        status=ContactStatus.OK if touching else ContactStatus.NO_FORCE,
    )
    return FingerObservation(time, (-normal, tangential, 0.0, torque, 0.0, 0.0), contact, touching, health)
