"""Where there is no Linux: devices cannot be driven, but who only simulates can import all of palpate."""

import os
import subprocess
import sys

import pytest

from palpate.errors import InvalidValueError
from palpate.extras import MissingLibraryError
from palpate.hw.emulators.terminal import Terminal
from palpate.hw.ur import UrArm

LIKE_WINDOWS = """
import ctypes, os, pkgutil, sys
import dynamixel_sdk, joblib, serial, tyro  # have ways of their own there
for name in ("fcntl", "grp", "pty", "pwd", "resource", "termios", "tty"):
    sys.modules[name] = None  # cannot be imported
for name in ("getpriority", "memfd_create", "openpty", "sched_setscheduler", "setpriority"):
    delattr(os, name)

class NoWholeProcess(ctypes.PyDLL):
    def __init__(self, name, *given, **more):
        if name is None:
            raise TypeError("there is no library without a name")
        super().__init__(name, *given, **more)

ctypes.PyDLL = NoWholeProcess
import palpate
for module in pkgutil.walk_packages(palpate.__path__, "palpate."):
    if not module.name.endswith("__main__"):
        __import__(module.name)
        print(module.name)
"""


@pytest.mark.slow
def test_everything_can_be_imported_without_what_windows_lacks():
    printed = subprocess.run([sys.executable, "-c", LIKE_WINDOWS], capture_output=True, text=True, timeout=300)
    assert printed.returncode == 0, printed.stderr[-2000:]
    imported = printed.stdout.split()
    assert {"palpate.hw.netft.net_ft", "palpate.hw.emulators.terminal", "palpate.hw.ur.client"} <= set(imported)
    assert "palpate.robots.in_scene" in imported


def test_what_needs_linux_says_so(monkeypatch):
    monkeypatch.delattr(os, "memfd_create")
    with pytest.raises(MissingLibraryError, match=r"ur_rtde, which exists for CPython .* on Linux"):
        UrArm("127.0.0.9").start()
    monkeypatch.setattr(os, "name", "nt")
    with pytest.raises(InvalidValueError, match="no pseudo terminals"):
        Terminal()
