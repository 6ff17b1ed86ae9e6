"""Devices on the wire: real client libraries, sockets and terminals against emulated devices.

    python benchmarks/wire [PART ...] [--tries N] [--csv FILE]

brief (without a part): ages, rates, some faults and a short soak in two minutes. age: age of a UR arm's state at
500 Hz (`--seconds`). sensors: rates, losses and processor time of force/torque sensors. faults: every fault of a
robot in contact (`--page`). soak: random faults for `--minutes`. experiment: one exploration and one grasp on
MuJoCo, on the wire and from the log. creeping: delays that grow. connections: cost of foreign connections to a
control loop. dead: largest force of a robot whose force sensor is dead, in simulation.

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
    parser.add_argument("--page", type=Path, help="faults: write the Markdown page")
    parser.add_argument("--minutes", type=float, default=30.0, help="soak: duration [min]")


if __name__ == "__main__":
    benchmarks = Path(__file__).resolve().parents[1]
    sys.path[:1] = [str(benchmarks), str(benchmarks.parent / "tests")]
    from harness.campaign import start

    from wire import age, brief, connections, creeping, dead_sensors, experiment, faults, sensors, soak

    modules = (brief, age, sensors, faults, soak, experiment, creeping, connections, dead_sensors)
    parts = {name: part for module in modules for name, part in module.PARTS.items()}
    start(__doc__, parts, add_options, default=("brief",))
