"""Costs of palpate on this computer, each against what it is compared with.

    python benchmarks/costs [NAME ...] [--quick]

period: what a control period at 1 kHz is made of, without physics; lateness: how punctual it is, idle and beside
busy processes; recording: what a recorder and topics served to a page add to it, and megabytes per second of
log; switching, collections: other threads and the garbage collector. learning: periods per second of an agent
against the bare back end and the loop. arms: inverse velocity, its error, and MuJoCo's kinematics. rollout:
presses by MuJoCo's threads. sweep, sweep-ray: a sweep against commands of one run each, two jobs against one,
and its cost against the number of runs.

Alternatives take turns, so that other load hits all of them: trust ratios. Close other programs for period,
lateness and recording; for real-time priority run them as a user who may have it.
"""

import sys
from pathlib import Path

if __name__ == "__main__":
    sys.path[0] = str(Path(__file__).resolve().parents[1])
    from harness.command import start

    from costs import kinematics, loop, parallel, stepping

    start(__doc__, loop.COSTS | stepping.COSTS | kinematics.COSTS | parallel.COSTS)
