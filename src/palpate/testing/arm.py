"""Check of an arm's driver."""

import math
from collections.abc import Callable, Sequence
from time import sleep

from palpate.hw.devices import ArmDevice
from palpate.runtime.data import ArmSample
from palpate.spatial import ZERO, Vector
from palpate.testing.arm_samples import MAX_RATIO_REAL, examine_arm, examine_motion, examine_rest, examine_turn
from palpate.testing.backend import BAD_VELOCITIES, TURN_RATE, UPWARD_VELOCITY
from palpate.testing.devices import examine_clock, examine_device
from palpate.testing.nonconformity import Inspection

STATE_COUNT, READ_INTERVAL = 150, 4e-3
"""States in each part of the check, and the time between two [s]: 0.6 s, 3 mm at `UPWARD_VELOCITY`."""


def check_arm(make: Callable[[], ArmDevice], velocity: Vector = UPWARD_VELOCITY, rate: Vector = TURN_RATE) -> None:
    """Check an arm: time stamps, units and frames, motion, refusals, rest, close, and exceptions.

    The arm moves by some millimetres and turns by some hundredths of a radian: nothing may be in its path; keep
    your hand on the emergency stop.

    Args:
        make: Function that returns the device, not started. It is called once; the device is started twice.
        velocity: Velocity of the tip in a free direction, base frame [m/s].
        rate: Angular velocity about a free axis, base frame [rad/s]; zeros: the arm is not turned.

    Raises:
        ConformanceError: If the arm breaks a rule.
    """
    examine_device(
        make,
        lambda inspection, device: _examine_states(inspection, device, velocity, rate),
        lambda inspection, begun: examine_rest(inspection, [begun], "after close"),
    )


def _examine_states(inspection: Inspection, device: ArmDevice, velocity: Vector, rate: Vector) -> None:
    if not examine_arm(inspection, standing := _moved(device)):
        return
    examine_clock(inspection, device.read)
    examine_rest(inspection, standing, "after start")
    moved = _moved(device, velocity)
    for bad in BAD_VELOCITIES:
        inspection.refuses(f"the velocity {bad}", device.move, bad, ZERO)
    _moved(device)
    if examine_arm(inspection, moved):
        examine_motion(inspection, moved, velocity, MAX_RATIO_REAL)
    examine_rest(inspection, _moved(device), "after a zero command")
    if math.hypot(*rate) > 0.0:
        examine_turn(inspection, _moved(device, ZERO, rate), rate, MAX_RATIO_REAL)
    _moved(device, velocity)  # close has to stop it


def _moved(device: ArmDevice, velocity: Vector = ZERO, rate: Vector = ZERO) -> Sequence[ArmSample]:
    """Command a motion again and again, as a rig does, and return the states meanwhile."""
    samples = []
    for _ in range(STATE_COUNT):
        device.move(velocity, rate)
        samples.append(device.read())
        sleep(READ_INTERVAL)
    return samples
