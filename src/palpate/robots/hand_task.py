"""What a hand is to hold in simulation, as robots know it: no experiment is named, and it can be pickled."""

from dataclasses import dataclass, field

from palpate.sim import Carrier, Fidelity, Lift, SeededSensor
from palpate.sim.friction.law import FrictionLaw
from palpate.sim.hand.contact import GraspContact
from palpate.sim.hand.hand_model import HandModel
from palpate.sim.hand.load import ObjectLoad
from palpate.sim.hand.scene import GraspScene, HeldObject, build_grasp_scene
from palpate.sim.objects.table import Table

PERIOD = 1e-3
"""[s] Control period of the simulated hand, and of the emulated one: what its bus is made for."""


@dataclass(frozen=True, slots=True, eq=False)
class HandTask:
    """What a hand is to hold, and how it is sensed. On a rig, only hand and period count.

    Attributes:
        hand: Where fingers and sensors are.
        held: What is held.
        contact: How it touches the fingertips.
        table: What it stands on; None: nothing.
        carrier: What carries the hand.
        rubbing: How the friction plant rubs; None: MuJoCo rubs.
        sensor: Behind each fingertip.
        load: What pulls at the object besides its weight; None: nothing.
        period: Of control [s].
    """

    hand: HandModel
    held: HeldObject
    contact: GraspContact
    table: Table | None = None
    carrier: Carrier = field(default_factory=Lift)
    rubbing: FrictionLaw | None = None
    sensor: SeededSensor = field(default_factory=SeededSensor)
    load: ObjectLoad | None = None
    period: float = PERIOD

    def scene(self, fidelity: Fidelity | None = None) -> GraspScene:
        """Return hand, object and table, compiled, to be computed so; as grasps are if not given.

        Raises:
            InvalidValueError: They cannot be simulated so.
        """
        return build_grasp_scene(
            self.hand,
            self.held,
            self.contact,
            carrier=self.carrier,
            table=self.table,
            fidelity=fidelity,
            friction=self.rubbing,
        )
