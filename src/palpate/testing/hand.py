"""Check of a hand's driver."""

import math
from collections.abc import Callable, Sequence
from time import monotonic, sleep

from palpate.hw.devices import HandDevice, MovingHand
from palpate.runtime.data import HandSample
from palpate.testing.arm_samples import MAX_SAMPLE_AGE
from palpate.testing.devices import examine_device
from palpate.testing.nonconformity import Inspection

STATE_COUNT, READ_INTERVAL = 60, 5e-3
"""States in each part of the check, and the time between two [s]: 0.3 s."""

MAX_REST_CHANGE = 2e-3
"""Largest change of the joints of a hand without a command [rad or m]: a few steps of an encoder."""


def check_hand(make: Callable[[], HandDevice], fingers: int, force: float = 1.0) -> None:
    """Check a hand: time stamps, rest, grip forces, refusals, close, and exceptions.

    The fingers close on nothing, and open again: keep your own out of the hand.

    Args:
        make: Function that returns the device, not started. It is called once; the device is started twice.
        fingers: Number of grip forces that the hand takes.
        force: Grip force of all fingers for a moment [N].

    Raises:
        ConformanceError: If the hand breaks a rule.
    """
    examine_device(make, lambda inspection, device: _examine_states(inspection, device, fingers, force))


def _examine_states(inspection: Inspection, device: HandDevice, fingers: int, force: float) -> None:
    standing = _states(device)
    if not _examine_samples(inspection, standing):
        return
    _examine_rest(inspection, standing, "after start")
    good = (force,) * fingers
    for what, bad in (
        ("a negative grip force", (-1.0, *good[1:])),
        ("NaN as a grip force", (math.nan, *good[1:])),
        ("infinity as a grip force", (math.inf, *good[1:])),
        (f"{fingers + 1} grip forces for {fingers} fingers", (*good, force)),
    ):
        inspection.refuses(what, device.press, bad)
    if isinstance(device, MovingHand):
        resting: tuple[tuple[float, float, float], ...] = ((0.0, 0.0, 0.0),) * fingers
        inspection.refuses("NaN as a finger's velocity", device.move, ((math.nan, 0.0, 0.0), *resting[1:]))
        inspection.refuses("a velocity too many", device.move, (*resting, resting[0]))
        device.move(None)
    pressing = _states(device, good)
    if _examine_samples(inspection, pressing):
        last, first = pressing[-1].joint_position, standing[-1].joint_position
        moved = max(abs(a - b) for a, b in zip(last, first, strict=True))
        inspection.require(
            moved > 0.0,
            "grip",
            f"no joint has moved in {STATE_COUNT * READ_INTERVAL:.2g} s of pressing with {force:g} N on nothing",
            "fingers that close",
            "close until something is met; a grip force of 0 opens the hand",
        )
    _states(device, (0.0,) * fingers)


def _states(device: HandDevice, forces: tuple[float, ...] | None = None) -> list[HandSample]:
    """Command grip forces again and again, as a rig does, and return the states meanwhile."""
    samples = []
    for _ in range(STATE_COUNT):
        if forces is not None:
            device.press(forces)
        samples.append(device.read())
        sleep(READ_INTERVAL)
    return samples


def _examine_samples(inspection: Inspection, samples: Sequence[HandSample]) -> bool:
    """Examine types, numbers and stamps; return whether they can be judged further."""
    joints = {len(each.joint_position) for each in samples if isinstance(each.joint_position, tuple)}
    numbers = [q for each in samples for q in each.joint_position]
    if not inspection.require(
        len(joints) == 1 and all(isinstance(q, float) and math.isfinite(q) for q in numbers),
        "joint positions",
        f"tuples of {sorted(joints)} entries, {samples[-1].joint_position!r} last",
        "a tuple of finite floats, as many every time",
        "return rad, or m of a slide, in the order that the kinematics take",
    ):
        return False
    age = monotonic() - samples[-1].time
    times = [each.time for each in samples]
    return inspection.require(
        0.0 <= age <= MAX_SAMPLE_AGE + READ_INTERVAL and times == sorted(times),
        "time stamps",
        f"the newest state is {age:.4g} s old by time.monotonic(), in order: {times == sorted(times)}",
        f"between 0 and {MAX_SAMPLE_AGE:g} s, never going back",
        "stamp by time.monotonic() [s] when the joints were read, neither by time.time() nor where it is logged",
    )


def _examine_rest(inspection: Inspection, samples: Sequence[HandSample], when: str) -> None:
    columns = zip(*(each.joint_position for each in samples), strict=True)
    spread = max(max(column) - min(column) for column in columns)
    inspection.require(
        spread <= MAX_REST_CHANGE,
        f"rest {when}",
        f"joints moved by {spread:.3g} (rad or m) without a command",
        f"at most {MAX_REST_CHANGE:g}",
        "hold the fingers where they are until press is called; or return joints in rad, not in encoder steps",
    )
