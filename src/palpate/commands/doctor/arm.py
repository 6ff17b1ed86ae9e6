"""Condition of an arm, measured while it stands still."""

from collections.abc import Iterator
from time import monotonic, sleep

import numpy as np

from palpate.commands.doctor.watched import GLANCE, Watched, timing_findings
from palpate.hw.devices import ArmDevice
from palpate.hw.finding import DeviceFinding, DeviceUse, SelfExamining, judged
from palpate.robots.robot import Robot
from palpate.runtime.standstill_check import REST_SPEED


def arm_findings(robot: Robot, arm: ArmDevice, seconds: float) -> Iterator[DeviceFinding]:
    """Yield the findings on an arm that has been started.

    Raises:
        DeviceError: It is lost meanwhile.
    """
    name, limits = arm.name, robot.file.limits
    begin, last = monotonic(), arm.read()
    times, ages, values = [last.time], [], [last.velocity_base_tip]
    while monotonic() - begin < seconds:
        last = arm.read()
        ages.append(monotonic() - last.time)
        if last.time > times[-1]:
            times.append(last.time)
            values.append(last.velocity_base_tip)
        sleep(GLANCE)
    watched = Watched(np.array(times), np.array(ages), np.array(values))
    yield from timing_findings(robot, name, watched)
    if isinstance(arm, SelfExamining):
        yield from arm.findings(DeviceUse(robot.file.period, len(times), watched.rate))
    speed = float(np.linalg.norm(watched.values, axis=1).max())
    fix = "is its payload right (backend.arm.payload)? Is it led by hand?"
    yield judged(
        name, "largest speed at rest", 1e3 * speed, "mm/s", f"below {1e3 * REST_SPEED:g}", speed < REST_SPEED, fix
    )
    pairs = zip(last.joint_position, limits.joint_lower, limits.joint_upper, strict=False)
    outside = [i + 1 for i, (q, low, high) in enumerate(pairs) if not low <= q <= high]
    if limits.joint_lower:
        words = "inside" if not outside else f"outside: joint {', '.join(map(str, outside))}"
        fix = "lead it there, or correct limits.joint_lower_rad and joint_upper_rad"
        yield judged(name, "joints within the robot's limits", words, "", "inside", not outside, fix)
    x, y, z = last.position_base_tip
    yield DeviceFinding(name, "tip in its own base frame", f"{x:.4f} {y:.4f} {z:.4f}", "m")
