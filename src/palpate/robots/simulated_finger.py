"""What contact sensing knows of a finger whose sensor is simulated."""

from dataclasses import dataclass

from palpate.robots.known_sensor import known_sensor
from palpate.robots.robot import Robot
from palpate.robots.task import Task
from palpate.runtime import Finger, FingerDescription, SensorFinger
from palpate.sensing.compensation import SensorPayload
from palpate.sensing.solver import Surface
from palpate.sim import Tip


@dataclass(frozen=True, slots=True, eq=False)
class SensedFinger:
    """A finger for touch.

    Attributes:
        finger: As `Touch` takes it.
        touch_force: Force that counts as a touch [N].
    """

    finger: FingerDescription
    touch_force: float


def sensed_finger(robot: Robot, i: int, tip: Tip, surface: Surface, task: Task) -> SensedFinger:
    """Return finger i of a robot for touch.

    Args:
        robot: Whose finger it is.
        i: Its number.
        tip: On its sensor.
        surface: That contacts are sensed on.
        task: With the simulated sensor.

    Raises:
        InvalidValueError: What is known of the sensor contradicts what is simulated.
    """
    sensor = known_sensor(robot.file.fingers[i], robot.sensors[i], task.sensor, task.period)
    if sensor is not None:
        return SensedFinger(SensorFinger(surface, sensor), sensor.contact.touch_force)
    least = task.touch_force
    payload, noise = SensorPayload(tip.mass, tip.center_of_mass), task.sensor.model.dithering
    return SensedFinger(Finger(surface, payload, least, least / 2.0, noise), least)
