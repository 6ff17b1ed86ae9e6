"""The sensor on the flange, as `palpate calibrate mounting` finds it.

Twelve poses of the flange, opposite ones in turn, of a Nano17 with 30 g and of a wrist sensor with 1.2 kg, each
the average of 500 readings, while the sensors warm up as simulated ones do. Compared are the three angles and the
mass.
"""

import math
from collections.abc import Callable

import numpy as np
from scipy.spatial.transform import Rotation
from trust.study import Case, Run, Study, first_finding

from palpate.errors import InvalidValueError
from palpate.sensing.ft import identify_mounting, specific_force_from_rotations
from palpate.sim.sensor.model import SensorModel
from palpate.sim.sensor.presets import WARM_UP, axia80, nano17

CARRIED = {"nano17": (0.030, (0.0005, 0.001, 0.018)), "wrist": (1.2, (0.005, -0.012, 0.045))}
"""Mass [kg] and centre [m]."""

MODELS: dict[str, SensorModel] = {"nano17": nano17(), "wrist": axia80()}
POSES, AVERAGED, EVERY = 12, 500, 15.0
"""Poses, readings of each, and seconds between two."""

SQUARE = math.radians(0.5)
"""An OK angle further off than that is wrong however wide its interval."""

Change = Callable[[np.random.Generator, np.ndarray, SensorModel], np.ndarray]
"""Change of the readings, shape (n, 6)."""


def same(rng: np.random.Generator, shown: np.ndarray, model: SensorModel) -> np.ndarray:
    """Return all as assumed."""
    return shown


def axes(order: list[int], signs: list[float]) -> Change:
    """Return wrenches in another order, with other signs."""
    return lambda rng, shown, model: shown[:, order] * signs


def cross_talk(share: float) -> Change:
    """Return a sensor whose axes show up to a share of one another's full load."""

    def change(rng: np.random.Generator, shown: np.ndarray, model: SensorModel) -> np.ndarray:
        rated = np.array(model.rated)
        return shown + rated * ((shown / rated) @ rng.uniform(-share, share, (6, 6)))

    return change


def touched(rng: np.random.Generator, shown: np.ndarray, model: SensorModel) -> np.ndarray:
    """One pose touches something."""
    shown[rng.integers(len(shown))] += 0.05 * rng.normal(size=6) * np.abs(shown).max(axis=0)
    return shown


def found(seed: int, name: str, change: Change) -> Run:
    """Find it once."""
    rng = np.random.default_rng((seed, 7))
    model, (mass, center) = MODELS[name], CARRIED[name]
    turn, half = Rotation.random(rng=rng), Rotation.random(POSES // 2, rng=rng)
    over = Rotation.from_rotvec([np.pi, 0.0, 0.0])
    a = specific_force_from_rotations(
        Rotation.concatenate([r for each in half for r in (each, each * over)]).inv().as_matrix()
    )
    force = -mass * turn.apply(a)
    warmth = 1.0 - np.exp(-(rng.uniform(0.0, 600.0) + EVERY * np.arange(POSES)) / WARM_UP.time_constant)
    zero = WARM_UP.rise * np.outer(warmth, model.thermal_drift.per_kelvin) if model.thermal_drift else 0.0
    sd = np.array(model.noise_sd) / math.sqrt(AVERAGED)
    exact = change(rng, np.hstack([force, np.cross(center, force)]), model)
    shown = exact + zero + 0.1 * np.array(model.rated) * rng.normal(size=6) + sd * rng.normal(size=(POSES, 6))
    try:
        result = identify_mounting(a, shown, force_sd=sd[:3].max(), moment_sd=sd[3:].max())
    except InvalidValueError:
        return Run(ok=False, furthest=0.0, finding="refused")
    off = (turn * Rotation.from_matrix(result.rotation_flange_sensor)).as_rotvec()
    z = np.abs(off) / result.rotation_sd
    z_mass = abs(result.payload.payload.mass - mass) / result.payload.mass_sd
    far = math.inf if np.linalg.norm(off) > SQUARE else max(float(z.max()), z_mass)
    inside = {"angles": float((z <= 1.96).mean()), "mass": float(z_mass <= 1.96)}
    return Run(result.verdict.ok, far, inside, first_finding(result.verdict))


def case(name: str, change: Change = same, *, holds: bool = False) -> Case:
    """Return a kind of data."""
    model = name.partition(": ")[0]
    return Case(name, lambda seed: found(seed, model, change), holds)


STUDY = Study(
    "mounting",
    tuple(
        each
        for name in MODELS
        for each in (
            case(f"{name}: as assumed", holds=True),
            case(f"{name}: x and y swapped", axes([1, 0, 2, 4, 3, 5], [1.0] * 6)),
            case(f"{name}: x and y of forces swapped", axes([1, 0, 2, 3, 4, 5], [1.0] * 6)),
            case(f"{name}: z mirrored", axes([0, 1, 2, 3, 4, 5], [1.0, 1.0, -1.0, 1.0, 1.0, -1.0])),
            case(f"{name}: moments turned round", axes([0, 1, 2, 4, 5, 3], [1.0] * 6)),
            case(f"{name}: the opposite wrench", axes([0, 1, 2, 3, 4, 5], [-1.0] * 6)),
            case(f"{name}: gain of x 2 % off", axes([0, 1, 2, 3, 4, 5], [1.02, 1.0, 1.0, 1.0, 1.0, 1.0])),
            case(f"{name}: cross-talk of 1 %", cross_talk(0.01)),
            case(f"{name}: one pose touches", touched),
        )
    ),
)
