"""The force/torque sensors of a robot file: real devices behind fingers, and what they carry."""

from palpate.errors import InvalidValueError
from palpate.hw.devices import ArmDevice
from palpate.hw.rig import FingerSensor
from palpate.hw.rig.finger_sensor import NO_LOAD
from palpate.robots.finger_load import noise_of_finger, payload_of
from palpate.robots.robot import Robot
from palpate.robots.sensor_kind import SensorPlace


def finger_sensor(robot: Robot, i: int, arm: ArmDevice | None) -> FingerSensor:
    """Return the sensor behind finger i, and what it carries; nothing is opened.

    Raises:
        InvalidValueError: There is none, or it cannot be as the file specifies.
    """
    file, payload, entry = robot.sensors[i], payload_of(robot, i), robot.file.fingers[i].sensor_device
    if entry is None:
        raise InvalidValueError(f"fingers[{i}].sensor_device: there is none")
    bias, calibrated = NO_LOAD, file is not None and file.calibration is not None
    if file is not None:
        a, b, c, d, e, f = file.bias
        bias = (a, b, c, d, e, f)
    try:
        device = entry.device(SensorPlace(noise_of_finger(robot, i), payload, calibrated, arm))
    except InvalidValueError as error:
        raise InvalidValueError(f"fingers[{i}].sensor_device.{error}") from None
    return FingerSensor(device, payload, bias, gives_wrenches=not calibrated, in_arm=entry.in_arm)
