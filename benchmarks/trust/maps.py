"""Surface maps, as `SurfaceMap.learned` makes them of contacts.

Twenty smooth height fields are felt in rows 1 mm apart, with noise of 0.03 mm and 0.5 degrees that keeps over 1 mm
of path, as maps assume it; each seed takes the next one. A map with verdict OK is silently wrong if more than
1 % of places away from its rim lie beyond 4 standard deviations. Violations: contacts 1 mm off, single or
together, and detail finer than the rows, which lie 2 mm apart then.
"""

import dataclasses
from collections.abc import Callable
from functools import partial

import numpy as np
from surface_shapes import STEP, Noise, Shape, felt
from trust.study import Case, Run, Study, first_finding

from palpate.errors import FloatArray
from palpate.mapping import MapSettings, SurfaceMap, TouchCloud

Height = Callable[[FloatArray, FloatArray], FloatArray]
"""Height over coordinates, both in millimetres; analytic, because slopes are taken along the imaginary axis."""

SMOOTH: dict[str, Height] = {
    "plane": lambda x, y: 0.0 * x,
    "ramp": lambda x, y: 0.1 * x - 0.2 * y,
    "wave 20 30": lambda x, y: np.sin(x / 20) * np.cos(y / 30),
    "wave 10 15": lambda x, y: np.sin(x / 10) * np.cos(y / 15),
    "wave 8 8": lambda x, y: 0.5 * np.sin(x / 8 + 1) * np.sin(y / 8),
    "wave along": lambda x, y: np.sin(x / 6),
    "wave across": lambda x, y: np.sin(y / 6),
    "wave askew": lambda x, y: np.sin((x + 2 * y) / 14),
    "bowl": lambda x, y: (x * x + y * y) / 160,
    "dome": lambda x, y: -(x * x + y * y) / 80,
    "saddle": lambda x, y: x * y / 60,
    "trough": lambda x, y: x * x / 80,
    "ridge": lambda x, y: -y * y / 50,
    "cubic": lambda x, y: (x**3 - 3 * x * y * y) / 4e3,
    "hill": lambda x, y: 2 * np.exp(-(x * x + y * y) / 128),
    "two hills": lambda x, y: np.exp(-((x - 8) ** 2 + y * y) / 72) + np.exp(-((x + 8) ** 2 + y * y) / 50),
    "dent": lambda x, y: x * x / 100 - np.exp(-((x - 3) ** 2 + (y - 2) ** 2) / 32),
    "sphere": lambda x, y: np.sqrt(90.0**2 - x * x - y * y),
    "beats": lambda x, y: 0.3 * np.sin(x / 4) * np.sin(x / 30) + y * y / 200,
    "chirp": lambda x, y: 0.5 * np.sin((x / 20 + 3) ** 2 / 2),
}

FINE: dict[str, Height] = {
    "sine of 6 mm, 0.1 mm": lambda x, y: 0.1 * np.sin(2 * np.pi * y / 6 + 0.3),
    "sine of 6 mm, 0.03 mm": lambda x, y: 0.03 * np.sin(2 * np.pi * y / 6 + 0.3),
    "ridge of 0.5 mm": lambda x, y: 0.2 * np.exp(-2.0 * (y - 0.7) ** 2),
    "texture of 2.5 mm, 0.03 mm": lambda x, y: 0.03 * np.sin(2 * np.pi * y / 2.5) * np.sin(2 * np.pi * x / 2.5),
    "texture of 2.5 mm, 0.01 mm": lambda x, y: 0.01 * np.sin(2 * np.pi * y / 2.5) * np.sin(2 * np.pi * x / 2.5),
}

QUIET = Noise(noise=1e-6, tilt=2e-3)
"""Noise of a simulated sensor."""

ASSUMED = Noise()
"""Noise as maps assume it."""

PLACES = 0.01
"""Share of places that may lie further off than 4 standard deviations."""

TWO_SIDED = 1.959964

SAMPLES = 600
"""Places at which a map is queried."""


def shape_of(name: str, height: Height, contacts: int, rows: float) -> Shape:
    """Return a square that so many contacts cover."""
    half = 0.5 * float(np.sqrt(contacts * STEP * rows))
    tiny = 1e-20

    def surface(u: FloatArray, v: FloatArray) -> tuple[FloatArray, FloatArray]:
        x, y = 1e3 * u + 0j, 1e3 * v + 0j
        slopes = [np.imag(height(x + 1j * tiny, y)) / tiny, np.imag(height(x, y + 1j * tiny)) / tiny]
        normal = np.column_stack([-slopes[0], -slopes[1], np.ones_like(u)])
        z = 1e-3 * np.real(height(x, y))
        return np.column_stack([u, v, z]), normal / np.linalg.norm(normal, axis=1, keepdims=True)

    return Shape(name, surface, (-half, half), (-half, half))


def with_outliers(cloud: TouchCloud, rng: np.random.Generator, together: int) -> TouchCloud:
    """Return a cloud of which one contact in a hundred is 1 mm off, so many together."""
    first = rng.choice(len(cloud) - together, len(cloud) // (100 * together), replace=False)
    bad = np.unique(np.add.outer(first, np.arange(together)))
    position = cloud.position.copy()
    position[bad] += 1e-3 * rng.choice([-1.0, 1.0]) * cloud.normal[bad]
    return dataclasses.replace(cloud, position=position)


def mapped(shape: Shape, seed: int, rows: float = 1e-3, errors: Noise = ASSUMED, outliers: int = 0) -> Run:
    """Map the shape once, and ask at places away from its rim."""
    rng = np.random.default_rng(seed)
    cloud = felt(*shape.surface(*shape.rows(rows)), errors, rng)
    if outliers:
        cloud = with_outliers(cloud, rng, outliers)
    made = SurfaceMap.learned(cloud, MapSettings.for_rows(rows))
    found = made.query(shape.samples(SAMPLES, rng)[0])
    z = np.abs(found.distance[found.observed]) / found.band()[found.observed] * TWO_SIDED
    furthest = float(np.quantile(z, 1.0 - PLACES))
    return Run(made.verdict.ok, furthest, {"map": float((z <= TWO_SIDED).mean())}, first_finding(made.verdict))


def smooth(contacts: int, seed: int) -> Run:
    """Map one of the smooth fields."""
    name, height = list(SMOOTH.items())[seed % len(SMOOTH)]
    return mapped(shape_of(name, height, contacts, 1e-3), seed)


def fine(name: str, errors: Noise, seed: int) -> Run:
    """Map what is finer than the rows."""
    return mapped(shape_of(name, FINE[name], 7200, 2e-3), seed, 2e-3, errors)


def off(together: int, seed: int) -> Run:
    """Map a dome of which single contacts are off."""
    return mapped(shape_of("dome", SMOOTH["dome"], 4400, 1e-3), seed, outliers=together)


STUDY = Study(
    "map",
    (
        Case("twenty smooth surfaces, 1e3 contacts", partial(smooth, 1000), holds=True),
        *(
            Case(
                f"twenty smooth surfaces, {contacts} contacts", partial(smooth, round(float(contacts))), True, 0.1
            )
            for contacts in ("1e4", "1e5", "3e5")
        ),
        *(
            Case(f"{name}, {label}", partial(fine, name, errors), weight=0.05)
            for name in FINE
            for label, errors in (("noise as assumed", ASSUMED), ("without noise", QUIET))
        ),
        *(
            Case(f"1 % of contacts 1 mm off, {together} together", partial(off, together), weight=0.05)
            for together in (1, 3, 10)
        ),
    ),
)
