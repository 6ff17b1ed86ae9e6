"""`palpate doctor`: connects to the devices of a robot file and reports what to fix. Moves nothing."""

import os
import sys
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from itertools import chain
from pathlib import Path
from time import monotonic, sleep

import numpy as np
from rich.console import Console
from rich.table import Table
from rich.text import Text

from palpate.commands.command_result import CommandResult
from palpate.commands.devices.config import DoctorConfig
from palpate.commands.devices.rig_devices import (
    INVALID_READING,
    AnyDevice,
    fitness,
    opened_rig,
    separate_devices,
)
from palpate.errors import FloatArray
from palpate.extras import MissingLibraryError
from palpate.hw.devices import ArmDevice, DeviceError, HandDevice, SensorDevice
from palpate.hw.finding import DeviceFinding, DeviceUse, FindingVerdict, SelfExamining, judged
from palpate.robots.finger_load import noise_of_finger
from palpate.robots.pace_entries import RealTimePaceEntry
from palpate.robots.rig import RigParts, rig_entry
from palpate.robots.robot import Robot
from palpate.robots.robot_file import RobotFile
from palpate.runtime.data import ArmSample
from palpate.runtime.progress import step_progress
from palpate.runtime.real_time import Overrun, RealTime
from palpate.runtime.standstill_check import REST_SPEED
from palpate.runtime.urgency import urgency_granted
from palpate.sensing.ft.arrays import AXES

_STYLES = {FindingVerdict.GOOD: "green", FindingVerdict.NOTE: "yellow", FindingVerdict.BAD: "bold red"}
_COMPUTER = "this computer"

_MAX_LATE_SHARE = 0.5
"""Largest 99th percentile of the lateness of wake-ups, as a share of the period: the rest is for the work."""

_WATCH_INTERVAL = 2e-4
"""Time between two readings of a device [s]: the interval between records of the fastest sensor."""

_MIN_RATE_SHARE = 0.9
"""Smallest rate of a sensor as a share of the loop's: clocks differ by less, so that records are missing."""

_MAX_NOISE_RATIO = 2.0
"""Largest ratio of measured noise to the noise in the sensor's file."""

_MIN_RECEIVE_BUFFER = 1 << 22
"""Receive buffer that clients of Ethernet sensors request [bytes]: 0.7 s of records at 7000 Hz."""

_CPU_GOVERNORS = "sys/devices/system/cpu/cpu*/cpufreq/scaling_governor"
_REAL_TIME_KERNEL = Path("/sys/kernel/realtime")
_RECEIVE_BUFFER = Path("/proc/sys/net/core/rmem_max")


def run_doctor(config: DoctorConfig) -> CommandResult:
    """Examine all devices and print the findings.

    Returns:
        The findings; done if nothing has to be fixed.

    Raises:
        InvalidValueError: If there is no such robot, or it has no devices.
        DeviceError: If emulators do not come up.
    """
    with opened_rig(config.robot) as (robot, parts):
        devices = separate_devices(parts)
        with step_progress(Console(), [_COMPUTER, *(device.name for device in devices)]) as announce:
            announce(_COMPUTER)
            findings = [*_computer_findings(robot.file, config.duration)]
            for device in devices:
                announce(device.name)
                findings += _examined(device, _findings(robot, parts, device, config.duration))
    fit = all(finding.verdict is not FindingVerdict.BAD for finding in findings)
    outcome = "Fit to run." if fit else "Not fit to run."
    fixes = [
        f"{word}: {finding.device}, {finding.what}: {finding.fix}"
        for verdict, word in ((FindingVerdict.BAD, "Fix"), (FindingVerdict.NOTE, "Note"))
        for finding in findings
        if finding.fix and finding.verdict is verdict
    ]
    table = _table(robot.file.name, findings)
    return fitness(fit, outcome, (table, *fixes, outcome), robot=robot.file.name, findings=findings)


def _table(title: str, findings: Iterable[DeviceFinding]) -> Table:
    table, last = Table(title=Text(title), show_edge=False), ""
    for column in ("device", "what", "value", "unit", "should be", ""):
        table.add_column(column, justify="right" if column == "value" else "left")
    for one in findings:
        value = one.value if isinstance(one.value, str) else f"{one.value:.4g}"
        device, last = "" if one.device == last else one.device, one.device
        cells = (device, one.what, value, one.unit, one.wanted)
        table.add_row(*(Text(cell) for cell in cells), Text(one.verdict, style=_STYLES[one.verdict]))
    return table


def _examined(device: AnyDevice, findings: Iterator[DeviceFinding]) -> Iterator[DeviceFinding]:
    """Start a device, yield the findings on it, and close it; a failure is a finding, too."""
    try:
        device.start()
        yield from findings
    except DeviceError as error:
        yield DeviceFinding(device.name, "connection", error.problem, "", "", FindingVerdict.BAD, error.remedy)
    except MissingLibraryError as error:
        yield DeviceFinding(device.name, "client library", "missing", "", "", FindingVerdict.BAD, str(error))
    finally:
        device.close()


def _findings(robot: Robot, parts: RigParts, device: AnyDevice, duration: float) -> Iterator[DeviceFinding]:
    """Return the findings on a device, which is started before the first is requested.

    Sensors in the arm are examined while the arm runs. Each iterator raises DeviceError if its device is lost.
    """
    if parts.hand is not None and device is parts.hand:
        return _hand_findings(robot, parts.hand, duration)
    sensors = [(i, finger.device) for i, finger in enumerate(parts.sensors)]
    if parts.arm is not None and device is parts.arm:
        within = [(i, sensor) for i, sensor in sensors if parts.sensors[i].in_arm]
        examined = (_examined(sensor, _sensor_findings(robot, i, sensor, duration)) for i, sensor in within)
        return chain(_arm_findings(robot, parts.arm, duration), *examined)
    return chain(*(_sensor_findings(robot, i, sensor, duration) for i, sensor in sensors if sensor is device))


@dataclass(frozen=True, slots=True, eq=False)
class _Watched:
    """Samples of a device at rest.

    Attributes:
        time: Time at which each new sample was taken, shape (n,) [s].
        age: Age of the newest sample at each reading, shape (k,) [s].
        values: Wrench or velocity of each new sample, shape (n, m).
        last: Newest sample of an arm.
    """

    time: FloatArray
    age: FloatArray
    values: FloatArray
    last: ArmSample | None = None

    @property
    def rate(self) -> float:
        """Rate of new samples [1/s]."""
        n = len(self.time)
        return (n - 1) / float(self.time[-1] - self.time[0]) if n > 1 else 0.0


def _watched(device: ArmDevice | SensorDevice, duration: float) -> _Watched:
    times, ages, last, begin = list[float](), list[float](), None, monotonic()
    values: list[tuple[float, ...]] = []
    while not times or monotonic() - begin < duration:
        sample = device.read()
        if isinstance(sample, ArmSample):
            last = sample
        elif not sample.healthy:
            problem = getattr(device, "problem", "") or INVALID_READING
            raise DeviceError(device.name, problem, "take loads off, see its manual")
        ages.append(monotonic() - sample.time)
        if not times or sample.time > times[-1]:
            times.append(sample.time)
            values.append(sample.velocity_base_tip if isinstance(sample, ArmSample) else sample.wrench)
        sleep(_WATCH_INTERVAL)
    return _Watched(np.array(times), np.array(ages), np.array(values), last)


def _timing_findings(robot: Robot, name: str, watched: _Watched) -> Iterator[DeviceFinding]:
    half, most = 1e3 * np.percentile(watched.age, [50.0, 99.0])
    oldest = 1e3 * robot.file.limits.sample_age
    fix = "check the network and what else runs here, or allow more (limits.sample_age_s)"
    yield DeviceFinding(name, "age, median", float(half), "ms")
    yield judged(name, "age, 99 %", float(most), "ms", f"at most {oldest:g}", bool(most <= oldest), fix)
    if len(watched.time) > 2:
        gaps = 1e3 * np.diff(watched.time)
        yield DeviceFinding(name, "jitter of samples", float(gaps.std()), "ms")
        yield DeviceFinding(name, "largest gap between samples", float(gaps.max()), "ms")


def _arm_findings(robot: Robot, arm: ArmDevice, duration: float) -> Iterator[DeviceFinding]:
    name, limits = arm.name, robot.file.limits
    watched = _watched(arm, duration)
    yield from _timing_findings(robot, name, watched)
    if isinstance(arm, SelfExamining):
        yield from arm.findings(DeviceUse(robot.file.period, len(watched.time), watched.rate))
    speed = float(np.linalg.norm(watched.values, axis=1).max())
    fix = "is its payload right (backend.arm.payload)? Is it led by hand?"
    at_most = f"below {1e3 * REST_SPEED:g}"
    yield judged(name, "largest speed at rest", 1e3 * speed, "mm/s", at_most, speed < REST_SPEED, fix)
    assert watched.last is not None  # an arm gives arm samples
    if limits.joint_lower:
        pairs = zip(watched.last.joint_position, limits.joint_lower, limits.joint_upper, strict=False)
        outside = [str(i) for i, (q, low, high) in enumerate(pairs, start=1) if not low <= q <= high]
        value = f"outside: joint {', '.join(outside)}" if outside else "inside"
        fix = "lead it there, or correct limits.joint_lower_rad and joint_upper_rad"
        yield judged(name, "joints within the robot's limits", value, "", "inside", not outside, fix)
    position = " ".join(f"{x:.4f}" for x in watched.last.position_base_tip)
    yield DeviceFinding(name, "tip in its own base frame", position, "m")


def _hand_findings(robot: Robot, hand: HandDevice, duration: float) -> Iterator[DeviceFinding]:
    took, begin = list[float](), monotonic()
    while monotonic() - begin < duration:
        sent = monotonic()
        hand.read()
        took.append(monotonic() - sent)
    if isinstance(hand, SelfExamining):
        yield from hand.findings(DeviceUse(robot.file.period, len(took), len(took) / duration))
    entry = rig_entry(robot).hand
    assert entry is not None  # the robot file has made the device
    half, most = (1e3 * float(x) for x in np.percentile(took, [50.0, 99.0]))
    oldest, poll = 1e3 * robot.file.limits.sample_age, 1e3 * entry.poll
    yield judged(
        hand.name,
        "exchange, median",
        half,
        "ms",
        f"at most backend.hand.poll_s, {poll:g}",
        half <= poll,
        f"write poll_s: {1e-3 * half * 1.3:.3f}, or raise the baud rate",
        FindingVerdict.NOTE,
    )
    yield judged(
        hand.name,
        "exchange, 99 %",
        most,
        "ms",
        f"well below limits.sample_age_s, {oldest:g} ms",
        most + poll < oldest,
        "check cables, baud rate and the adapter",
    )


def _sensor_findings(robot: Robot, i: int, sensor: SensorDevice, duration: float) -> Iterator[DeviceFinding]:
    """Yield the findings on the sensor of finger i."""
    watched = _watched(sensor, duration)
    if len(watched.time) < 3:
        raise DeviceError(sensor.name, f"{len(watched.time)} records in {duration:g} s", "check its settings")
    yield from _timing_findings(robot, sensor.name, watched)
    file, loop_rate = robot.sensors[i], 1.0 / robot.file.period
    yield judged(
        sensor.name,
        "rate",
        watched.rate,
        "Hz",
        f"{loop_rate:g}, the loop's",
        watched.rate >= _MIN_RATE_SHARE * loop_rate,
        f"its records repeat themselves: give device_rate_Hz: {watched.rate:.0f} in its sensor file",
        FindingVerdict.NOTE,
    )
    if file is not None:
        yield judged(
            sensor.name,
            "sample_rate_Hz of its file",
            file.sample_rate,
            "Hz",
            f"{loop_rate:g}",
            abs(file.sample_rate / loop_rate - 1.0) < 1e-6,
            f"write sample_rate_Hz: {loop_rate:g}: it is read once per period, and filtered at that rate",
        )
    raw = file is not None and file.calibration is not None
    units = [""] * 6 if raw else ["N"] * 3 + ["N m"] * 3
    noise, limits = watched.values.std(axis=0, ddof=1), _MAX_NOISE_RATIO * np.array(noise_of_finger(robot, i))
    for axis, unit, sd, limit in zip(AXES, units, noise.tolist(), limits.tolist(), strict=True):
        fix = f"is something touched, or does it move? Else write {sd:.2g} as its noise"
        yield judged(sensor.name, f"noise {axis}", sd, unit, f"at most {limit:.2g}", raw or sd <= limit, fix)
    for axis, unit, mean in zip(AXES, units, watched.values.mean(axis=0).tolist(), strict=True):
        yield DeviceFinding(sensor.name, f"at rest {axis}", mean, unit)
    if not noise.any():
        fix = "a reading that never changes is that of a dead sensor, unless it is an emulated one"
        yield DeviceFinding(sensor.name, "readings", "never change", "", "noise", FindingVerdict.NOTE, fix)


def _computer_findings(file: RobotFile, duration: float) -> Iterator[DeviceFinding]:
    """Measure wake-ups at the period and pace of a robot file, and query the priority that the system grants."""
    yield from _wake_up_findings(file, duration)
    load, cores = os.getloadavg()[0], os.cpu_count() or 1
    yield _computer_note(
        "load",
        load,
        f"below its {cores} cores",
        load < cores,
        "close what else runs: devices are served late when all cores are busy",
    )
    if sys.platform != "linux":
        yield _computer_note("system", sys.platform, "linux", False, "real time is for Linux")
        return
    granted = urgency_granted()
    yield _computer_note(
        "urgent reading threads",
        "granted" if granted else "refused",
        "granted",
        granted,
        "add `@realtime - nice -20` to /etc/security/limits.d/realtime.conf and join that group",
    )
    real_time = _REAL_TIME_KERNEL.is_file()
    yield _computer_note(
        "kernel",
        "real-time" if real_time else "ordinary",
        "real-time",
        real_time,
        "with a real-time kernel (PREEMPT_RT) the largest lateness goes down to tenths of a millisecond",
    )
    governors = {path.read_text().strip() for path in Path("/").glob(_CPU_GOVERNORS)}
    if governors:
        yield _computer_note(
            "CPU governor",
            ", ".join(sorted(governors)),
            "performance",
            governors == {"performance"},
            "`sudo cpupower frequency-set -g performance`: cores that sleep deeply wake up late",
        )
    if _RECEIVE_BUFFER.is_file():
        size = int(_RECEIVE_BUFFER.read_text())
        yield _computer_note(
            "largest receive buffer",
            float(size >> 10),
            f"{_MIN_RECEIVE_BUFFER >> 10} for fast Ethernet sensors",
            size >= _MIN_RECEIVE_BUFFER,
            f"`sudo sysctl -w net.core.rmem_max={_MIN_RECEIVE_BUFFER}`, or records are lost in stalls",
            "KiB",
        )


def _computer_note(
    what: str, value: float | str, wanted: str, good: bool, fix: str, unit: str = ""
) -> DeviceFinding:
    """Return a finding on this computer that is good, or a note with its remedy."""
    return judged(_COMPUTER, what, value, unit, wanted, good, fix, FindingVerdict.NOTE)


def _wake_up_findings(file: RobotFile, duration: float) -> Iterator[DeviceFinding]:
    pace = file.pace if isinstance(file.pace, RealTimePaceEntry) else RealTimePaceEntry()
    pacer = RealTime(file.period, Overrun.SKIP, spin=pace.spin, priority=pace.priority)
    pacer.start()
    try:
        for _ in range(round(duration / file.period)):
            pacer.wait()
    finally:
        kept = pacer.stop()
    if pace.priority is not None:
        granted = "SCHED_FIFO" in kept.note and "no " not in kept.note
        value = "granted" if granted else "refused"
        yield _computer_note(f"real-time priority {pace.priority}", value, "granted", granted, kept.note)
    lateness = kept.lateness.values
    half, most, worst = (1e3 * float(x) for x in np.percentile(lateness, [50.0, 99.0, 100.0]))
    limit = 1e3 * _MAX_LATE_SHARE * file.period
    fix = "real-time priority (pace.priority), a quieter computer, or a longer period_s"
    yield DeviceFinding(_COMPUTER, "wakes up late by, median", half, "ms")
    yield judged(_COMPUTER, "wakes up late by, 99 %", most, "ms", f"at most {limit:g}", most <= limit, fix)
    yield DeviceFinding(_COMPUTER, "wakes up late by, at worst", worst, "ms")
    share = 100.0 * kept.overruns / max(1, len(kept.lateness))
    yield judged(_COMPUTER, "periods left out", share, "%", "at most 1", share <= 1.0, fix)
