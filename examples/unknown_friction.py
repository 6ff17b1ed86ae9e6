"""A grasp with friction unknown.

A hand takes a box whose friction it does not know: it could be a third lower or higher. It closes, lets the
fingers slide and twist a little down the sides (a nudge), and learns from the forces what each contact bears.
Then it lifts with the least grip that neither slips nor spins, while something pulls beside the fingers.
Beside it, the same without a nudge: planned for the worst that is likely, it grips harder.

    python examples/unknown_friction.py --friction 0.4

It prints what each finger found, and the grip over the least that physics allows (1 would be on the edge).
"""

import math
from dataclasses import replace

import tyro

import palpate as pp


def report(config: pp.GraspConfig) -> None:
    """Grasp, and print how it went."""
    done = pp.grasp_object(config)
    print(f"{config.known}: {done.run}; {'dropped' if done.dropped else 'held'}")
    slip, spin = 1e6 * done.slip_aloft, math.degrees(done.spin_aloft)
    print(f"  grip {done.grip_ratio:.2f} times the least; slipped {slip:.1f} um, spun {spin:.3f} degrees")
    for finger, found in enumerate(done.nudged, start=1):
        mu = "unknown" if found.friction is None else f"{found.friction:.3f}"
        e = "unknown" if found.spin_length is None else f"{1e3 * found.spin_length:.2f} mm"
        print(f"  finger {finger} found mu {mu}, e {e}")


def main(friction: float = 0.4, spin_length: float = 0.004, pull: float = 3.0, seed: int = 0) -> None:
    """Grasp an object of this true friction, with a nudge and without."""
    true = pp.GraspConfig(
        friction=friction,  # tangential over normal force, true and unknown
        spin_length=spin_length,  # largest spin torque over largest friction force [m], likewise
        pull=pull,  # force that grows beside the fingers [N]
        lift_height=0.02,  # [m]
        seed=seed,  # of sensor noise, and of what is believed at first
    )
    for known in ("nudged", "untouched"):
        report(replace(true, known=known))


if __name__ == "__main__":
    tyro.cli(main)
