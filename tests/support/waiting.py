"""Waiting for what a busy machine does late: it stands still for a tenth of a second now and then."""

import time
from collections.abc import Callable
from contextlib import suppress
from typing import TypeVar

import psutil

from palpate.hw.devices import DeviceError

WITHIN = 30.0
"""[s] until something must have happened, on a machine however loaded: only broken tests wait for so long."""

T = TypeVar("T")


def until(met: Callable[[], T | None], within: float = WITHIN, what: str = "a condition of this test") -> T:
    """Poll `met` until its result is true, and return that result; fail after `within` [s], naming `what`."""
    end = time.monotonic() + within
    while not (found := met()):
        assert time.monotonic() < end, f"{what} has not come true within {within:g} s: {found!r}"
        time.sleep(1e-3)
    return found


def first_error(act: Callable[[], object]) -> DeviceError:
    """Do something again and again until a device refuses it, and return what it says."""

    def refusal() -> DeviceError | None:
        try:
            act()
        except DeviceError as error:
            return error
        return None

    error = until(refusal)
    assert error is not None
    return error


def process_ended(pid: int) -> bool:
    """Return whether a process has ended, waited for or not."""
    with suppress(psutil.NoSuchProcess):
        return bool(psutil.Process(pid).status() == psutil.STATUS_ZOMBIE)
    return True
