"""The sensor in a robot file."""

import msgspec

from palpate.hw.ft_stream.streamed_sensor import StreamSettings
from palpate.hw.serial_ft.serial_sensor import SerialSensor
from palpate.robots.device_settings import DeviceSettings
from palpate.robots.sensor_kind import SensorKind, SensorPlace
from palpate_bench.box import BenchLines
from palpate_bench.box_emulator import BenchBoxServer


class BenchBoxEntry(SensorKind, DeviceSettings, frozen=True, kw_only=True):
    """The sensor of the bench.

    Attributes:
        path: Of its terminal.
        silent_after: Without a line it counts as lost after this [s].
    """

    RANGES = (("silent_after_s", 1e-3, 5.0, "s"),)

    path: str
    silent_after: float = msgspec.field(name="silent_after_s", default=0.04)

    def device(self, finger: SensorPlace) -> SerialSensor:
        """See `SensorKind`."""
        return SerialSensor(self.path, BenchLines(), StreamSettings(finger.noise, silent_after=self.silent_after))

    def emulator(self, number: int = 0) -> BenchBoxServer:
        """See `DeviceKind`."""
        return BenchBoxServer(self.path, number)
