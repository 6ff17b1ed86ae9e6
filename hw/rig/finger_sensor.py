"""A force/torque sensor of a rig, with what it carries."""

from dataclasses import dataclass, field

from palpate.hw.devices import SensorDevice
from palpate.sensing.compensation import SensorPayload, contact_wrench
from palpate.spatial import Vector, Wrench

NO_LOAD: Wrench = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True)
class FingerSensor:
    """The sensor behind one fingertip.

    Attributes:
        device: Whose readings they are.
        payload: What it carries, as touch takes it off again.
        bias: What touch takes it to show without load [N, N m].
        gives_wrenches: Whether its readings are wrenches; raw channels cannot be tared.
        in_arm: Whether it is a part of the arm, and starts after it.
    """

    device: SensorDevice
    payload: SensorPayload = field(default_factory=SensorPayload)
    bias: Wrench = NO_LOAD
    gives_wrenches: bool = True
    in_arm: bool = False

    def resting_load(self, specific_force: Vector) -> Wrench:
        """Return what it is to show when nothing is touched [N, N m]: bias and weight.

        Args:
            specific_force: At the sensor, its own frame [m/s^2].
        """
        weight = contact_wrench(NO_LOAD, specific_force, self.payload)
        b = self.bias
        return (
            b[0] - weight[0],
            b[1] - weight[1],
            b[2] - weight[2],
            b[3] - weight[3],
            b[4] - weight[4],
            b[5] - weight[5],
        )
