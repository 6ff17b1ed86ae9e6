"""Force/torque sensors on Ethernet that speak ATI's raw data transfer (RDT): ATI Net F/T boxes, OnRobot HEX."""

from palpate.hw.netft.calibration import BoxCalibration, ask_calibration
from palpate.hw.netft.net_ft import NetFt
from palpate.hw.netft.settings import NetFtSettings, Scales, StreamRequest, onrobot_settings
from palpate.hw.netft.status import AXIA, NET_BOX, StatusWords

__all__ = [
    "AXIA",
    "NET_BOX",
    "BoxCalibration",
    "NetFt",
    "NetFtSettings",
    "Scales",
    "StatusWords",
    "StreamRequest",
    "ask_calibration",
    "onrobot_settings",
]
