"""Try faults of every kind at random moments: is the robot at rest, reported so, and nothing left behind?

    python benchmarks/faults --list
    python benchmarks/faults --moments 10 --seed 1
    python benchmarks/faults --kinds "process network" --moments 3
    python benchmarks/faults --kinds "sensor: frozen" --moments 20
    python benchmarks/faults --robot my-cell.yaml --moments 5
    python benchmarks/faults --search 300

Each kind has a domain: process (signals, a closed terminal, kill -9), resource (disk, memory, descriptors),
protocol (what comes over the wire), supervision (hostile controllers, wrong sensors), input (damaged files, wrong
options) and network (delay, loss, partition, through a proxy). A moment is a share of the run and a seed, both
drawn from --seed and the kind's name: a failure is repeated by the same --seed and --kinds.

Judged after each: the robot's rest as simulation or emulator measures it, against what palpate reports; force,
speed and grip against 1.5 and 1.02 times their limits; processes, terminals, shared memory and temporary files
that are left; that the next run works; that the log can be read to the last half second. Exit code 1 if anything
was not right. The table: docs/faults.md.

--robot takes the name of a robot, a robot file, or module:factory, which returns a palpate.robots.robot.Robot: of
the kinds, those that can be tried anywhere are tried on it. Mind what it may run into if it is a real one.
"""

import sys
from pathlib import Path

if __name__ == "__main__":
    benchmarks = Path(__file__).resolve().parents[1]
    # `support` and `runtime.log` are the tests' own; `faults` is this folder
    sys.path[:1] = [str(benchmarks), str(benchmarks.parent / "tests")]
    from faults.campaign import main

    sys.exit(main(__doc__))
