"""The process that runs the loop against `watchdog_device`; tests kill it: PORT LOG [SECONDS].

Says "running" once it moves, and its ending on standard error; the exit code is that of `palpate`'s commands.
"""

import sys
from pathlib import Path

from faults.device_client import DeviceBackend, Sweep
from palpate.runtime.log import LogWriter, Recorder
from palpate.runtime.loop import run
from palpate.runtime.result import Ending, result_until
from palpate.runtime.supervision import Limits, Supervisor
from palpate.runtime.touch import Finger, Touch
from palpate.surfaces import Sphere

RUNNING = 20
"""Periods after which it says so."""
LIMITS = Limits(acceleration=50.0, sample_age=0.5)
"""A loaded machine: stalls of 0.3 s are its own, not the device's."""


def main() -> int:
    port, path, seconds = int(sys.argv[1]), Path(sys.argv[2]), float(sys.argv[3])
    periods = []

    def announce(sample, now, command):
        periods.append(None)
        if len(periods) == RUNNING:
            sys.stdout.write("running\n")
            sys.stdout.flush()

    try:
        result = run(
            DeviceBackend(port),
            Touch(Finger(Sphere(0.01))),
            Sweep(),
            Supervisor(LIMITS),
            duration=seconds,
            recorder=Recorder(LogWriter(path)),
            observers=(announce,),
        )
    except KeyboardInterrupt as interruption:
        result = result_until(interruption)
        sys.stderr.write(f"interrupted; the robot was stopped; at rest: {result.at_rest}\n")
        return 130
    sys.stderr.write(f"{result.ending.value}; {result.trip}; at rest: {result.at_rest}\n")
    return 0 if result.ending is not Ending.TRIPPED else 1


if __name__ == "__main__":
    sys.exit(main())
