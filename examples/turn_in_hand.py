"""An object turned in the hand.

Three fingers lift a sphere; then each rolls over it, sideways, and so all of them turn it about the hand's axis.
There is no camera: touch alone measures how far it has turned, from the motion of the contacts, and the grip is at
any time the least that neither slips nor spins. The pieces serve any hand with known sensor poses.

    python examples/turn_in_hand.py --angle 15 --seed 1

It prints the turn as touch measures it, and the true one.
"""

import math

import tyro

import palpate as pp
from palpate.controllers.grip.belief import KnownSurface
from palpate.controllers.grip.controller_sequence import ControllerSequence
from palpate.controllers.grip.lift import LiftController, LiftParameters
from palpate.controllers.grip.shared_grip import SHARED, SharedGrip
from palpate.controllers.grip.slip_safe import SlipSafeGrip
from palpate.controllers.grip.turn import TurnInHand, TurnParameters
from palpate.sim import Lift, Table, white_noise
from palpate.sim.friction.law import FrictionLaw
from palpate.sim.hand.backend import HandBackend
from palpate.sim.hand.contact import GraspContact
from palpate.sim.hand.scene import HeldObject, build_grasp_scene
from palpate.sim.hand.turning_hand import turning_hand

MU, E = 0.5, 0.004  # friction, and the largest spin torque over the largest friction force [m]
RADIUS, PERIOD = 0.03, 1e-3  # [m], [s]


def main(angle: float = 15.0, seed: int = 1) -> None:
    """Lift a sphere, then turn it by an angle [degrees]; 21.5 is as far as the fingers go."""
    hand, held = turning_hand(), HeldObject(pp.SphereObject(RADIUS), mass=0.1)
    palm = (0.0, 0.0, hand.depth + hand.tip_along)  # fingertips as high as the middle of the sphere
    law = FrictionLaw(MU, MU, spin_length=E, stiffness=5e3)
    contact, table = GraspContact(friction=MU, spin_length=E), Table(-RADIUS)
    scene = build_grasp_scene(hand, held, contact, carrier=Lift(), table=table, palm=palm, friction=law)
    belief = KnownSurface(pp.LimitSurface(MU, E))
    grip = SlipSafeGrip(3, belief, PERIOD, SHARED, plan=SharedGrip(3, belief, PERIOD, hand))
    lift = LiftController(grip, PERIOD, LiftParameters(height=0.01, hold_time=0.3))
    turn = TurnInHand(grip, hand, PERIOD, TurnParameters(angles=(math.radians(angle),)))
    tip = hand.tip.finger()
    backend = HandBackend(scene, PERIOD, sensor=white_noise(0.01, 1e-4, seed=seed))
    guard = pp.Supervisor(pp.Limits(grip_force=24.0))
    result = pp.run(backend, pp.Touch(tip, tip, tip), ControllerSequence(lift, turn), guard, duration=20.0)
    w, _, _, z = backend.truth().quat_wxyz
    print(f"{result.ending.value}: as touch tells it, turned by {math.degrees(turn.turn):.2f} degrees")
    print(f"in truth by {math.degrees(2.0 * math.atan2(z, w)):.2f} degrees")


if __name__ == "__main__":
    tyro.cli(main)
