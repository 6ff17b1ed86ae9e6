"""An emulated UR controller: RTDE, script port and dashboard server, in front of any plant."""

from palpate.hw.emulators.ur.arm import ArmMounting
from palpate.hw.emulators.ur.controller import ControllerVersion
from palpate.hw.emulators.ur.rtde import ControllerFault
from palpate.hw.emulators.ur.server import SimpleUr, UrServer

__all__ = ["ArmMounting", "ControllerFault", "ControllerVersion", "SimpleUr", "UrServer"]
