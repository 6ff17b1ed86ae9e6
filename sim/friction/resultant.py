"""Resultant of several rubbing contacts."""

from collections.abc import Sequence

from palpate.sim.friction.plant import FrictionContact
from palpate.spatial import ZERO, Vector, add, add_scaled, cross, scale, subtract


def resultant(contacts: Sequence[FrictionContact]) -> tuple[Vector, Vector, Vector]:
    """Return the force-weighted centroid [m], the force [N] and the torque about the centroid [N m], base frame.

    They act on the first geom of the contacts' pair.

    Args:
        contacts: At least one, all of one pair.
    """
    pressed, position = sum(contact.normal_force for contact in contacts), ZERO
    for contact in contacts:
        share = contact.normal_force / pressed if pressed > 0.0 else 1.0 / len(contacts)
        position = add_scaled(position, share, contact.position)
    force, torque = ZERO, ZERO
    for contact in contacts:
        load = add_scaled(contact.tangential_force, -contact.normal_force, contact.normal)
        force = add(force, load)
        arm = cross(subtract(contact.position, position), load)
        torque = add(torque, add(arm, scale(contact.spin_torque, contact.normal)))
    return position, force, torque
