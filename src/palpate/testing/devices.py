"""Checks of every device on a wire: refusal before its start, time stamps by this computer's monotonic clock."""

import threading
from collections.abc import Callable
from contextlib import suppress
from time import monotonic, sleep
from typing import Any, Protocol, TypeVar

from palpate.hw.devices import ArmDevice, Device, HandDevice, SensorDevice
from palpate.testing.arm_samples import MAX_SAMPLE_AGE
from palpate.testing.nonconformity import Inspection

PAIR_COUNT = 200
"""Number of readings that are taken twice in immediate succession."""

UNREAD_TIME = 0.3
"""Time without a reading [s], after which queued records are old."""

READ_COUNT, READ_INTERVAL = 20, 2e-3
"""Number of readings of which the youngest counts, and the time between two [s]: a busy computer delays some."""


class Stamped(Protocol):
    """A reading with the time of its sampling."""

    @property
    def time(self) -> float:
        """Time of sampling by `time.monotonic` [s]."""
        ...


Reading = TypeVar("Reading", bound=Stamped)


AnyReadable = TypeVar("AnyReadable", ArmDevice, HandDevice, SensorDevice)


def examine_device(
    make: Callable[[], AnyReadable],
    examine: Callable[[Inspection, AnyReadable], None],
    examine_again: Callable[[Inspection, Any], None] = lambda inspection, reading: None,
) -> None:
    """Examine a device from before its start until after its close.

    Args:
        make: Function that returns the device, not started. It is called once; the device is started twice.
        examine: Function that examines the device while it runs.
        examine_again: Function that examines its first reading after its second start.

    Raises:
        ConformanceError: If the device breaks a rule.
    """
    threads = set(threading.enumerate())
    device = make()
    with Inspection(type(device).__name__) as inspection:
        try:
            examine_not_started(inspection, device, device.read, "before start")
            with inspection.part("start"):
                device.start()
                examine(inspection, device)
        finally:
            with inspection.part("close"):
                device.close()
        examine_not_started(inspection, device, device.read, "after close")
        examine_threads(inspection, threads)
        begun = start_again(inspection, device, device.read)
        if begun is not None:
            examine_again(inspection, begun)


def examine_not_started(inspection: Inspection, device: Device, read: Callable[[], object], when: str) -> None:
    """Reading a closed device must raise an `OSError` such as `DeviceError`; closing it again must be harmless."""
    try:
        read()
    except OSError:
        pass
    except Exception as error:
        inspection.require(
            False, f"read {when}", f"it raised {type(error).__name__}", "DeviceError", "say that it is not started"
        )
    else:
        inspection.require(
            False,
            f"read {when}",
            "it returned a reading",
            "DeviceError",
            "forget the newest reading in close, and refuse until start has brought a new one",
        )
    with inspection.part(f"close {when}"):
        device.close()
    inspection.require(
        isinstance(device.name, str) and device.name,
        "name",
        repr(device.name),
        "a name for messages",
        "return one",
    )


def examine_clock(inspection: Inspection, read: Callable[[], Reading]) -> None:
    """Stamps must be `time.monotonic` at the moment of sampling, and no reading may wait in a queue."""
    youngest = _youngest(read)
    if not inspection.require(
        0.0 <= youngest <= MAX_SAMPLE_AGE,
        "time stamps",
        f"the youngest of {READ_COUNT} readings is {youngest:.4g} s old by time.monotonic()",
        f"between 0 and {MAX_SAMPLE_AGE:g} s",
        "stamp by time.monotonic() [s], neither time.time() nor the device's own clock, when it was sampled; "
        "return the newest record, not the next one of a queue",
    ):
        return
    again = [(read(), read()) for _ in range(PAIR_COUNT)]
    new = sum(b.time > a.time for a, b in again)
    inspection.require(
        new <= 0.5 * PAIR_COUNT,
        "time stamps",
        f"of {PAIR_COUNT} readings that were taken twice at once, {new} had two stamps",
        "one stamp per record, whenever it is read",
        "stamp a record where it arrives from the wire, not where it is read or logged",
    )
    sleep(UNREAD_TIME)
    youngest = _youngest(read)
    inspection.require(
        youngest <= MAX_SAMPLE_AGE,
        "age",
        f"after {UNREAD_TIME:g} s without a call the reading is {youngest:.3g} s old",
        f"at most {MAX_SAMPLE_AGE:g} s",
        "return the newest record, not the next one of a queue",
    )


def _youngest(read: Callable[[], Reading]) -> float:
    """Return the least age of some readings [s]; it is negative for a stamp in the future."""
    ages = []
    for _ in range(READ_COUNT):
        time = read().time
        ages.append(monotonic() - time)
        sleep(READ_INTERVAL)
    return min(ages)


def examine_threads(inspection: Inspection, before: set[threading.Thread]) -> None:
    """A closed device must leave no thread behind."""
    left = [thread for thread in threading.enumerate() if thread not in before]
    for thread in left:
        thread.join(MAX_SAMPLE_AGE)
    names = [thread.name for thread in left if thread.is_alive()]
    inspection.require(
        not names, "threads", f"{', '.join(names)} still run after close", "none", "end and join them in close"
    )


def start_again(inspection: Inspection, device: Device, read: Callable[[], Reading]) -> Reading | None:
    """Start a closed device again, and return a reading."""
    reading = None
    with inspection.part("start after close"):
        device.start()
        reading = read()
    with suppress(OSError):
        device.close()
    return reading
