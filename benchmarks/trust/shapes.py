"""Named shapes, as an exploration fits and chooses them.

200 contacts along a path over a shape of 20 to 60 mm that lies anywhere: noise of 0.03 mm that keeps over 1 mm of
path, normals of 0.5 degrees, a tip whose size is known to 0.05 mm, and, where coverage counts, smooth errors of
0.02 mm each. Place, direction and sizes of the shape are compared with their intervals; where shapes are chosen,
another one than the true one is silently wrong, too. Each seed of a violation takes the next kind of shape.
"""

import itertools
import math
import sys
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation
from trust.study import Case, Run, Study, first_finding

sys.path.append(str(Path(__file__).resolve().parents[2] / "tests"))
from mapping import felt_shapes
from mapping.felt_shapes import NORMAL_SD, cloud_at, correlated, evenly, meander
from palpate.errors import FloatArray, InvalidValueError
from palpate.mapping.primitives import BoxShape, PrimitiveFit, PrimitiveKind, choose_primitive, fit_primitive
from palpate.mapping.primitives.fit import TIP_SIZE_SD
from palpate.mapping.primitives.fit_checks import SmoothErrors

NOISE, ALIKE = 3e-5, 1e-3
TWO_SIDED = 1.959964
TIP = 8e-3
"""Radius of the fingertip."""

Rng = np.random.Generator
Path2 = tuple[FloatArray, FloatArray]
Change = Callable[[Rng, FloatArray, FloatArray], Path2]
"""Change of the points and normals."""

SIZES: dict[PrimitiveKind, tuple[float, ...]] = {
    PrimitiveKind.PLANE: (),
    PrimitiveKind.SPHERE: (0.02,),
    PrimitiveKind.CYLINDER: (0.02,),
    PrimitiveKind.ELLIPSOID: (0.03, 0.02, 0.015),
    PrimitiveKind.BOX: (0.03, 0.02, 0.015, 0.003),
    PrimitiveKind.TORUS: (0.03, 0.012),
}
PATHS: dict[PrimitiveKind, Callable[[Rng], Path2]] = {
    PrimitiveKind.PLANE: lambda rng: felt_shapes.plane(rng, 0.04),
    PrimitiveKind.SPHERE: lambda rng: felt_shapes.sphere(0.02, math.radians(60.0)),
    PrimitiveKind.CYLINDER: lambda rng: felt_shapes.cylinder(0.02, math.radians(70.0), 0.05),
    PrimitiveKind.ELLIPSOID: lambda rng: felt_shapes.ellipsoid(SIZES[PrimitiveKind.ELLIPSOID], math.radians(90.0)),
    PrimitiveKind.BOX: lambda rng: felt_shapes.box([0.03, 0.02, 0.015], 0.003),
    PrimitiveKind.TORUS: lambda rng: felt_shapes.torus(0.03, 0.012, 0.6),
}


def patch(share: float) -> dict[PrimitiveKind, Callable[[Rng], Path2]]:
    """Return paths over a small part of the shapes: a share of their angles."""
    return PATHS | {
        PrimitiveKind.SPHERE: lambda rng: felt_shapes.sphere(0.02, math.radians(60.0) * share),
        PrimitiveKind.CYLINDER: lambda rng: felt_shapes.cylinder(0.02, math.radians(70.0) * share, 0.05 * share),
        PrimitiveKind.ELLIPSOID: lambda rng: felt_shapes.ellipsoid(
            SIZES[PrimitiveKind.ELLIPSOID], math.radians(90.0) * share
        ),
        PrimitiveKind.TORUS: lambda rng: torus_patch(share),
        PrimitiveKind.BOX: lambda rng: felt_shapes.box([0.03, 0.02, 0.015], 0.003, faces=2),
    }


def torus_patch(share: float) -> Path2:
    """Return a path over the top of a tube."""
    uv = (meander() - 0.5) * share * [0.6 * 2.0 * math.pi, math.radians(280.0)]
    a, b = uv.T
    normal = np.column_stack([np.sin(b) * np.cos(a), np.sin(b) * np.sin(a), np.cos(b)])
    return 0.03 * np.column_stack([np.cos(a), np.sin(a), np.zeros(len(a))]) + 0.012 * normal, normal


@dataclass(frozen=True)
class Felt:
    """What is done to the data.

    Attributes:
        change: Change of points and normals.
        smooth: Whether smooth errors of robot and object, as large as assumed, are added.
        paths: Paths over the shapes.
        offset: Error of the tip's size [m]; None: as assumed.
        alike: Correlation length of the noise [m]; 1 mm is assumed.
        chosen: Whether the shape is chosen, too, not only fitted.
        count: Number of contacts.
    """

    change: Change = lambda rng, p, n: (p, n)
    smooth: bool = False
    paths: dict[PrimitiveKind, Callable[[Rng], Path2]] | None = None
    offset: float | None = None
    alike: float = ALIKE
    chosen: bool = False
    count: int = 200


def outliers(count: int, size: float, rng: Rng, p: FloatArray, n: FloatArray) -> Path2:
    """Return contacts that are off along their normals."""
    bad = rng.choice(len(p), count, replace=False)
    p[bad] += size * rng.choice([-1.0, 1.0], count)[:, None] * n[bad]
    return p, n


def drifting(
    amount: FloatArray | Callable[[Rng, int], FloatArray], rng: Rng, p: FloatArray, n: FloatArray
) -> Path2:
    """Return contacts under a drift of the robot along a random direction, of a given course [m].

    The true place is the mean one.
    """
    along = rng.normal(size=3)
    shape = amount(rng, len(p)) if callable(amount) else np.interp(np.linspace(0, 1, len(p)), [0, 1], amount)
    return p + np.outer(shape - shape.mean(), along / np.linalg.norm(along)), n


def walk(size: float, rng: Rng, count: int) -> FloatArray:
    """Return a random walk of a given span [m]."""
    walked = np.cumsum(rng.normal(size=count))
    return np.asarray(size * walked / np.ptp(walked))


def texture(height: float, length: float, rng: Rng, p: FloatArray, n: FloatArray) -> Path2:
    """Return waves along all three axes of the base."""
    k, phase = 2.0 * math.pi / length, rng.uniform(0.0, 2.0 * math.pi, 3)
    wave = height * np.sin(k * p + phase).sum(axis=1)
    slope = height * k * np.cos(k * p + phase)
    return p + wave[:, None] * n, n - (slope - (slope * n).sum(axis=1, keepdims=True) * n)


def mounted(degrees: float, rng: Rng, p: FloatArray, n: FloatArray) -> Path2:
    """Return normals of a sensor that is mounted turned."""
    about = rng.normal(size=3)
    return p, Rotation.from_rotvec(math.radians(degrees) * about / np.linalg.norm(about)).apply(n)


def shifted_origin(amount: float, rng: Rng, p: FloatArray, n: FloatArray) -> Path2:
    """Return contacts of a sensor whose origin is so far off [m]: sideways on the tip, which is where it is."""
    along = rng.normal(size=3)
    along *= amount / TIP / np.linalg.norm(along)
    leaning = n + along - (n @ along)[:, None] * n
    leaning /= np.linalg.norm(leaning, axis=1, keepdims=True)
    return p + TIP * (n - leaning), leaning


def outward(degrees: float, rng: Rng, p: FloatArray, n: FloatArray) -> Path2:
    """Return normals that lean away from the middle of the points."""
    away = p - p.mean(axis=0)
    away -= (away * n).sum(axis=1, keepdims=True) * n
    return p, n + math.radians(degrees) * away / np.linalg.norm(away, axis=1).max()


def rows_apart(size: float, rng: Rng, p: FloatArray, n: FloatArray) -> Path2:
    """Return rows that are off as a whole, each by another amount."""
    row = np.arange(len(p)) * felt_shapes.ROWS // len(p)
    return p + size * rng.normal(size=felt_shapes.ROWS)[row][:, None] * n, n


def back_and_forth(size: float, rng: Rng, p: FloatArray, n: FloatArray) -> Path2:
    """Return contacts that lag behind along the path, forward and back [m]."""
    along = np.gradient(p, axis=0)
    return p - size * along / np.linalg.norm(along, axis=1, keepdims=True), n


def tails(rng: Rng, p: FloatArray, n: FloatArray) -> Path2:
    """Return noise with Student's distribution of two degrees of freedom."""
    return p + 2e-5 * rng.standard_t(2.0, len(p))[:, None] * n, n


def rough_normals(rng: Rng, p: FloatArray, n: FloatArray) -> Path2:
    """Return noise of normals that grows from contact to contact."""
    return p, n + np.linspace(0.0, 3.0, len(n))[:, None] * NORMAL_SD * rng.normal(size=n.shape)


def dented(depth: float, rng: Rng, p: FloatArray, n: FloatArray) -> Path2:
    """Return a dent of 5 mm."""
    away = p - p[rng.integers(len(p))]
    near = depth * np.exp(-0.5 * (away**2).sum(axis=1) / 5e-3**2)
    slope = near[:, None] * away / 5e-3**2
    return p - near[:, None] * n, n - (slope - (slope * n).sum(axis=1, keepdims=True) * n)


def felt(
    kind: PrimitiveKind, case: Felt, rng: Rng
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray, float]:
    """Return points, normals, where the shape is and how it is turned, and the correlation that is assumed."""
    position, normal, arc = evenly(*(case.paths or PATHS)[kind](rng), case.count)
    offset = rng.normal(0.0, TIP_SIZE_SD) if case.offset is None else case.offset
    R, c = felt_shapes.random_rotation(rng), rng.uniform(-0.5, 0.5, 3)
    smooth = SmoothErrors.of((position - position.mean(axis=0)) / np.ptp(position), normal, TIP_SIZE_SD)
    factors = smooth.sd * rng.normal(size=len(smooth.sd))
    off = smooth.functions[:, 1:] @ factors[1:] if case.smooth else 0.0
    position, normal = case.change(
        rng, (position + np.reshape(offset + off, (-1, 1)) * normal) @ R.T, normal @ R.T
    )
    position = position + c + correlated(arc, case.alike, NOISE, rng)
    normal = normal + NORMAL_SD * rng.normal(size=normal.shape)
    k = math.exp(-arc[-1] / (len(arc) - 1) / ALIKE)
    return position, normal / np.linalg.norm(normal, axis=1, keepdims=True), c, R, (1.0 + k) / (1.0 - k)


def deviations(fit: PrimitiveFit, kind: PrimitiveKind, c: FloatArray, R: FloatArray) -> FloatArray:
    """Return how far place, direction and sizes are off, each over its standard deviation."""
    shape, sizes = fit.shape, np.array(SIZES[kind])
    R = R[:, [2, 0, 1]] if kind is PrimitiveKind.CYLINDER else R  # it was felt along y
    if kind in (PrimitiveKind.BOX, PrimitiveKind.ELLIPSOID):  # its axes may be named otherwise
        overlap = np.abs(R.T @ shape.rotation)
        order = max(itertools.permutations(range(3)), key=lambda o: sum(overlap[a, i] for i, a in enumerate(o)))
        R, sizes = R[:, list(order)], np.append(sizes[list(order)], sizes[3:])
    else:  # only the third axis counts
        turn = np.cross(R[:, 2] * np.sign(R[:, 2] @ shape.rotation[:, 2]), shape.rotation[:, 2])
        R = Rotation.from_rotvec(-turn).as_matrix() @ shape.rotation
    R = R * np.sign((R * shape.rotation).sum(axis=0))
    turned = Rotation.from_matrix(R.T @ shape.rotation).as_rotvec()
    shift = shape.rotation.T @ (shape.center - c)
    if kind in (PrimitiveKind.PLANE, PrimitiveKind.CYLINDER):  # compared where its own center is
        shift = R.T @ (shape.center - c)
    off = np.concatenate([shift, turned, shape.sizes - sizes])
    sd = np.sqrt(fit.covariance.diagonal())
    counted = np.isfinite(sd) & (sd > 0.0)
    if isinstance(shape, BoxShape):  # rounding too small for the points, or ends that were not felt
        counted[9] = False
    return np.asarray(off[counted] / sd[counted])


def one(kind: PrimitiveKind, case: Felt, seed: int) -> Run:
    """Feel a shape once, and fit it or choose one for it."""
    rng = np.random.default_rng([seed, sum(map(ord, kind.value))])
    position, normal, c, R, alike = felt(kind, case, rng)
    try:
        cloud = cloud_at(position, normal)
        if case.chosen:
            choice = choose_primitive(cloud, correlation_points=alike)
            if choice.kind is not kind:
                furthest = 0.0 if choice.kind is None else math.inf
                return Run(choice.verdict.ok, furthest, {}, first_finding(choice.verdict))
            fit, verdict = choice.fits[kind], choice.verdict
        else:
            fit = fit_primitive(cloud, kind, correlation_points=alike)
            verdict = fit.verdict
    except InvalidValueError:
        return Run(ok=False, furthest=0.0, finding="refused")
    if not fit.exists:
        return Run(verdict.ok, math.inf, {}, first_finding(verdict))
    off = np.abs(deviations(fit, kind, c, R))
    return Run(verdict.ok, float(off.max()), {"all": float((off <= TWO_SIDED).mean())}, first_finding(verdict))


def case(name: str, *args: Any, **changes: Any) -> Case:
    """Return a kind of data, by what is done to them, on all shapes by turns."""
    done, kinds = Felt(*args, **changes), tuple(PrimitiveKind)
    return Case(name, lambda seed: one(kinds[seed % len(kinds)], done, seed))


STUDY = Study(
    "shape",
    (
        *(
            Case(
                f"as assumed, {kind.value}", lambda seed, kind=kind: one(kind, Felt(smooth=True), seed), holds=True
            )
            for kind in PrimitiveKind
        ),
        case("half of each shape", paths=patch(0.5)),
        case("a quarter of each shape", paths=patch(0.25)),
        case("an eighth of each shape", paths=patch(0.125)),
        case("25 contacts", count=25),
        case("the shape is chosen", chosen=True),
        case("the shape is chosen, half", chosen=True, paths=patch(0.5)),
        case("the shape is chosen, a quarter", chosen=True, paths=patch(0.25)),
        case("one contact 1 mm off", partial(outliers, 1, 1e-3)),
        case("3 % of contacts 0.3 mm off", partial(outliers, 6, 3e-4)),
        case("10 % of contacts 0.1 mm off", partial(outliers, 20, 1e-4)),
        case("noise with heavy tails", tails),
        case("normals ever noisier", rough_normals),
        case("drift of 0.05 mm", partial(drifting, np.array([0.0, 5e-5]))),
        case("drift of 0.2 mm", partial(drifting, np.array([0.0, 2e-4]))),
        case("drift of 1 mm", partial(drifting, np.array([0.0, 1e-3]))),
        case(
            "jump of 0.2 mm",
            partial(drifting, lambda rng, n: 2e-4 * (np.arange(n) >= rng.integers(n // 4, 3 * n // 4))),
        ),
        case("walk of 0.2 mm", partial(drifting, partial(walk, 2e-4))),
        case("texture of 2 mm, 0.01 mm", partial(texture, 1e-5, 2e-3)),
        case("texture of 2 mm, 0.05 mm", partial(texture, 5e-5, 2e-3)),
        case("texture of 8 mm, 0.02 mm", partial(texture, 2e-5, 8e-3)),
        case("texture of 8 mm, 0.1 mm", partial(texture, 1e-4, 8e-3)),
        case("tip 0.1 mm larger", offset=1e-4),
        case("tip 0.1 mm smaller", offset=-1e-4),
        case("sensor's origin off by 0.1 mm", partial(shifted_origin, 1e-4)),
        case("sensor's origin off by 0.5 mm", partial(shifted_origin, 5e-4)),
        case("sensor mounted 0.5 degrees off", partial(mounted, 0.5)),
        case("sensor mounted 2 degrees off", partial(mounted, 2.0)),
        case("normals lean outwards by 0.5 degrees", partial(outward, 0.5)),
        case("normals lean outwards by 2 degrees", partial(outward, 2.0)),
        case("rows off by 0.02 mm", partial(rows_apart, 2e-5)),
        case("rows off by 0.1 mm", partial(rows_apart, 1e-4)),
        case("noise alike over 5 mm", alike=5e-3),
        case("contacts lag by 0.2 mm", partial(back_and_forth, 2e-4)),
        case("waves of 40 mm, 0.02 mm", partial(texture, 2e-5, 4e-2)),
        case("waves of 40 mm, 0.1 mm", partial(texture, 1e-4, 4e-2)),
        case("a dent of 0.05 mm", partial(dented, 5e-5)),
        case("a dent of 0.3 mm", partial(dented, 3e-4)),
    ),
)
