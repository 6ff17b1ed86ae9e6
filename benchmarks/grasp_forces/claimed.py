"""Grasps and loads of which something is claimed, hard for it by intention."""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from itertools import cycle, islice

import numpy as np

from palpate.errors import FloatArray
from palpate.grasp import GraspContacts, GraspForceOptimizer
from support.grasp_families import FAMILIES, drawn, instances, paired

LARGEST, SMALLEST = 1e300, 1e-90
"""[N]"""

STEPS, DRIFT = 50, 0.02
"""Of a moving sequence, and how far it goes with each, over its size."""

PER_GRASP = 20
"""Loads at the boundary of each grasp."""

NEAR = (-13.0, -3.0)
"""Decades by which loads are next to the boundary, over their size."""


@dataclass(frozen=True, slots=True, eq=False)
class Claimed:
    """A grasp, a load, and how it is asked.

    Attributes:
        grasp: Contacts.
        load: Shape (6,) [N, N m].
        factor: By which the load could be larger; None if nobody knows.
        warm: Whether it begins where the last one of the same family ended.
    """

    grasp: GraspContacts
    load: FloatArray
    factor: float | None = None
    warm: bool = False


def hard(count: int, rng: np.random.Generator) -> Iterator[Claimed]:
    """The tests' families under loads of factors that clarabel knows; every second warm."""
    per_family = math.ceil(count / (10 * len(FAMILIES)))
    for k, each in enumerate(instances(int(rng.integers(2**32)), per_family)):
        yield Claimed(each.grasp, each.load, each.factor, warm=k % 2 == 1)


def scaled(count: int, rng: np.random.Generator) -> Iterator[Claimed]:
    """The same, loads and limits of 1e-90 to 1e300 N."""
    for each in hard(count, rng):
        size = max(float(np.abs(each.load).max()), float(each.grasp.force_max.max()))
        scale = 10.0 ** rng.uniform(math.log10(SMALLEST), math.log10(LARGEST)) / size
        yield replace(
            each, grasp=replace(each.grasp, force_max=each.grasp.force_max * scale), load=each.load * scale
        )


def preloaded(count: int, rng: np.random.Generator) -> Iterator[Claimed]:
    """Opposite pairs of fingers that press with 1 to 1e15 times the load; whatever that is, they hold it."""
    for _ in range(count):
        grasp = paired(int(rng.integers(2**32)), 10.0, 1e3)
        load = rng.standard_normal(6) * [1.0, 1.0, 1.0, 0.005, 0.005, 0.005]
        load *= 10.0 ** (1.0 - rng.uniform(0.0, 15.0)) / np.linalg.norm(load)
        yield Claimed(grasp, load, _known_held(load))


def _known_held(load: FloatArray) -> float | None:
    """A load of a twentieth of the preload is held by what friction of 0.5 bears."""
    return 2.0 if np.linalg.norm(load) < 0.5 else None


def moving(count: int, rng: np.random.Generator) -> Iterator[Claimed]:
    """Contacts that drift, come and go under loads that swell and fade through what can be held, all warm."""
    for grasp, load in islice(_just_held(rng), math.ceil(count / STEPS)):
        way, aside = rng.standard_normal((len(grasp), 3)), rng.standard_normal(6) * np.abs(load).max()
        aside[3:] *= 0.01
        for step in range(STEPS):
            phase = 2.0 * np.pi * step / STEPS
            here = replace(grasp, positions=grasp.positions + 0.03 * DRIFT * math.sin(phase) * way)
            if len(grasp) > 2 and step % 10 >= 7:  # one lets go, and comes again
                here = _without_last(here)
            yield Claimed(here, (1.0 + 0.9 * math.sin(3.0 * phase)) * load + DRIFT * step * aside, warm=True)


def _without_last(grasp: GraspContacts) -> GraspContacts:
    names = ("positions", "frames", "friction", "spin_length", "force_min", "force_max")
    return GraspContacts(*(getattr(grasp, name)[:-1] for name in names))


def boundary(count: int, rng: np.random.Generator) -> Iterator[Claimed]:
    """Loads 1e-13 to 1e-3 of their size short of what can just be held, or beyond: who knows which."""
    for grasp, load in islice(_just_held(rng), math.ceil(count / PER_GRASP)):
        for _ in range(PER_GRASP):
            yield Claimed(grasp, load * (1.0 + rng.choice([-1.0, 1.0]) * 10.0 ** rng.uniform(*NEAR)))


def _just_held(rng: np.random.Generator) -> Iterator[tuple[GraspContacts, FloatArray]]:
    """Grasps of all families without end, each with the largest multiple of a load, as palpate itself finds it."""
    optimizers = dict[int, GraspForceOptimizer]()
    for family in cycle(FAMILIES):
        grasp, load = drawn(family, rng)
        if len(grasp) not in optimizers:
            optimizers[len(grasp)] = GraspForceOptimizer(grasp, "load_factor")
        optimizers[len(grasp)].update(grasp)
        most = optimizers[len(grasp)].solve(load, warm_start=False).objective
        if 1e-3 < most < 1e6:
            yield grasp, load * most


Family = Callable[[int, np.random.Generator], Iterator[Claimed]]
"""Draws about so many."""

CLAIMED: dict[str, tuple[Family, float]] = {
    "hard": (hard, 0.36),
    "1e-90 to 1e300 N": (scaled, 0.2),
    "preload / load 1 to 1e15": (preloaded, 0.2),
    "moving, warm": (moving, 0.2),
    "at the boundary": (boundary, 0.04),
}
"""What is tried, and its share."""
