"""Three fingers that share a load: grip over the theoretical minimum, slip, spin and drops."""

import argparse
import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial

import numpy as np
from harness.campaign import Listing

from grip.league import over_seeds
from palpate.experiments.grasp import GraspConfig, grasp_object

MU, E = 0.5, 0.004


@dataclass(frozen=True, slots=True)
class Came:
    """Result of one grasp.

    Attributes:
        slip: Largest slip over any fingertip after the lift [m].
        spin: Largest spin about any normal under the pull [rad].
        grip: Mean finger force over the mean of the minimum that any finger forces need.
        dropped: Whether the object was lost.
    """

    slip: float
    spin: float
    grip: float
    dropped: bool


def drawn(seed: int, load: str = "ramp", **more: object) -> GraspConfig:
    """Return a grasp of three fingers with object, weight, pull and its lever arm drawn at random."""
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


KINDS: dict[str, dict[str, object]] = {
    "known": {"believed_friction": MU, "believed_spin_length": E},
    "estimated": {"known": "estimated"},
}
"""Knowledge of mu and e; estimated: standard deviations of 15 and 25 %, held with 99 %."""


def held(seed: int, load: str, kind: str, margin: float = 0.04) -> Came:
    """Carry out one grasp."""
    grasp = grasp_object(drawn(seed, load, margin=margin, **KINDS[kind]))
    return Came(max(grasp.slip, grasp.slip_aloft), grasp.spin, grasp.grip_ratio, grasp.dropped)


def sharing(options: argparse.Namespace) -> Iterator[Listing]:
    """Hold with each kind of knowledge under each load."""
    heads = (
        "load",
        "mu and e",
        "runs",
        "dropped",
        "slip mm, worst",
        "spin deg, worst",
        "grip over least, mean / worst",
    )
    rows = []
    for load in options.loads:
        for kind in KINDS:
            found = over_seeds(partial(held, load=load, kind=kind), options, first=1000, count=12)
            ratios = [each.grip for each in found]
            rows.append(
                (
                    load,
                    kind,
                    len(found),
                    sum(each.dropped for each in found),
                    f"{1e3 * max(each.slip for each in found):.4f}",
                    f"{math.degrees(max(each.spin for each in found)):.4f}",
                    f"{np.mean(ratios):.3f} / {max(ratios):.3f}",
                )
            )
    yield Listing("three fingers share a load", heads, rows)


PARTS = {"sharing": sharing}
