"""A surface of flat facets, as of a mesh file: the map says how far it may be off between its rows.

A ball slides over the long sides of a polygonal prism, its contacts in closed form.
"""

import math
import sys
from pathlib import Path

import numpy as np
import pytest

from palpate.mapping import MapSettings, SurfaceMap, SurfaceModel

sys.path.append(str(Path(__file__).resolve().parents[2] / "benchmarks"))

from surface_shapes import STEP, Noise, felt

RADIUS, TIP = 0.025, 0.008  # of the polygon's corners and of the ball [m]
HALF_LENGTH, HALF_DEPTH = 0.010, 0.0075  # along the rows, across them [m]
ROWS = 2e-3
QUIET = Noise(noise=1e-6, tilt=2e-3)  # of a simulated sensor; 0.1 degrees


def touched(y, sides, turned):
    """Where a ball whose centre is at y (n,) touches the prism from above, and normals: (y, z), both (n, 2)."""
    step = 2.0 * math.pi / sides
    corner = turned + step * np.arange(-sides // 4, sides // 4 + 1)
    face = corner[:-1] + 0.5 * step
    at = RADIUS * np.column_stack([np.sin(corner), np.cos(corner)])
    # over a face the centre stays between its ends, moved out; beyond them the ball rolls over a corner
    begins, ends = (at[i : len(at) - 1 + i, 0] + TIP * np.sin(face) for i in (0, 1))
    i = np.searchsorted(begins, y) - 1
    over = y <= ends[i]
    angle = np.where(over, face[i], np.arcsin(np.clip((y - at[i + 1, 0]) / TIP, -1.0, 1.0)))
    share = (y - begins[i]) / (ends[i] - begins[i])
    point = np.where(over[:, None], at[i] + share[:, None] * (at[i + 1] - at[i]), at[i + 1])
    return point, np.column_stack([np.sin(angle), np.cos(angle)])


def prism(sides, turned, errors=QUIET, seed=0):
    """What is felt of the prism in rows along it."""
    x = np.arange(-HALF_LENGTH, HALF_LENGTH, STEP)
    rows = np.arange(-HALF_DEPTH, HALF_DEPTH + 0.5 * ROWS, ROWS)
    points, normals = [], []
    for row, y in enumerate(rows):
        point, normal = touched(np.full_like(x, y), sides, turned)
        points.append(np.column_stack([x[:: (-1) ** row], point]))
        normals.append(np.column_stack([np.zeros_like(x), normal]))
    return felt(np.concatenate(points), np.concatenate(normals), errors, np.random.default_rng(seed))


def inside(made, sides, turned, seed=1):
    """The share of true errors inside the band."""
    rng = np.random.default_rng(seed)
    half = HALF_DEPTH * RADIUS / (RADIUS + TIP)
    x, y = rng.uniform(-HALF_LENGTH, HALF_LENGTH, 600), rng.uniform(-half, half, 600)
    step = 2.0 * math.pi / sides
    face = turned + step * (np.arange(-sides // 4, sides // 4) + 0.5)
    depth = RADIUS * math.cos(0.5 * step)
    z = ((depth - y[:, None] * np.sin(face)) / np.cos(face)).min(axis=1)
    answer = made.query(np.column_stack([x, y, z]))
    assert answer.observed.mean() > 0.85
    return (np.abs(answer.distance) <= answer.band())[answer.observed].mean()


@pytest.mark.slow
@pytest.mark.parametrize(("sides", "turned", "seed"), [(64, 0.0, 0), (64, 0.4, 1), (96, 0.4, 0)])
def test_between_rows_over_facets_the_band_holds_the_facets(sides, turned, seed):
    turned *= 2.0 * math.pi / sides
    made = SurfaceMap.learned(prism(sides, turned, seed=seed), MapSettings.for_rows(ROWS, bias=2e-6))
    assert inside(made, sides, turned) >= 0.90
    # normals that a smooth surface cannot have are not taken for those of a noisy finger that heights follow
    assert made.facet_height > 1e-6


def test_noise_that_does_not_keep_along_rows_is_no_facet():
    model = SurfaceModel()
    assert SurfaceMap(MapSettings(model=model)).facet_height < 0.01 * model.noise


def test_facets_are_as_deep_as_rows_are_apart_and_normals_off():
    wide, narrow = (MapSettings.for_rows(rows, model=SurfaceModel(tilt_length=1.0)) for rows in (2e-3, 1.4e-3))
    assert SurfaceMap(wide).facet_height == pytest.approx(SurfaceMap(narrow).facet_height * 2.0 / 1.4, rel=1e-6)
    # ridges of a curve with slopes from -a to a: RMS of its depth by quadrature
    a, x = SurfaceModel().tilt * 3.0**0.5, np.linspace(-1.0, 1.0, 2001)
    depth = 2e-3 * a / 4.0 * (1.0 - x**2)
    # half as much more: that of a sine of three rows
    assert SurfaceMap(wide).facet_height == pytest.approx(1.5 * np.sqrt(np.mean(depth**2)), rel=0.03)
