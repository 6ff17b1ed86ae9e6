"""Condition of a UR arm, measured while it stands still."""

from collections.abc import Iterator
from time import monotonic, sleep

import numpy as np

from palpate.commands.doctor.finding import DoctorFinding, DoctorVerdict, judged
from palpate.commands.doctor.watched import GLANCE, SLOW_SHARE, Watched, timing_findings
from palpate.hw.ur import UrArm
from palpate.hw.ur.exchange import UrState
from palpate.hw.ur.problems import PLAYING, RUNNING, safety_problem
from palpate.hw.ur.version import OLDEST, cycle_rate
from palpate.robots.robot import Robot
from palpate.runtime.standstill_check import REST_SPEED


def arm_findings(robot: Robot, arm: UrArm, seconds: float) -> Iterator[DoctorFinding]:
    """Yield the findings on an arm that has been started.

    Raises:
        DeviceError: It is lost meanwhile.
    """
    name, limits = arm.name, robot.file.limits
    shown = ".".join(map(str, arm.version))
    oldest = OLDEST.get(arm.version[0])
    wanted = "" if oldest is None else f"{oldest[0]}.{oldest[1]} or newer"
    yield DoctorFinding(name, "PolyScope", shown, "", wanted)
    begin, first = monotonic(), arm.state()
    times, ages, values = [first.time], [], [first.tool_velocity[:3]]
    while monotonic() - begin < seconds:
        state = arm.state()
        ages.append(monotonic() - state.time)
        if state.time > times[-1]:
            times.append(state.time)
            values.append(state.tool_velocity[:3])
        sleep(GLANCE)
    watched, last = Watched(np.array(times), np.array(ages), np.array(values)), arm.state()
    yield from timing_findings(robot, name, watched)
    cycles = cycle_rate(arm.version)
    network = "check cable and switch: a connection of its own between this computer and the controller"
    yield judged(name, "rate", watched.rate, "Hz", f"{cycles:g}", watched.rate >= SLOW_SHARE * cycles, network)
    yield judged(
        name,
        "control period",
        1e3 * robot.file.period,
        "ms",
        f"at least {1e3 / cycles:g}, its cycle",
        robot.file.period * cycles > 1.0 - 1e-6,
        f"write period_s: {1.0 / cycles:g}",
        DoctorVerdict.NOTE,
    )
    lost = last.lost - first.lost
    share = 100.0 * lost / max(1.0, cycles * seconds)
    yield judged(name, "states lost", share, "%", "at most 1", share <= 1.0, network, DoctorVerdict.NOTE)
    yield from _state(name, last)
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
    x, y, z = last.tool_pose[:3]
    yield DoctorFinding(name, "tip in its own base frame", f"{x:.4f} {y:.4f} {z:.4f}", "m")


def _state(name: str, last: UrState) -> Iterator[DoctorFinding]:
    """Yield what the controller reports of its state."""
    problem = safety_problem(last.robot_mode, last.safety_bits)
    yield judged(name, "safety", problem.name.lower(), "", "none", not problem, "see the pendant")
    yield judged(
        name,
        "power",
        "on, brakes released" if last.robot_mode == RUNNING else f"mode {last.robot_mode}",
        "",
        "on, brakes released",
        last.robot_mode == RUNNING,
        "power it on the pendant",
    )
    yield judged(
        name,
        "program",
        "plays" if last.runtime_state == PLAYING else f"state {last.runtime_state}",
        "",
        "plays",
        last.runtime_state == PLAYING,
        "switch the pendant to remote control",
    )
    full = last.speed_scaling > 0.99
    fix = "move the speed slider to 100 %, or backend.arm.speed_slider: 1.0: all velocities are scaled by it"
    yield judged(name, "speed scaling", 100.0 * last.speed_scaling, "%", "100", full, fix, DoctorVerdict.NOTE)
