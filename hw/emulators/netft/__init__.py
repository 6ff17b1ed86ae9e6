"""Emulated force/torque sensors on Ethernet: ATI Net F/T box, OnRobot HEX."""

from palpate.hw.emulators.netft.box import BoxSettings, NetFtServer
from palpate.hw.emulators.netft.faults import NetFtFault
from palpate.hw.emulators.netft.onrobot import OnRobotServer, onrobot_box

__all__ = ["BoxSettings", "NetFtFault", "NetFtServer", "OnRobotServer", "onrobot_box"]
