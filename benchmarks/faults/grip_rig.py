"""An object that is held and lifted when something goes wrong."""

from faults.fault_rig import FaultyBackend, Rig
from faults.grip_plant import TIP_RADIUS, GripPlant
from palpate.runtime.data import Command, Phase
from palpate.runtime.supervision import Limits
from palpate.runtime.touch import Finger, Touch
from palpate.surfaces import Sphere

GRIP = 3.0
"""[N]: a fifth more than the object needs."""
LIFTING = Command((0.0, 0.0, 0.01), Phase.HOLD, (GRIP, GRIP))


class Lift:
    """Holds and lifts."""

    def start(self, first):
        pass

    def step(self, now):
        return LIFTING


def holding_rig() -> Rig:
    touch = Touch(*[Finger(Sphere(TIP_RADIUS))] * 2)
    return Rig(FaultyBackend(GripPlant(GRIP)), touch, Lift(), Limits(), duration=0.4)
