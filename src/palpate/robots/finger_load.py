"""What a robot file knows of the sensor behind a finger."""

from palpate.robots.robot import Robot
from palpate.sensing.compensation import SensorPayload
from palpate.spatial import Wrench


def payload_of(robot: Robot, i: int) -> SensorPayload:
    """Return what the sensor of finger i carries."""
    finger, sensor = robot.file.fingers[i], robot.sensors[i]
    entry = finger.payload if sensor is None else sensor.payload
    assert entry is not None  # FingerEntry has made sure that one of the two is given
    return entry.payload


def noise_of_finger(robot: Robot, i: int) -> Wrench:
    """Return the standard deviation of a reading of finger i at rest [N, N m]."""
    finger, sensor = robot.file.fingers[i], robot.sensors[i]
    if sensor is not None:
        a, b, c, d, e, f = sensor.noise
        return (a, b, c, d, e, f)
    assert finger.noise is not None  # RobotFile has made sure that one of the two is given
    force, moment = finger.noise.force, finger.noise.moment
    return (force, force, force, moment, moment, moment)


def wander_of_finger(robot: Robot, i: int) -> tuple[float, float]:
    """Return how fast the zero of finger i may wander, each axis [N/s, N m/s]; 0 if the file does not say."""
    drift = robot.file.fingers[i].drift
    return (0.0, 0.0) if drift is None else (drift.force, drift.moment)
