"""The surface map's benchmark feels what it says it feels."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

BENCHMARKS = Path(__file__).resolve().parents[2] / "benchmarks"
sys.path.append(str(BENCHMARKS))

from surface_shapes import SHAPES, STEP, Noise, along_path, felt  # noqa: E402


@pytest.mark.parametrize("shape", SHAPES, ids=lambda shape: shape.name)
def test_normals_are_across_the_surface_and_contacts_a_step_apart(shape):
    u, v = shape.rows(4e-3)
    points, normals = shape.surface(u, v)
    np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1.0)
    steps = np.diff(points, axis=0)
    length = np.linalg.norm(steps, axis=1)
    along = length < 1.5 * STEP
    assert along.mean() > 0.99
    assert np.median(length) == pytest.approx(STEP, rel=0.01)
    assert np.abs((steps * normals[:-1]).sum(axis=1)[along]).max() < 0.02 * STEP


def test_noise_keeps_along_the_path_as_it_says():
    noise = along_path(np.full(200_000, STEP), 1e-3, np.random.default_rng(0))
    lag = round(1e-3 / STEP)
    assert noise.std() == pytest.approx(1.0, rel=0.03)
    assert (noise[lag:] * noise[:-lag]).mean() == pytest.approx(np.exp(-1.0), abs=0.04)


def test_without_errors_contacts_are_on_the_surface():
    points, normals = SHAPES[0].surface(*SHAPES[0].rows(4e-3))
    cloud = felt(points, normals, Noise(noise=0.0, tilt=0.0), np.random.default_rng(0))
    np.testing.assert_allclose(cloud.position, points)
    np.testing.assert_allclose(cloud.normal, normals)


@pytest.mark.slow
def test_the_quick_benchmark_runs_to_its_end(tmp_path):
    picture = tmp_path / "map.png"
    command = [sys.executable, str(BENCHMARKS / "surface_maps.py"), "cost", "--quick", "--picture", str(picture)]
    said = subprocess.run(command, check=True, capture_output=True, text=True, timeout=600).stdout
    assert "100 more ms" in said
    assert picture.read_bytes().startswith(b"\x89PNG")
