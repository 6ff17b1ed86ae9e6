"""Devices on the wire: real client libraries, sockets and terminals against emulated devices.

    python benchmarks/wire [PART ...] [--tries N] [--csv FILE]

brief (without a part): ages, rates, some faults and a short soak in two minutes. age: age of a UR arm's state
at 500 Hz and time to detect faults (`--seconds`, `--tries`). sensors: rates, losses, processor time and faults
of force/torque sensors. faults: every fault of a robot in contact (`--only`, `--page`). soak: random faults for
`--minutes`. experiment: one exploration and one grasp on MuJoCo, on the wire and from the log. creeping: delays
that grow. connections: cost of foreign connections to a control loop. dead: largest force of a robot whose
force sensor is dead, in simulation.

Close other programs: the largest times depend on this computer as well. Exit status 1: a figure was missed.
"""

import argparse
import sys
from pathlib import Path


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of all parts."""
    parser.add_argument(
        "--tries", type=int, help="tries of each fault, or pairs of turns; each part has its default"
    )
    parser.add_argument("--seconds", type=float, help="duration of a measurement [s]; each part has its default")
    parser.add_argument("--quick", action="store_true", help="dead: only sensors that are dead from the start")
    parser.add_argument("--only", default="", help="faults: rows whose names contain these words")
    parser.add_argument("--page", type=Path, help="faults: write the Markdown page")
    parser.add_argument("--minutes", type=float, default=30.0, help="soak: duration [min]")
    parser.add_argument("--every", type=float, default=4.0, help="soak: mean time between faults [s]")
    parser.add_argument("--seed", type=int, default=9, help="soak: seed of the faults")
    parser.add_argument("--runs", type=int, default=3, help="experiment: number of explorations")
    parser.add_argument("--scale", type=float, default=1.0, help="experiment: time scale")
    parser.add_argument("--grasp-scale", type=float, default=0.25, help="experiment: time scale of the grasp")
    parser.add_argument("--no-grasp", action="store_true", help="experiment: explorations only")
    parser.add_argument("--device", nargs="+", help="creeping: ur, netft, bota, resense, dynamixel")
    parser.add_argument("--limit", type=float, default=0.1, help="creeping: largest age [s]")
    parser.add_argument("--quiet", type=float, default=60.0, help="creeping: time with jitter only [s]")
    parser.add_argument("--connections", type=int, default=500, help="connections: number of them")
    parser.add_argument("--robot", action="append", help="dead: instead of stage and ur5e-sim; may be repeated")


if __name__ == "__main__":
    benchmarks = Path(__file__).resolve().parents[1]
    sys.path[:1] = [str(benchmarks), str(benchmarks.parent / "tests")]
    from harness.campaign import start

    from wire import age, brief, connections, creeping, dead_sensors, experiment, faults, sensors, soak

    modules = (brief, age, sensors, faults, soak, experiment, creeping, connections, dead_sensors)
    parts = {name: part for module in modules for name, part in module.PARTS.items()}
    start(__doc__, parts, add_options, default=("brief",))
