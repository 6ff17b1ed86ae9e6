"""A force held in simulation on a surface that goes up and down, the faster the harder.

    python benchmarks/control.py [--quick] [--seed N] [--picture FILE]

2 N on a plate that moves by 10 mm as a sine, with the noise of a Nano17; the true contact force is the
simulation's own. Ways differ in the stiffness that the gain is made for, and in the robot. --quick takes three
ways and two speeds.
"""

import math

import numpy as np
from harness.command import start
from harness.study import Effort, Errors, Row, Study

import palpate as pp

SPEEDS = (0.005, 0.01, 0.02, 0.04)
"""[m/s] Largest speed of the surface."""

WAYS: dict[str, dict[str, object]] = {
    "stage, stiffness as assumed": {},
    "stage, identified by pressing": {"identify": True},
    "UR5e, stiffness as assumed": {"robot": "ur5e-sim"},
    "stage, three times as stiff as assumed": {"assumed_stiffness": 20e3 / 3.0},
    "stage, a third as stiff as assumed": {"assumed_stiffness": 60e3},
}


def moving(effort: Effort) -> Study:
    """Hold a force on a plate that goes up and down."""
    rows, duration = [], 4.0 if effort.quick else 8.0
    for name, options in list(WAYS.items())[: 3 if effort.quick else None]:
        for speed in SPEEDS[1::2] if effort.quick else SPEEDS:
            effort.tell(f"moving: {name}, {1e3 * speed:g} mm/s")
            noise = {"force_noise": 0.0031, "moment_noise": 1.6e-5, "seed": effort.seed}
            config = pp.RegulateConfig(surface="sine", surface_speed=speed, duration=duration, **noise, **options)
            found = pp.regulate(config)
            error = np.abs(found.true_force - found.set_force)[found.counted]
            note = "" if len(error) else f"not held: {found.run.ending.value}"
            errors = Errors.of(error.tolist() or [math.nan], rms=True)
            rows.append(Row("sine of 10 mm", f"{name}, {1e3 * speed:g} mm/s", speed, (errors,), name, note=note))
    about = (
        "2 N on a plate that goes up and down by 10 mm as a sine, in simulation, noise of a Nano17 (3.1 mN). "
        "The error is that of the true force, root mean square and largest, from 0.5 s after landing."
    )
    quantities = (("error of the true force", "N"),)
    return Study("A force on a moving surface", about, "largest surface speed", "m/s", quantities, tuple(rows))


PARTS = {"moving": moving}

if __name__ == "__main__":
    start(__doc__, PARTS)
