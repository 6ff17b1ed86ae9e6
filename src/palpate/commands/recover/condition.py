"""The condition of any device of a rig: as it reports it itself, or as its samples show it."""

import math

from palpate.hw.condition import DeviceCondition, Recoverable
from palpate.hw.devices import ArmDevice, DeviceError, HandDevice, SensorDevice, SensorReading
from palpate.runtime.data import ArmSample
from palpate.runtime.standstill_check import REST_SPEED

AnyDevice = ArmDevice | HandDevice | SensorDevice


def condition_of(device: AnyDevice) -> DeviceCondition:
    """Return the condition of a device; one that cannot be reached is not fit.

    Raises:
        MissingLibraryError: This computer lacks its client library.
    """
    try:
        if isinstance(device, Recoverable):
            return device.condition()
        device.start()
        return _shown_by(device, device.read())
    except DeviceError as error:
        return failed(device, error)


def failed(device: AnyDevice, error: DeviceError) -> DeviceCondition:
    """Return the condition of a device that did not do what it was asked."""
    return DeviceCondition(device.name, error.problem, fit=False, remedy=error.remedy)


def _shown_by(device: AnyDevice, sample: object) -> DeviceCondition:
    """Return what a sample of a device shows of its condition."""
    if isinstance(sample, SensorReading) and not sample.healthy:
        why = getattr(device, "problem", "") or "its status says that the reading is no good"
        return DeviceCondition(device.name, why, fit=False, remedy="take loads off, and see its manual")
    if isinstance(sample, ArmSample):
        speed = math.hypot(*sample.velocity_base_tip)
        if speed >= REST_SPEED:
            remedy = "another program or somebody's hand moves it: end that first"
            return DeviceCondition(device.name, f"it moves at {1e3 * speed:.3g} mm/s", fit=False, remedy=remedy)
        return DeviceCondition(device.name, "it stands still", fit=True)
    return DeviceCondition(device.name, "sends good readings", fit=True)
