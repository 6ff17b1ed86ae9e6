"""Feeling through what is held: a box between two fingers is lowered on the edge of a table.

What the fingers' sensors feel together, less the box's weight, is what the table exerts on it. To and fro, that
tells where it touches, and whether at several places: on a level table it lies on its edge, else two edges cross.

    python examples/held_tool.py --table-falls 0.1
"""

import math

import numpy as np
import tyro

import palpate as pp
from palpate.kinematics.pose import Pose, rotation_from_rotvec
from palpate.runtime import Finger
from palpate.sensing.compensation import SensorPayload
from palpate.sensing.held import ContactBounds, ExternalWrenches, count_contacts
from palpate.sim import Box, ContactLaw, Fidelity, Stage, Tip, white_noise
from palpate.sim.hand.contact import GraspContact
from palpate.sim.hand.hand_file import HANDS, HandFile
from palpate.sim.hand.held_tool import Holding
from palpate.sim.hand.scene import HeldObject
from palpate.sim.hand.touched import Touched

TURNED = rotation_from_rotvec((0.25 * math.pi, 0.0, 0.0))  # about the line of the fingers
START, FORCE, PUSH = (-0.01, 0.0, 0.026), 3.0, 0.9  # [m] of the box, the edge at x = 0; [N] down, and to and fro


def main(table_falls: float = 0.1, seed: int = 1) -> None:
    """Lower a box of 40 x 40 x 30 mm and 0.1 kg on a table that falls away from its edge by an angle [rad]."""
    pad = Tip(pp.Sphere(0.008), mass=0.02)
    hand = HandFile(HANDS / "two-fingers.xml", ("left_sensor", "right_sensor")).read([pad, pad])
    table = Pose(rotation=rotation_from_rotvec((0.0, -table_falls, 0.0))) @ Pose((-0.1, 0.0, -0.01))
    touched = Touched(Box((0.2, 0.2, 0.02)), ContactLaw(friction=0.5), table)
    held, weight = HeldObject(Box((0.04, 0.04, 0.03)), 0.1, Pose(START, TURNED)), SensorPayload(0.1)
    holding = Holding(hand, [pad.finger()] * 2, GraspContact(friction=0.8, impratio=1e7), grip=9.0)
    sensor, exact = white_noise(0.004, 2e-5, seed=seed), Fidelity(0.25e-3)
    box = holding.over(touched, held, carrier=Stage(), fidelity=exact, payload=weight, sensor=sensor)
    surface, felt, places = pp.RoundedBox((0.02, 0.02, 0.015), 5e-4, rotation=np.array(TURNED)), [], []
    touch = pp.Touch(Finger(surface, weight), *holding.fingers)
    now = touch.sense(box.start())
    for t in np.arange(-2.8, 3.0, 1e-3):  # 0.3 s in free air, 2.5 s to lower it, 3 s to push it to and fro
        x, y, z = now.fingers[0].force
        a, b = (PUSH * math.sin(2.0 * math.pi * rate * max(t, 0.0)) for rate in (1.0, 0.7))
        aside = (5e-4 * (x - a), 5e-4 * (y - b)) if z > 0.5 * FORCE else (0.0, 0.0)
        now = touch.sense(box.step(pp.Command((*aside, -min(0.002, 2e-3 * (FORCE - z)) if t > -2.5 else 0.0))))
        felt.append(now.fingers[0].wrench)
        places.append(np.subtract(box.truth().position, now.arm.position_base_tip))
    both = (np.cov(np.array(felt[:300]).T), np.diag([3e-3] * 3 + [5e-5] * 3))  # noise, and what a tare leaves
    window = ExternalWrenches(np.array(felt[2800:]), *(np.tile(each, (3000, 1, 1)) for each in both))
    found = count_contacts(surface, window, ContactBounds(friction=2.0, separation=0.015, wander=1.5e-4))
    print(f"contacts: {found.count}; {found.verdict}")
    felt_at, truly_at = (np.round(1e3 * each, 2) for each in (found.place, np.mean(places[2800:], axis=0)))
    print(f"from the middle of the fingertips, felt at {felt_at} mm, truly at {truly_at} mm")


if __name__ == "__main__":
    tyro.cli(main)
