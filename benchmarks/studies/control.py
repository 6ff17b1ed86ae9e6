"""A force held on a surface that goes up and down: the faster it goes, the worse it is held."""

import numpy as np

import palpate as pp
from palpate.errors import FloatArray
from palpate.experiments.regulate.result import Regulation
from studies.study import Row, Study, Tell

SPEEDS = (0.005, 0.01, 0.02, 0.04)
"""Largest of the surface [m/s]."""

WAYS: dict[str, dict[str, object]] = {
    "stage, stiffness as assumed": {},
    "stage, three times as stiff as assumed": {"assumed_stiffness": 20e3 / 3.0},
    "stage, a third as stiff as assumed": {"assumed_stiffness": 60e3},
    "stage, identified by pressing": {"identify": True},
    "UR5e, stiffness as assumed": {"robot": "ur5e-sim"},
}

ABOUT = (
    "2 N on a plate that goes up and down by 10 mm as a sine, in simulation, with the noise of a Nano17 (3.1 "
    "mN). The error is that of the true force, root mean square and largest, half a second after landing has "
    "settled. There is no time to compare here: speed is the surface's own. What else was asked of force "
    "control: python benchmarks/control.py."
)


def measure(quick: bool, seed: int, tell: Tell) -> Study:
    """Measure force control."""
    rows = []
    ways = list(WAYS.items())
    for name, options in ways[:1] + ways[3:] if quick else ways:
        for speed in SPEEDS[1::2] if quick else SPEEDS:
            tell(f"control: {name}, {1e3 * speed:g} mm/s")
            config = pp.RegulateConfig(
                surface="sine",
                surface_speed=speed,
                duration=4.0 if quick else 8.0,
                force_noise=0.0031,
                moment_noise=1.6e-5,
                seed=seed,
                **options,
            )
            rows.append(_row(name, speed, pp.regulate(config)))
    return Study(
        "A force on a surface that moves",
        ABOUT,
        "largest speed of the surface",
        "m/s",
        "of the true force",
        "N",
        tuple(rows),
    )


def _row(name: str, speed: float, found: Regulation) -> Row:
    error: FloatArray = (found.true_force - found.set_force)[found.counted]
    what = f"{name}, {1e3 * speed:g} mm/s"
    if not len(error):
        return Row(name, what, speed, np.nan, np.nan, f"not held: {found.run.ending.value}")
    return Row(name, what, speed, float(np.sqrt(np.mean(error**2))), float(np.abs(error).max()))
