"""Processes that start emulators, and factories that fail."""

import multiprocessing
import time
from multiprocessing.connection import Connection

from palpate.hw.emulators.host import Host
from palpate.hw.emulators.process import EmulatorProcess
from palpate.hw.emulators.ur import SimpleUr


def no_robot_today() -> Host:
    """Fail, as a factory."""
    raise RuntimeError("no robot today")


def stand_behind(pipe: Connection, address: str) -> None:
    """Start an emulator, send its process id, and wait."""
    with EmulatorProcess(SimpleUr(address)):
        pipe.send([child.pid for child in multiprocessing.active_children()])
        time.sleep(60.0)
