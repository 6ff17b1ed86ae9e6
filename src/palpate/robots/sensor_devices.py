"""The force/torque sensors that come with palpate, in robot files: `fingers[].sensor_device`."""

from dataclasses import replace
from pathlib import Path

import msgspec

from palpate.errors import InvalidValueError
from palpate.hw.emulators.netft import BoxSettings, NetFtServer, OnRobotServer, onrobot_box
from palpate.hw.emulators.serial_ft import BotaServer, ResenseServer
from palpate.hw.ft_stream import StreamSettings
from palpate.hw.netft import NetFt, NetFtSettings, Scales, onrobot_settings
from palpate.hw.serial_ft.bota import Bota
from palpate.hw.serial_ft.resense import Resense
from palpate.hw.serial_ft.serial_sensor import SerialSensor
from palpate.hw.ur import UrArm, UrToolSensor
from palpate.robots.device_settings import DeviceSettings
from palpate.robots.sensor_kind import SensorKind, SensorPlace
from palpate.spatial import Vector

SILENCE = ("silent_after_s", 1e-3, 5.0, "s")
"""Range of the time without a record after which a sensor counts as lost."""

PORTS = (1, 65535, "")

RAW = Scales(1.0, 1.0)
"""For a sensor file that calibrates: counts as they are."""


class NetFtEntry(SensorKind, DeviceSettings, frozen=True, kw_only=True):
    """An ATI Net F/T box or Axia: see `palpate.hw.netft.NetFt`. It tells its scales itself.

    Attributes:
        address: Of the box: host name or IP address.
        silent_after: Without a record it counts as lost after this [s].
        port: UDP, fixed in every box.
        calibration_port: TCP, likewise.
    """

    RANGES = (
        SILENCE,
        ("port", *PORTS),
        ("calibration_port", *PORTS),
    )

    address: str
    silent_after: float = msgspec.field(name="silent_after_s", default=0.04)
    port: int = 49152
    calibration_port: int = 49151

    def device(self, finger: SensorPlace) -> NetFt:
        """See `SensorKind`."""
        settings = NetFtSettings(
            StreamSettings(finger.noise, silent_after=self.silent_after),
            scales=RAW if finger.calibrated else None,
            rdt_port=self.port,
            calibration_port=self.calibration_port,
        )
        return NetFt(self.address, settings)

    def emulator(self, number: int = 0) -> NetFtServer:
        """See `DeviceKind`."""
        settings = BoxSettings(self.address, rdt_port=self.port, calibration_port=self.calibration_port)
        return NetFtServer(settings, number)


class OnRobotEntry(SensorKind, DeviceSettings, frozen=True, kw_only=True):
    """An OnRobot HEX on its Ethernet box: see `palpate.hw.netft.onrobot_settings`.

    Attributes:
        address: Of the box.
        record_period: Between records [s].
        cutoff: Of the box's filter [Hz]: 500, 150, 50, 15, 5 or 1.5; None: no filter.
        port: UDP.
    """

    RANGES = (
        ("record_period_s", 0.001, 0.254, "s"),
        ("port", *PORTS),
    )

    address: str
    record_period: float = msgspec.field(name="record_period_s", default=0.002)
    cutoff: float | None = msgspec.field(name="cutoff_Hz", default=None)
    port: int = 49152

    def device(self, finger: SensorPlace) -> NetFt:
        """See `SensorKind`."""
        settings = onrobot_settings(
            finger.noise, period=self.record_period, cutoff=self.cutoff, rdt_port=self.port
        )
        return NetFt(self.address, settings)

    def emulator(self, number: int = 0) -> OnRobotServer:
        """See `DeviceKind`."""
        return OnRobotServer(replace(onrobot_box(self.address), rdt_port=self.port), number)


class BotaEntry(SensorKind, DeviceSettings, frozen=True, kw_only=True):
    """A Bota sensor on a serial line: see `palpate.hw.serial_ft.Bota`.

    Attributes:
        path: Of its terminal.
        sinc_length: Of its filter: 51 for 1000 readings a second, 512 for 100.
        silent_after: Without a record it counts as lost after this [s].
    """

    RANGES = (
        SILENCE,
        ("sinc_length", 51, 512, ""),
    )

    path: str
    sinc_length: int = 51
    silent_after: float = msgspec.field(name="silent_after_s", default=0.04)

    def device(self, finger: SensorPlace) -> SerialSensor:
        """See `SensorKind`."""
        stream = StreamSettings(finger.noise, silent_after=self.silent_after)
        return SerialSensor(self.path, Bota(self.sinc_length), stream)

    def emulator(self, number: int = 0) -> BotaServer:
        """See `DeviceKind`."""
        return BotaServer(number, link=Path(self.path))


class ResenseEntry(SensorKind, DeviceSettings, frozen=True, kw_only=True):
    """A Resense HEX on a serial line: see `palpate.hw.serial_ft.Resense`.

    Attributes:
        path: Of its terminal.
        force_range: Full load per axis [N].
        moment_range: Likewise [N m].
        record_period: Between records [s].
        silent_after: Without a record it counts as lost after this [s].
    """

    RANGES = (
        SILENCE,
        ("record_period_s", 0.001, 0.254, "s"),
    )

    path: str
    force_range: Vector = msgspec.field(name="force_range_N")
    moment_range: Vector = msgspec.field(name="moment_range_Nm")
    record_period: float = msgspec.field(name="record_period_s", default=0.001)
    silent_after: float = msgspec.field(name="silent_after_s", default=0.04)

    def device(self, finger: SensorPlace) -> SerialSensor:
        """See `SensorKind`."""
        stream = StreamSettings(finger.noise, silent_after=self.silent_after)
        make = Resense(self.force_range, self.moment_range, period=self.record_period)
        return SerialSensor(self.path, make, stream)

    def emulator(self, number: int = 0) -> ResenseServer:
        """See `DeviceKind`."""
        (fx, fy, fz), (mx, my, mz) = self.force_range, self.moment_range
        rate = 1.0 / self.record_period
        return ResenseServer(number, rate=rate, ranges=(fx, fy, fz, mx, my, mz), link=Path(self.path))


class UrToolEntry(SensorKind, DeviceSettings, frozen=True, kw_only=True):
    """The sensor in the flange of the rig's UR arm: the controller takes the payload's weight off."""

    @property
    def in_arm(self) -> bool:
        """It is."""
        return True

    def device(self, finger: SensorPlace) -> UrToolSensor:
        """See `SensorKind`."""
        if not isinstance(finger.arm, UrArm):
            raise InvalidValueError("kind = ur_tool: there is no UR arm; give backend.arm")
        if finger.payload.mass > 0.0:
            raise InvalidValueError(
                f"kind = ur_tool: a payload of {finger.payload.mass:g} kg on the arm's own sensor: its controller "
                "takes the weight off (backend.arm.payload); write mass_kg: 0 here"
            )
        return UrToolSensor(finger.arm)
