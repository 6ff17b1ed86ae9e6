"""The force/torque sensors of a robot file: real devices behind fingers, and what they carry."""

from palpate.errors import InvalidValueError
from palpate.hw.devices import SensorDevice
from palpate.hw.ft_stream import StreamSettings
from palpate.hw.netft import NetFt, NetFtSettings, Scales, onrobot_settings
from palpate.hw.rig import FingerSensor
from palpate.hw.rig.finger_sensor import NO_LOAD
from palpate.hw.serial_ft.bota import Bota
from palpate.hw.serial_ft.resense import Resense
from palpate.hw.serial_ft.serial_sensor import SerialSensor
from palpate.hw.ur import UrArm, UrToolSensor
from palpate.robots.rig_entries import BotaEntry, NetFtEntry, OnRobotEntry, ResenseEntry, UrToolEntry
from palpate.robots.rig_settings import noise_of_finger, payload_of
from palpate.robots.robot import Robot
from palpate.sensing.ft.sensor_file import SensorFile

RAW = Scales(1.0, 1.0)
"""For a sensor file that calibrates: counts as they are."""


def finger_sensor(robot: Robot, i: int, arm: UrArm | None) -> FingerSensor:
    """Return the sensor behind finger i, and what it carries; nothing is opened.

    Raises:
        InvalidValueError: The arm's own sensor without an arm, or with a payload.
    """
    file, payload, entry = robot.sensors[i], payload_of(robot, i), robot.file.fingers[i].sensor_device
    bias = NO_LOAD
    if file is not None:
        a, b, c, d, e, f = file.bias
        bias = (a, b, c, d, e, f)
    if isinstance(entry, UrToolEntry):
        if arm is None:
            raise InvalidValueError(f"fingers[{i}].sensor_device.kind = ur_tool: there is no backend.arm")
        if payload.mass > 0.0:
            raise InvalidValueError(
                f"fingers[{i}]: a payload of {payload.mass:g} kg on the arm's own sensor: its controller takes "
                "the weight off (backend.arm.payload); write mass_kg: 0 here"
            )
        return FingerSensor(UrToolSensor(arm), payload, bias, in_arm=True)
    raw = file is not None and file.calibration is not None
    return FingerSensor(_device(robot, i, file), payload, bias, gives_wrenches=not raw)


def _device(robot: Robot, i: int, file: SensorFile | None) -> SensorDevice:
    entry, noise = robot.file.fingers[i].sensor_device, noise_of_finger(robot, i)
    match entry:
        case NetFtEntry():
            return NetFt(
                entry.address,
                NetFtSettings(
                    StreamSettings(noise, silent_after=entry.silent_after),
                    scales=RAW if file is not None and file.calibration is not None else None,
                    rdt_port=entry.port,
                    calibration_port=entry.calibration_port,
                ),
            )
        case OnRobotEntry():
            settings = onrobot_settings(
                noise, period=entry.record_period, cutoff=entry.cutoff, rdt_port=entry.port
            )
            return NetFt(entry.address, settings)
        case BotaEntry():
            stream = StreamSettings(noise, silent_after=entry.silent_after)
            return SerialSensor(entry.path, Bota(entry.sinc_length), stream)
        case ResenseEntry():
            stream = StreamSettings(noise, silent_after=entry.silent_after)
            make = Resense(entry.force_range, entry.moment_range, period=entry.record_period)
            return SerialSensor(entry.path, make, stream)
        case _:
            raise InvalidValueError(f"fingers[{i}].sensor_device: there is none")
