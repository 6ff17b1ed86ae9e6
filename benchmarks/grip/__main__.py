"""Grips compared on the same simulated hands, objects and seeds, and what is sensed through held objects.

    python benchmarks/grip PART ... [--seeds N] [--plant] [--csv FILE] [--write]

league: ours, constant grip + 50 %, friction-ratio PD and slip-triggered regrip in eight scenarios (`--write`:
into docs/slip-safe-grasps.md). changes: mu -30 % and -50 % in 20 ms, at all fingers or one. too-high: mu 30 %
below its estimate. alarms: undisturbed at a load ratio of 0.9, and with three times the noise. shaken: 1 N, 2
to 10 Hz, for 30 s. long: ten minutes at the default drift of zeros (`--seconds`). fast: drift of 0.1 N/s for 10
s. steps: 2.5 N within 5 ms. sharing: three fingers that share a load (`--loads`). onset: latency and false
alarms of a ripple on the grip. pin-contact, pin-count, pin-slip, pin-alarms: a pin of 80 mm held by sensors.
pin-touches, pin-runs: the robot `stage-pin`. box: contacts of a held box.

`--known`, `--fingers`: knowledge of friction and numbers of fingers; all, or touched and two. `--plant`:
bristles of the friction plant instead of MuJoCo's friction. Seeds from 2000 on are those on which nothing was
tuned. Exit status 1: a figure that was asked for was missed.
"""

import argparse
import sys
from pathlib import Path


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of all parts."""
    parser.add_argument("--seeds", type=int, help="number of seeds; each part has its own default")
    parser.add_argument("--quick", action="store_true", help="fewer cases: onset in about a minute")
    parser.add_argument("--plant", action="store_true", help="bristles instead of MuJoCo's friction")
    parser.add_argument("--known", nargs="+", choices=("touched", "estimated", "untouched"))
    parser.add_argument("--fingers", nargs="+", type=int, choices=(2, 3))
    parser.add_argument("--seconds", type=float, default=600.0, help="duration of long [s]")
    parser.add_argument("--steady", action="store_true", help="long and fast: the controller assumes no drift")
    parser.add_argument("--loads", nargs="+", default=["ramp"], choices=("ramp", "step", "shake"))


if __name__ == "__main__":
    benchmarks = Path(__file__).resolve().parents[1]
    sys.path[:1] = [str(benchmarks), str(benchmarks.parent / "tests")]
    from harness.campaign import start

    from grip import exploring_pin, held_object, held_tool, league, long_hold, sharing, slip_onset

    modules = (league, long_hold, sharing, slip_onset, held_tool, held_object, exploring_pin)
    parts = {name: part for module in modules for name, part in module.PARTS.items()}
    start(__doc__, parts, add_options, default=("league",))
