"""What a hand is to hold in simulation, as robots know it: no experiment is named, and it can be pickled."""

from dataclasses import dataclass, field

from palpate.sim import Carrier, Lift, SeededSensor, SphereObject
from palpate.sim.friction.law import FrictionLaw
from palpate.sim.hand.contact import GraspContact
from palpate.sim.hand.hand import Hand
from palpate.sim.hand.load import Load
from palpate.sim.hand.scene import GraspScene, HeldObject, build_grasp_scene
from palpate.sim.objects.table import Table
from palpate.sim.sensor.model import SensorModel
from palpate.sim.sensor.stages import WhiteNoise, alike

PERIOD = 1e-3
"""[s] Control period of the simulated hand, and of the emulated one: what its bus is made for."""

FORCE_NOISE, MOMENT_NOISE = 0.01, 1e-4
"""[N], [N m] Standard deviations of a fingertip's sensor where nothing else is said: of a Nano17."""


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

    hand: Hand
    held: HeldObject
    contact: GraspContact
    table: Table | None = None
    carrier: Carrier = field(default_factory=Lift)
    rubbing: FrictionLaw | None = None
    sensor: SeededSensor = field(default_factory=SeededSensor)
    load: Load | None = None
    period: float = PERIOD

    def scene(self) -> GraspScene:
        """Return hand, object and table, compiled.

        Raises:
            InvalidValueError: They cannot be simulated so.
        """
        return build_grasp_scene(
            self.hand, self.held, self.contact, carrier=self.carrier, table=self.table, friction=self.rubbing
        )


def idle_task(hand: Hand) -> HandTask:
    """Return a task for a hand that only stands there, open around a ball: to examine its devices."""
    ball = SphereObject(0.5 * hand.opening)
    noise = WhiteNoise(alike(FORCE_NOISE, MOMENT_NOISE))
    sensor = SeededSensor(SensorModel(noise=noise))
    return HandTask(hand, HeldObject(ball), GraspContact(), Table(-ball.radius), sensor=sensor)
