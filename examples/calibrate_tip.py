"""A fingertip that is not as it was typed, found by touching a plate, a rod and a ball.

The simulated tip is larger than its robot file says by 4 %, sits elsewhere by half a millimetre, and its contact
is softer by a third; plate, rod and ball are not quite where they are thought to be. None of that is told to what
finds it: it touches, and works all of it out from wrenches and poses at rest.

    python examples/calibrate_tip.py

It takes a minute, and prints what was typed, found and true, and the standard deviations that the fit claims. With
--out a folder has the report, the log, and the robot file with the new tip.
"""

from pathlib import Path

import numpy as np
import tyro

import palpate as pp


def main(robot: str = "turning-stage-nano17", touches: int = 24, seed: int = 0, out: Path | None = None) -> None:
    """Touch, and print what was found."""
    wrong = pp.TipCalibrationConfig(
        robot=robot,
        touch_count=touches,
        size_error=0.04,  # of the simulated tip, which is larger than typed
        center_error=(3e-4, -2e-4, 4e-4),  # [m] by which it sits elsewhere on the sensor
        stiffness_ratio=0.7,  # of the contact, over what is typed
        seed=seed,  # of the sensor's noise
    )
    result = pp.calibrate_tip(wrong, out)
    fit, true, errors, typed = result.fit, result.true, result.errors, result.known.tip
    assert fit is not None
    assert true is not None  # it is simulated
    assert errors is not None
    print(f"{len(fit.touches)} rests in contact; {fit.verdict}")
    for name, of in (("typed", typed), ("true", true)):
        print(f"  {name}: radius {1e3 * of.shape.sizes[0]:.4f} mm, centre {np.round(1e3 * of.center, 4)} mm")
    print(f"  found: radius {1e3 * fit.sizes[0]:.4f} mm, centre {np.round(1e3 * fit.center, 4)} mm")
    print(f"  radius off by {1e6 * errors.size:.2f} um, standard deviation {1e6 * fit.sd[0]:.2f} um")
    print(f"  centre off by {1e6 * errors.center:.2f} um, per axis {1e6 * result.largest_sd:.2f} um")
    print(f"  stiffness off by {100.0 * errors.stiffness:.2f} %")


if __name__ == "__main__":
    tyro.cli(main)
