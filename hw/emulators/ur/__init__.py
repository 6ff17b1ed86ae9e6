"""A Universal Robots controller as far as its clients can see: RTDE, script port and dashboard."""

from palpate.hw.emulators.ur.faults import ControllerFault
from palpate.hw.emulators.ur.server import UrServer
from palpate.hw.emulators.ur.simple import SimpleUr
from palpate.hw.emulators.ur.version import ControllerVersion

__all__ = ["ControllerFault", "ControllerVersion", "SimpleUr", "UrServer"]
