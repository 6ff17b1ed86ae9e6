"""A fingertip of one's own.

Any closed convex shape that can be written as a formula is a fingertip: here an egg, pointed below.
Derivatives come from CasADi, the compiled solver from numba. The script builds the same egg into a
simulation, lets it down on a ball beside its top, and compares the contact that touch computes with that of the
simulation.

    python examples/own_fingertip.py

It prints a line for each place: where it is touched, in the sensor frame, as felt and as it is.
"""

import casadi
import numpy as np
import tyro

import palpate as pp

BALL = 0.02  # radius of what is touched, about the origin [m]
LOWEST = 0.008  # the tip need not go further down to meet the ball [m]


def egg(radius: float = 0.008, length: float = 0.012) -> pp.SymbolicSurface:
    """Return an egg of a radius [m] across and a half length [m]: its formula is negative inside."""
    point = casadi.SX.sym("point", 3)
    x, y, z = point[0], point[1], point[2]
    formula = (x**2 + y**2) / radius**2 * casadi.exp(-0.4 * z / length) + z**2 / length**2 - 1.0
    return pp.SymbolicSurface(point, formula, size=radius)


def press(tip: pp.Tip, beside: float, force: float) -> tuple[pp.Contact, np.ndarray]:
    """Let a tip down beside the ball until it feels a force [N]; return the contact, and where it is."""
    touch, start = pp.Touch(tip.finger()), (beside, 0.0, 0.04)
    with pp.MujocoBackend(pp.build_scene(tip, pp.SphereObject(BALL), pp.ContactLaw(), start)) as backend:
        now = touch.sense(backend.start())
        while not (now.fingers[0].touching and now.fingers[0].contact.normal_force > force):
            if now.arm.position_base_tip[2] < LOWEST:
                raise SystemExit(f"beside = {beside:g} m: the tip meets no ball there; take a place nearer to 0")
            now = touch.sense(backend.step(pp.Command((0.0, 0.0, -0.005))))  # down, with 5 mm/s
        return now.fingers[0].contact, np.subtract(backend.truth().position, now.arm.position_base_tip)


def main(force: float = 2.0, beside: tuple[float, ...] = (-0.01, 0.0, 0.01)) -> None:
    """Press with a force [N] at places beside the ball's middle [m]."""
    if not 0.0 < force <= 10.0:
        raise SystemExit(f"force = {force:g} N: must be above 0 and at most 10")
    tip = pp.Tip(egg())
    for x in beside:  # [m]
        contact, true = press(tip, x, force)
        off = np.linalg.norm(contact.centroid - true)
        felt, known = (np.round(1e3 * place, 2) for place in (contact.centroid, true))
        print(f"{1e3 * x:5.1f} mm beside: felt at {felt}, is at {known} mm: {1e6 * off:.0f} um off")


if __name__ == "__main__":
    tyro.cli(main)
