"""One three-finger grasp with disturbances, and what came of it."""

import math
from dataclasses import dataclass

import numpy as np

from palpate.experiments.grasp import GraspConfig, grasp_object

MU, E = 0.5, 0.004


@dataclass(frozen=True, slots=True)
class Came:
    """What came of it.

    Attributes:
        slip: Largest in the air, over any fingertip [m].
        spin: Largest about any normal while it was pulled [rad].
        grip: Mean force over the mean of the least that any forces of the fingers could do with.
        dropped: Whether it was lost.
    """

    slip: float
    spin: float
    grip: float
    dropped: bool


def drawn(seed: int, load: str = "ramp", **more: object) -> GraspConfig:
    """Return a grasp of three fingers: object, weight, pull and where it pulls are drawn."""
    draw = np.random.default_rng((seed, 41))
    chosen: dict[str, object] = {
        "fingers": 3,
        "object": "cylinder" if draw.random() < 0.5 else "sphere",
        "mass": float(draw.uniform(0.08, 0.25)),
        "friction": MU,
        "spin_length": E,
        "load": load,
        "pull": float(draw.uniform(2.0, 5.0)) if load != "shake" else float(draw.uniform(0.5, 1.0)),
        "offset": float(draw.uniform(0.0, 0.008)),
        "seed": seed,
    }
    return GraspConfig(**(chosen | more))  # type: ignore[arg-type]


def known(seed: int, load: str = "ramp", margin: float = 0.04) -> Came:
    """Hold with mu and e known."""
    return came(drawn(seed, load, margin=margin, believed_friction=MU, believed_spin_length=E))


def estimated(seed: int, load: str = "ramp", margin: float = 0.04) -> Came:
    """Hold with mu and e estimated: standard deviations of 15 and 25 %, held with 99 %."""
    return came(drawn(seed, load, margin=margin, known="estimated"))


def came(config: GraspConfig) -> Came:
    """Carry it out."""
    grasp = grasp_object(config)
    return Came(max(grasp.slip, grasp.slip_aloft), grasp.spin, grasp.grip_ratio, grasp.dropped)


def worst(found: list[Came]) -> str:
    """Return the figures of several, one line."""
    slip = 1e3 * max(each.slip for each in found)
    spin = math.degrees(max(each.spin for each in found))
    ratios = [each.grip for each in found]
    drops = sum(each.dropped for each in found)
    return (
        f"{len(found)} runs: {drops} dropped, slip up to {slip:.4f} mm, spin up to {spin:.4f} degrees, grip "
        f"{np.mean(ratios):.3f} times the least (up to {max(ratios):.3f})"
    )
