"""The condition that time goes on, and that what devices report is recent."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from sys import float_info

from palpate.runtime.data import Observation
from palpate.runtime.supervision import observed_row as row
from palpate.runtime.supervision.bounds import Bound
from palpate.runtime.supervision.conditions import broken_by_bounds
from palpate.runtime.supervision.finding import Cause, Violation
from palpate.runtime.supervision.observed_row import RowLayout

CLOCK_SLACK = 1e-9
"""[s]: rounding of time stamps."""

LONGEST_GAP = 0.1
"""[s] from period to period: by then the robot's own watchdog (20 to 100 ms) has stopped it, or it has gone on
with an old command for as long. Where older samples are believed, commands may be as old, too."""

LATER = float_info.min
"""Least difference of a time from the last [s]: any but none."""


@dataclass(frozen=True, slots=True)
class FreshSamples:
    """Time goes on, and no device's sample is older than `longest_age` [s], by the device's own time stamp.

    A device that is read faster than it samples repeats itself: that is in order until its sample grows too old.
    From period to period no more time passes than `LONGEST_GAP`, or `longest_age` where that is more; and no
    joints, fingers or hand come or go.
    """

    longest_age: float

    def bounds(self, layout: RowLayout) -> tuple[Bound[Observation], ...]:
        """See `Bounded`."""
        return tuple(self._each(layout))

    def broken(self, now: Observation, before: Observation | None) -> Violation | None:
        """See `Condition`."""
        return broken_by_bounds(self, now, before)

    def _each(self, layout: RowLayout) -> Iterator[Bound[Observation]]:
        sensors = [(i, layout.finger(i, row.FINGER_TIME)) for i in range(layout.fingers)]
        devices = [(_ARM, row.ARM_TIME), *sensors]
        if layout.hand_joints >= 0:
            devices.append((_HAND, row.HAND_TIME))
        yield Bound(row.TIME, _no_time, -float_info.max, float_info.max)
        yield Bound(row.TIME, _no_later, LATER, minus=layout.before(row.TIME))
        for device, place in devices:
            told = partial(self._aged, device)
            yield Bound(row.TIME, told, -CLOCK_SLACK, self.longest_age + CLOCK_SLACK, minus=place)
        gap = max(LONGEST_GAP, self.longest_age)
        yield Bound(row.TIME, partial(_passed, gap), high=gap + CLOCK_SLACK, minus=layout.before(row.TIME))
        for count, changed in ((row.JOINTS, _joints), (row.FINGERS, _fingers), (row.HAND_JOINTS, _hand)):
            yield Bound(count, changed, 0.0, 0.0, minus=layout.before(count))
        for device, place in devices:
            yield Bound(place, partial(_backwards, device), 0.0, minus=layout.before(place))

    def _aged(self, device: int, now: Observation, before: Observation | None) -> Violation:
        age, limit = now.time - _time(device, now), f"0 to {1e3 * self.longest_age:g} ms"
        return Violation(f"age of the sample of {_name(device)}", f"{1e3 * age:.4g} ms", limit, Cause.WIRE)


_ARM, _HAND = -1, -2
"""Devices beside the sensors, which are counted from 0."""


def _name(device: int) -> str:
    return {_ARM: "the arm", _HAND: "the hand"}.get(device, f"force/torque sensor {device + 1}")


def _time(device: int, now: Observation | None) -> float:
    if device == _ARM or now is None:
        return float("nan") if now is None else now.arm.time
    if device == _HAND:
        return float("nan") if now.hand is None else now.hand.time
    return now.fingers[device].time


def _no_time(now: Observation, before: Observation | None) -> Violation:
    return Violation("time of the sample", f"{now.time}", "a finite number", Cause.DEVICE)


def _no_later(now: Observation, before: Observation | None) -> Violation:
    last = float("nan") if before is None else before.time
    limit = f"later than the last, {last:.6f} s"
    return Violation("time of the sample", f"{now.time:.6f} s", limit, Cause.DEVICE)


def _passed(gap: float, now: Observation, before: Observation | None) -> Violation:
    passed = now.time - (now if before is None else before).time
    return Violation("time since the last sample", f"{passed:.4g} s", f"{gap:g} s", Cause.COMPUTER)


def _joints(now: Observation, before: Observation | None) -> Violation:
    counted, last = len(now.arm.joint_position), len((before or now).arm.joint_position)
    return Violation("number of the arm's joints", f"{counted}", f"as before, {last}", Cause.DEVICE)


def _fingers(now: Observation, before: Observation | None) -> Violation:
    counted, last = len(now.fingers), len((before or now).fingers)
    return Violation("number of fingers", f"{counted}", f"as before, {last}", Cause.DEVICE)


def _hand(now: Observation, before: Observation | None) -> Violation:
    last = None if before is None else before.hand
    if now.hand is None or last is None:
        came = "missing" if now.hand is None else "new"
        return Violation("sample of the hand", came, "as in every period", Cause.DEVICE)
    counted, before_it = len(now.hand.joint_position), len(last.joint_position)
    return Violation("number of the hand's joints", f"{counted}", f"as before, {before_it}", Cause.DEVICE)


def _backwards(device: int, now: Observation, before: Observation | None) -> Violation:
    limit = f"not before its last, {_time(device, before):.6f} s"
    return Violation(f"time stamp of {_name(device)}", f"{_time(device, now):.6f} s", limit, Cause.DEVICE)
