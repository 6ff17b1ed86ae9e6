"""Whether built contacts are found again, and whether reported condition numbers are true.

    python benchmarks/contact_solutions.py [--exact 1000000] [--only WORD]

Two parts, a line per case. *exact*: contacts built on meshes and symbolic tips, with a normal force from 1e-3 of
the tangential one on and any spin, are found again; printed are those missed, ambiguous, and wrong beyond 1e-12
times the condition. *condition*: reported condition number over the true amplification of relative errors of force
and moment, by differences of the solver. For 1e7 exact contacts: --only exact --exact 10000000 (five minutes).
"""

import argparse
import sys
from collections.abc import Iterator

import casadi
import numpy as np
import trimesh

from palpate import (
    Capsule,
    CompliantTip,
    ContactStatus,
    Cylinder,
    Ellipsoid,
    Plane,
    RoundedBox,
    Sphere,
    Superellipsoid,
    contacts_from_wrenches,
)
from palpate.errors import FloatArray
from palpate.sensing.solver import Surface
from palpate.surfaces.mesh import MeshSurface
from palpate.surfaces.symbolic import SymbolicSurface

R = 0.01
"""Size of the tips, about [m]."""

EXACT = 1e-12
"""Largest relative error of a contact's place over its condition."""

Rng = np.random.Generator


def directions(rng: Rng, n: int) -> FloatArray:
    """Return unit vectors (n, 3)."""
    v = rng.normal(size=(n, 3))
    return np.asarray(v / np.linalg.norm(v, axis=1, keepdims=True))


def wrenches_at(
    c: FloatArray, n: FloatArray, push: FloatArray, slope: FloatArray, spin: FloatArray, rng: Rng
) -> FloatArray:
    """Return the wrenches (n, 6) of contacts with tangential over normal force `slope`."""
    across = np.cross(n, directions(rng, len(n)))
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    f = push[:, None] * (slope[:, None] * across - n)
    return np.hstack([f, np.cross(c, f) + spin[:, None] * n])


# ------------------------------------------------------------------------------------------------------- exact


def irregular(points: int, axes: tuple[float, float, float], power: float, seed: int) -> MeshSurface:
    """Return the hull of random points of a superellipsoid: facets of any shape."""
    v = directions(np.random.default_rng(seed), points)
    v /= (np.abs(v) ** power).sum(axis=1, keepdims=True) ** (1.0 / power)
    hull = trimesh.convex.convex_hull(v * np.array(axes) / R)
    return MeshSurface(np.asarray(hull.vertices) * R, np.asarray(hull.faces))


def meshes() -> Iterator[tuple[str, MeshSurface]]:
    """Yield meshes, most of them irregular."""
    ball = trimesh.creation.icosphere(subdivisions=3, radius=1.0)
    yield "icosphere of 1280", MeshSurface(np.asarray(ball.vertices) * R, np.asarray(ball.faces))
    yield "irregular ellipsoid of 596", irregular(300, (0.008, 0.01, 0.012), 2.0, 5)
    yield "irregular ellipsoid of 2996", irregular(1500, (0.01, 0.009, 0.012), 2.0, 6)
    yield "irregular, slender, of 796", irregular(400, (0.004, 0.01, 0.014), 2.0, 7)
    yield "irregular, edged, of 796", irregular(400, (0.01, 0.01, 0.01), 4.0, 8)


POINT = casadi.SX.sym("point", 3)


def symbolic() -> Iterator[tuple[str, SymbolicSurface]]:
    """Yield convex symbolic tips."""
    x, y, z = POINT[0] / R, POINT[1] / R, POINT[2] / R
    soft_edges = directions(np.random.default_rng(7), 16)
    soft_edges = np.vstack([soft_edges, np.eye(3), -np.eye(3)])
    total = sum(casadi.exp(6.0 * (a[0] * x + a[1] * y + a[2] * z)) for a in soft_edges.tolist())
    yield "symbolic egg", SymbolicSurface(POINT, (x**2 + y**2) / (1.0 + 0.3 * z) + 0.8 * z**2 - 1.0)
    yield (
        "symbolic quartic",
        SymbolicSurface(POINT, x**4 + 0.5 * y**4 + 2 * z**4 + 0.3 * (x**2 + y**2 + z**2) - 1.0),
    )
    yield "symbolic pebble", SymbolicSurface(POINT, casadi.log(total / len(soft_edges)) - 4.0)
    yield (
        "symbolic sum of cosh",
        SymbolicSurface(POINT, casadi.cosh(1.5 * x) + casadi.cosh(y) + casadi.cosh(2 * z) - 4.5),
    )


def points_on(tip: Surface, rng: Rng, n: int) -> tuple[FloatArray, FloatArray]:
    """Return points of a mesh or a symbolic tip, and its normals there."""
    if isinstance(tip, MeshSurface):
        assert tip.normals is not None
        corners, weights = tip.triangles[rng.integers(0, len(tip.triangles), n)], rng.dirichlet([1, 1, 1], n)
        c, normal = (np.einsum("ni,nij->nj", weights, each[corners]) for each in (tip.vertices, tip.normals))
        return c, normal / np.linalg.norm(normal, axis=1, keepdims=True)
    assert isinstance(tip, SymbolicSurface)
    function = casadi.Function("tip", [POINT], [tip.value, casadi.gradient(tip.value, POINT)]).map(n)
    v = directions(rng, n)
    inside, outside = np.zeros(n), np.full(n, 2.5 * R)
    for _ in range(70):
        middle = 0.5 * (inside + outside)
        beyond = np.asarray(function((middle[:, None] * v).T)[0]).ravel() > 0.0
        inside, outside = np.where(beyond, inside, middle), np.where(beyond, middle, outside)
    c = inside[:, None] * v
    normal = np.asarray(function(c.T)[1]).T
    return c, normal / np.linalg.norm(normal, axis=1, keepdims=True)


def spins(rng: Rng, n: int, label: str) -> tuple[FloatArray, FloatArray]:
    """Return tangential over normal force, and spin torque over normal force [m]."""
    signs = R * rng.choice([-1.0, 1.0], n)
    return {
        "usual": (10 ** rng.uniform(-1, 0.3, n), signs * 10 ** rng.uniform(-3, -0.5, n)),
        "no spin, mu 2": (np.full(n, 2.0), np.zeros(n)),
        "no spin, grazing": (10 ** rng.uniform(0, 3, n), np.zeros(n)),
        "spin, grazing": (10 ** rng.uniform(-1, 3, n), signs * 10 ** rng.uniform(-6, 0.5, n)),
        "far spin, grazing": (10 ** rng.uniform(0, 3, n), signs * 10 ** rng.uniform(0, 4, n)),
    }[label]


SPINS = ("usual", "no spin, mu 2", "no spin, grazing", "spin, grazing", "far spin, grazing")


def exact(count: int, only: str) -> int:
    """Build contacts and find them again; returns how many were missed or wrong."""
    bad = 0
    tips = [each for each in (*meshes(), *symbolic()) if only in f"exact {each[0]}"]
    each = max(1, count // max(1, len(tips) * len(SPINS)))
    for name, tip in tips:
        for number, label in enumerate(SPINS):
            missed = ambiguous = wrong = 0
            worst = 0.0
            rng = np.random.default_rng(number)
            for start in range(0, each, 20_000):
                n = min(20_000, each - start)
                c, normal = points_on(tip, rng, n)
                slope, spin = spins(rng, n, label)
                found = contacts_from_wrenches(tip, wrenches_at(c, normal, np.ones(n), slope, spin, rng))
                ok = found.status == ContactStatus.OK
                error = np.linalg.norm(found.centroid - c, axis=1) / np.linalg.norm(c, axis=1)
                error /= np.maximum(found.condition, 1.0)
                ambiguous += int((found.status == ContactStatus.AMBIGUOUS).sum())
                missed += int((~ok & (found.status != ContactStatus.AMBIGUOUS)).sum())
                wrong += int((ok & ~(error <= EXACT)).sum())
                worst = max(worst, float(error[ok].max(initial=0.0)))
            bad += missed + wrong
            print(
                f"exact {name:28s} {label:18s} {each:8d}: missed {missed}, wrong {wrong} (largest error "
                f"{worst:.0e} x condition), ambiguous {100.0 * ambiguous / each:.3g} %",
                flush=True,
            )
    return bad


# --------------------------------------------------------------------------------------------------- condition


def amplification(
    tip: Surface, wrench: FloatArray, centroid: FloatArray, center: FloatArray, step: float
) -> float:
    """Return the largest relative change of the centroid over that of force and moment, which is the same.

    Central differences of the solver give the derivatives; the largest change that a force and a moment wrong by
    their own share can make is searched over directions.
    """
    f, m = wrench[:3], wrench[3:] - np.cross(center, wrench[:3])
    sizes = np.linalg.norm(f), np.linalg.norm(m)
    steps = np.zeros((6, 6))
    for k in range(6):
        steps[k, k] = step * (sizes[0] if k < 3 else max(sizes[1], 1e-3 * sizes[0] * R))
        if k < 3:
            steps[k, 3:] = np.cross(center, steps[k, :3])
    ahead, behind = (contacts_from_wrenches(tip, wrench + sign * steps) for sign in (1.0, -1.0))
    if (ahead.status != 0).any() or (behind.status != 0).any():
        return np.nan
    J = (ahead.centroid - behind.centroid).T / (2.0 * np.diag(steps))
    u, rng = np.vstack([directions(np.random.default_rng(0), 300), np.eye(3)]), np.random.default_rng(1)
    for turn in 0.3 * 0.5 ** np.arange(8):
        size = sizes[0] * np.linalg.norm(u @ J[:, :3], axis=1) + sizes[1] * np.linalg.norm(u @ J[:, 3:], axis=1)
        best = u[np.argmax(size)]
        u = np.vstack([best, best + turn * rng.normal(size=(100, 3))])
        u /= np.linalg.norm(u, axis=1, keepdims=True)
    return float(size.max() / np.linalg.norm(centroid - center))


def tips() -> Iterator[tuple[str, Surface]]:
    """Yield a tip of every kind."""
    center = np.array([0.003, -0.004, 0.02])
    yield "sphere", Sphere(R, center=center)
    yield "ellipsoid 3:10:30", Ellipsoid((0.003, 0.01, 0.03), center=center)
    yield "cylinder", Cylinder(R, center=center)
    yield "plane", Plane(R, center=center)
    yield "capsule", Capsule(0.008, 0.02, center)
    yield "rounded box", RoundedBox((0.009, 0.012, 0.007), 0.002, center)
    super_tip = Superellipsoid((0.009, 0.009, 0.008), 2.5, center=center)
    yield "superellipsoid", super_tip
    yield "compliant sphere", CompliantTip(Sphere(R, center=center), 2e3)
    yield "compliant, Hertz", CompliantTip(Sphere(R, center=center), 5e4, 2.0 / 3.0)
    yield "compliant superellipsoid", CompliantTip(super_tip, 4e4)
    yield from ((name, tip) for name, tip in symbolic() if name == "symbolic pebble")
    yield from ((name, tip) for name, tip in meshes() if "596" in name)


def conditions(only: str) -> int:
    """Compare conditions with amplifications; returns how many kinds are beyond a factor of 2."""
    bad = 0
    for name, tip in tips():
        if only not in f"condition {name}":
            continue
        rng, ratios = np.random.default_rng(2), []
        center = tip.centers[-1] if hasattr(tip, "centers") else tip.center
        pushes = directions(rng, 400)
        if isinstance(tip, (Cylinder, Capsule)):
            pushes[:, 2] = np.abs(pushes[:, 2]) * isinstance(tip, Capsule)
        if isinstance(tip, Plane):
            pushes = np.tile([0.0, 0.0, -1.0], (400, 1))
        # points of the tip: where a force through its center is felt
        felt = contacts_from_wrenches(tip, np.hstack([-pushes, np.cross(center, -pushes)]))
        for slope in (1.0, 10.0, 1000.0):
            at = np.flatnonzero(felt.status == 0)[:100]
            c, n = felt.centroid[at], felt.normal[at]
            spin = 10 ** rng.uniform(-5, 0.3, len(at)) * R * rng.choice([0, 1, -1], len(at))
            wrenches = wrenches_at(c, n, np.ones(len(at)), np.full(len(at), slope), spin, rng)
            found = contacts_from_wrenches(tip, wrenches)
            for i in np.flatnonzero(found.status == 0):
                step = 1e-6 / max(found.condition[i], 10.0)
                true = amplification(tip, wrenches[i], found.centroid[i], center, step)
                ratios.append(found.condition[i] / true)
        low, high = np.nanmin(ratios), np.nanmax(ratios)
        bad += not 0.5 <= low <= high <= 2.0
        print(
            f"condition {name:24s} reported over true {low:.2f} to {high:.2f}, {len(ratios)} contacts", flush=True
        )
    return bad


def main() -> int:
    """Print a line per case; 1 if one does not hold."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--exact", type=int, default=1_000_000, help="contacts that are built, in all")
    parser.add_argument("--only", default="", help="lines that contain this")
    asked = parser.parse_args()
    bad = conditions(asked.only) + exact(asked.exact, asked.only)
    return int(bad > 0)


if __name__ == "__main__":
    sys.exit(main())
