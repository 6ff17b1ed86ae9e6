"""An OnRobot HEX on its Ethernet box: ATI's records with other scales, and commands of its own."""

from palpate.hw.emulators.netft.box import BoxSettings, NetFtServer
from palpate.hw.emulators.netft.calibration_port import CalibrationPort
from palpate.hw.netft.rdt import RDT_PORT, OnRobotCommand, RdtCommand
from palpate.hw.netft.settings import ONROBOT_FILTERS, ONROBOT_PERIODS, ONROBOT_SCALES, Scales

BIAS_ON, BIAS_OFF = 255, 0
"""Values of the bias command."""

FIRST_RATE = 100.0
"""Of records when it is switched on [1/s]."""

RANGES = (200.0, 200.0, 200.0, 10.0, 6.5, 6.5)
"""Of a HEX-E 70 [N, N m]: about those of its data sheet."""


def onrobot_box(address: str = "127.0.0.1", rdt_port: int = RDT_PORT) -> BoxSettings:
    """Return a box as it is when it is switched on."""
    return BoxSettings(address, rate=FIRST_RATE, ranges=RANGES, rdt_port=rdt_port)


class OnRobotServer(NetFtServer):
    """Its calibration is fixed: nobody listens on the TCP port."""

    def _scales_of(self, settings: BoxSettings) -> Scales:
        return ONROBOT_SCALES

    def _open_calibration(self, settings: BoxSettings) -> CalibrationPort | None:
        return None

    def _obey(self, command: int, value: int, sender: tuple[str, int], now: float) -> bool:
        if self._faults.silent:
            return True
        match command:
            case OnRobotCommand.PERIOD:
                least, most = ONROBOT_PERIODS
                if not least <= 1e-3 * value <= most:
                    return False
                self._stream.set_rate(1e3 / value, now)
            case OnRobotCommand.FILTER:
                return 0 <= value < len(ONROBOT_FILTERS)  # the plant's wrench has no noise to filter
            case RdtCommand.BIAS:
                if value not in (BIAS_ON, BIAS_OFF):
                    return False
                self._take_bias(on=value == BIAS_ON)
            case _:
                return super()._obey(command, value, sender, now)
        return True
