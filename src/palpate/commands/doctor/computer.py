"""Whether this computer is fit for a control loop."""

import os
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from palpate.hw.finding import DeviceFinding, FindingVerdict, judged
from palpate.robots.pace_entries import RealTimePaceEntry
from palpate.robots.robot_file import RobotFile
from palpate.runtime.real_time import Overrun, RealTime
from palpate.runtime.urgency import urgency_granted

COMPUTER = "this computer"

LATE_SHARE = 0.5
"""Of a period, by which 99 of 100 wake-ups may be late: then as much is left for the period's work."""

GOVERNORS = "/sys/devices/system/cpu/cpu*/cpufreq/scaling_governor"
REAL_TIME_KERNEL = Path("/sys/kernel/realtime")
LARGEST_BUFFER = Path("/proc/sys/net/core/rmem_max")
WANTED_BUFFER = 1 << 22
"""[bytes] That clients of Ethernet sensors ask for: 0.7 s of records at 7000 Hz."""


def computer_findings(file: RobotFile, seconds: float) -> Iterator[DeviceFinding]:
    """Measure wake-ups as the loop will have them, and ask the system what it grants.

    Args:
        file: Its period and pace.
        seconds: How long to measure.
    """
    yield from _wake_ups(file, seconds)
    yield _load()
    if sys.platform != "linux":
        yield DeviceFinding(
            COMPUTER, "system", sys.platform, "", "linux", FindingVerdict.NOTE, "real time is for Linux"
        )
        return
    granted = urgency_granted()
    fix = "add `@realtime - nice -20` to /etc/security/limits.d/realtime.conf and join that group"
    words = "granted" if granted else "refused"
    yield judged(COMPUTER, "urgent reading threads", words, "", "granted", granted, fix, FindingVerdict.NOTE)
    kernel = "real-time" if REAL_TIME_KERNEL.is_file() else "ordinary"
    fix = "with a real-time kernel (PREEMPT_RT) the largest lateness goes down to tenths of a millisecond"
    yield judged(COMPUTER, "kernel", kernel, "", "real-time", kernel == "real-time", fix, FindingVerdict.NOTE)
    governors = {path.read_text().strip() for path in Path("/").glob(GOVERNORS[1:])}
    if governors:
        words = ", ".join(sorted(governors))
        fix = "`sudo cpupower frequency-set -g performance`: cores that sleep deeply wake up late"
        yield judged(
            COMPUTER,
            "CPU governor",
            words,
            "",
            "performance",
            governors == {"performance"},
            fix,
            FindingVerdict.NOTE,
        )
    if LARGEST_BUFFER.is_file():
        size = int(LARGEST_BUFFER.read_text())
        fix = f"`sudo sysctl -w net.core.rmem_max={WANTED_BUFFER}`, or records are lost when the computer stalls"
        yield judged(
            COMPUTER,
            "largest receive buffer",
            float(size >> 10),
            "KiB",
            f"{WANTED_BUFFER >> 10} for fast Ethernet sensors",
            size >= WANTED_BUFFER,
            fix,
            FindingVerdict.NOTE,
        )


def _wake_ups(file: RobotFile, seconds: float) -> Iterator[DeviceFinding]:
    pace = file.pace if isinstance(file.pace, RealTimePaceEntry) else RealTimePaceEntry()
    pacer = RealTime(file.period, Overrun.SKIP, spin=pace.spin, priority=pace.priority)
    pacer.start()
    try:
        for _ in range(round(seconds / file.period)):
            pacer.wait()
    finally:
        kept = pacer.stop()
    if pace.priority is not None:
        granted = "SCHED_FIFO" in kept.note and "no " not in kept.note
        yield judged(
            COMPUTER,
            f"real-time priority {pace.priority}",
            "granted" if granted else "refused",
            "",
            "granted",
            granted,
            kept.note,
            FindingVerdict.NOTE,
        )
    half, most, worst = (
        1e3 * float(x) for x in (*np.percentile(kept.lateness.values, [50.0, 99.0]), kept.lateness.values.max())
    )
    limit = 1e3 * LATE_SHARE * file.period
    fix = "real-time priority (pace.priority), a quieter computer, or a longer period_s"
    yield DeviceFinding(COMPUTER, "wakes up late by, median", half, "ms")
    yield judged(COMPUTER, "wakes up late by, 99 %", most, "ms", f"at most {limit:g}", most <= limit, fix)
    yield DeviceFinding(COMPUTER, "wakes up late by, at worst", worst, "ms")
    share = 100.0 * kept.overruns / max(1, len(kept.lateness))
    yield judged(COMPUTER, "periods left out", share, "%", "at most 1", share <= 1.0, fix)


def _load() -> DeviceFinding:
    load, cores = os.getloadavg()[0], os.cpu_count() or 1
    fix = "close what else runs: devices are served late when all cores are busy"
    return judged(COMPUTER, "load", load, "", f"below its {cores} cores", load < cores, fix, FindingVerdict.NOTE)
