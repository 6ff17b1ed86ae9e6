"""A hand on a carrier: the palm."""

import mujoco

from palpate.sim.carriers.carrier import Carrier
from palpate.sim.hand.hand import Hand
from palpate.spatial import Vector

PALM = "palm"
"""Name of the body whose frame is the hand frame."""


def mount_hand(spec: mujoco.MjSpec, hand: Hand, carrier: Carrier, start: Vector) -> None:
    """Add a carrier and a hand on it to a scene, joints at 0.

    Args:
        spec: The scene.
        hand: The hand.
        carrier: What carries it, made for its weight.
        start: Where the hand frame starts, upright, base frame [m].
    """
    palm = carrier.mount(spec, hand, start).add_body(name=PALM)
    palm.explicitinertial = True
    palm.mass = hand.palm_mass
    # a disc as wide as the fingers stand
    across = hand.palm_mass * hand.opening**2 / 4.0
    palm.inertia = [across, across, 2.0 * across]
    hand.add_to(spec, palm)
