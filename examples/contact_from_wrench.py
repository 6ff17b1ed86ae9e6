"""A contact from a wrench.

A fingertip of known shape sits on a six-axis force/torque sensor. From one wrench follows where the fingertip
is touched, how hard, in which direction, and how much it is twisted; from the sensor's noise, how far off
that may be. The script prints one contact with its standard deviations. Then it makes up ten thousand
contacts, computes the wrenches that they cause, and prints how far the contacts found are from those made up:
rounding errors.

    python examples/contact_from_wrench.py
"""

import numpy as np

import palpate as pp

SEMI_AXES = (0.008, 0.008, 0.012)  # of the fingertip, in the sensor frame [m]
WRENCH = [0.3, 0.1, -2.0, 0.004, 0.008, 0.003]  # what the object exerts on the finger [N, N m]
NOISE = pp.white_noise(force_noise=0.003, moment_noise=1.5e-5)  # standard deviation, each axis [N], [N m]


def made_up(count: int, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Return contact centroids [m] all over the fingertip, and the wrench [N, N m] that each of them causes."""
    rng = np.random.default_rng(seed)
    direction = rng.normal(size=(count, 3))
    centroid = np.array(SEMI_AXES) * direction / np.linalg.norm(direction, axis=1, keepdims=True)
    normal = centroid / np.square(SEMI_AXES)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    along = np.cross(normal, rng.normal(size=(count, 3)))
    force = rng.uniform(0.5, 5.0, (count, 1)) * (0.3 * along - normal)  # it rubs and pushes
    spin = rng.normal(0.0, 2e-3, (count, 1)) * normal  # and twists
    return centroid, np.hstack([force, np.cross(centroid, force) + spin])


def main() -> None:
    """Sense one contact, then ten thousand."""
    tip = pp.Ellipsoid(SEMI_AXES)
    contact = pp.contact_from_wrench(tip, WRENCH)
    spread = pp.contact_uncertainty(tip, contact, NOISE)
    print(f"{contact.status.name}: {1e3 * contact.centroid} mm, normal {contact.normal}")
    print(f"normal force {contact.normal_force:.3f} +- {spread.normal_force**0.5:.3f} N")
    print(f"spin torque {1e3 * contact.spin_torque:.3f} +- {1e3 * spread.spin_torque**0.5:.3f} mN m")
    print(f"centroid +- {1e3 * np.sqrt(np.diag(spread.centroid))} mm, noise is {spread.status.name}")

    centroid, wrenches = made_up(10_000, seed=1)
    found = pp.contacts_from_wrenches(tip, wrenches)  # all at once, as a structure of arrays
    off = np.linalg.norm(found.centroid - centroid, axis=1)
    print(f"{np.sum(found.status == 0)} of {len(found)} found, at most {off.max():.1e} m off")


if __name__ == "__main__":
    main()
