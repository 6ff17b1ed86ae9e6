"""How well shapes are fitted and told apart, and how fast points are compared with a mesh.

    python benchmarks/fits.py [--quick]

200 contacts along a path; position noise 0.03 mm correlated over 1 mm of path, normals 0.5 degrees (model choice:
0.01 to 0.1 mm, sizes 5 to 100 mm). The comparison with trimesh needs rtree, which palpate does not, and is in
millimetres: in metres trimesh's triangle routine is off by 0.17 mm on these small triangles.
"""

import argparse
import sys
import time
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import trimesh
from rich.console import Console
from rich.progress import track
from rich.table import Table

from palpate.mapping.compare_surface import TriangleSurface
from palpate.mapping.primitives import PrimitiveKind, choose_primitive, fit_primitive

sys.path.append(str(Path(__file__).resolve().parents[1] / "tests"))
from mapping.felt_shapes import ANSWER, NORMAL_SD, ellipsoid, felt, random_case, sphere

SEMI_AXES = np.array([0.025, 0.020, 0.015])


def caps(runs: int) -> Table:
    table = Table(title=f"Errors of sizes on caps, mm (RMS and median of {runs} runs)")
    for heading in ("half-angle", "sphere R 20: RMS", "median", "ellipsoid 25 20 15: RMS", "median"):
        table.add_column(heading, justify="right")
    for degrees in track((90.0, 45.0, 25.0, 15.0), "caps", transient=True):
        ball, egg = [], []
        for seed in range(runs):
            rng = np.random.default_rng(seed)
            cloud, c = felt(*sphere(0.02, np.radians(degrees)), rng, 3e-5, NORMAL_SD)
            ball.append(
                1e3 * abs(fit_primitive(cloud, PrimitiveKind.SPHERE, correlation_points=c).shape.radius - 0.02)
            )
            cloud, c = felt(*ellipsoid(SEMI_AXES, np.radians(degrees)), rng, 3e-5, NORMAL_SD)
            off = fit_primitive(cloud, PrimitiveKind.ELLIPSOID, correlation_points=c).shape.semi_axes - SEMI_AXES
            egg.append(1e3 * float(np.abs(off).mean()))
        row = [f"{np.sqrt(np.mean(np.square(e))):.3f}|{np.median(e):.3f}" for e in (ball, egg)]
        table.add_row(f"{degrees:g}", *row[0].split("|"), *row[1].split("|"))
    return table


def choices(runs: int) -> Table:
    table = Table(title=f"Model choice, {runs} random cases each")
    for heading in ("shape", "expected", "right", "ms, median"):
        table.add_column(heading, justify="right")
    for kind, expected in track(ANSWER.items(), "choosing", total=len(ANSWER), transient=True):
        right, taken = 0, []
        for seed in range(runs):
            case = random_case(kind, np.random.default_rng([seed, sum(map(ord, kind))]))
            started = time.perf_counter()
            found = choose_primitive(case.cloud, correlation_points=case.correlation_points)
            taken.append(time.perf_counter() - started)
            right += (None if found.kind is None else found.kind.value) == expected
        table.add_row(kind, str(expected), f"{100.0 * right / runs:.1f} %", f"{1e3 * np.median(taken):.0f}")
    return table


def comparison() -> Table:
    mesh = trimesh.creation.icosphere(subdivisions=6, radius=20.0)
    rng = np.random.default_rng(0)
    points = rng.normal(size=(10_000, 3))
    points *= (20.0 + 0.1 * rng.normal(size=(10_000, 1))) / np.linalg.norm(points, axis=1, keepdims=True)
    surface = TriangleSurface(mesh.vertices, mesh.faces)
    surface.nearest(points[:10])  # compiled once
    started = time.perf_counter()
    surface = TriangleSurface(mesh.vertices, mesh.faces)
    built = time.perf_counter()
    distance = np.abs(surface.nearest(points).distance)
    asked = time.perf_counter()
    table = Table(title=f"10 000 points against {len(mesh.faces)} triangles")
    for heading in ("", "seconds", "largest difference, mm"):
        table.add_column(heading, justify="right")
    table.add_row("palpate, preparing the mesh", f"{built - started:.2f}", "")
    table.add_row("palpate, distances", f"{asked - built:.2f}", "")
    if find_spec("rtree") is None:
        table.add_row("trimesh closest_point", "needs rtree", "")
        return table
    started = time.perf_counter()
    other = trimesh.proximity.closest_point(mesh, points)[1]
    row = f"{time.perf_counter() - started:.2f}", f"{np.abs(other - distance).max():.1e}"
    table.add_row("trimesh closest_point", *row)
    return table


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="a tenth of the cases")
    quick = parser.parse_args().quick
    console = Console(width=110)
    console.print(caps(10 if quick else 40))
    console.print(comparison())
    console.print(choices(20 if quick else 200))


if __name__ == "__main__":
    main()
