"""A hand on a carrier: the palm."""

import mujoco

from palpate.sim.carriers.carrier import Carrier
from palpate.sim.hand.hand_model import HandModel
from palpate.spatial import Vector

PALM = "palm"
"""Name of the body whose frame is the hand frame."""


def mount_hand(spec: mujoco.MjSpec, hand: HandModel, carrier: Carrier, start: Vector) -> None:
    """Add a carrier and a hand on it to a scene.

    Args:
        spec: The scene.
        hand: The hand.
        carrier: What carries it, made for its weight.
        start: Where the hand frame starts, upright, base frame [m].
    """
    hand.add_to(spec, carrier.mount(spec, hand, start).add_body(name=PALM))
