"""Whether the intervals of fitted shapes hold the truth, or the verdict warns.

    python benchmarks/trust/shapes.py [--seeds 60] [--each] [--only NAME]

200 contacts along a path over a shape of 20 to 60 mm that lies anywhere: noise of 0.03 mm that keeps over 1 mm of
path, normals of 0.5 degrees, a tip whose size is known to 0.05 mm, and, where coverage counts, smooth errors of
0.015 mm each. Place, direction and sizes of the shape are compared with their intervals. A fit is honest if its
verdict is OK and every value within 4 standard deviations, reported if the verdict is not OK (or the data are
refused), silently wrong else; where shapes are chosen, another one than the true one with verdict OK is silently
wrong, too.

Each seed of a violation takes the next kind of shape; --each makes a row of every kind.
Ends with 1 if anything is silently wrong in more than 1 % of the seeds, or if a coverage lies outside of 93 to
98 % where the assumptions hold. Set OPENBLAS_NUM_THREADS=1.
"""

import argparse
import itertools
import math
import sys
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.progress import track
from rich.table import Table
from scipy.spatial.transform import Rotation

sys.path.append(str(Path(__file__).resolve().parents[2] / "tests"))
from mapping import felt_shapes
from mapping.felt_shapes import NORMAL_SD, cloud_at, correlated, evenly, meander
from palpate.errors import FloatArray, InvalidValueError
from palpate.mapping.primitives import BoxShape, PrimitiveFit, PrimitiveKind, choose_primitive, fit_primitive
from palpate.mapping.primitives.fit import TIP_SIZE_SD
from palpate.mapping.primitives.fit_checks import SmoothErrors

NOISE, ALIKE = 3e-5, 1e-3
SILENT, WORST, COVERED, TWO_SIDED = 4.0, 0.01, (0.93, 0.98), 1.959964
TIP = 8e-3
"""Radius of the fingertip."""

MORE = 2
"""Times as many seeds where coverage counts."""

Rng = np.random.Generator
Path2 = tuple[FloatArray, FloatArray]
Change = Callable[[Rng, FloatArray, FloatArray], Path2]
"""Of points and normals as they are felt."""

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
class Case:
    """One kind of data.

    Attributes:
        name: Of the row.
        change: Of what is felt.
        holds: Whether the assumptions hold, so that coverage counts.
        paths: Over the shapes.
        offset: Of the tip's size [m]; None: within what is assumed.
        alike: Over what length noise is alike [m]; what is assumed is 1 mm.
        chosen: Whether the shape is chosen, too, not only fitted.
        count: Contacts.
    """

    name: str
    change: Change = lambda rng, p, n: (p, n)
    holds: bool = False
    paths: dict[PrimitiveKind, Callable[[Rng], Path2]] | None = None
    offset: float | None = None
    alike: float = ALIKE
    chosen: bool = False
    count: int = 200


def outliers(count: int, size: float) -> Change:
    """Return contacts that are off along their normals."""

    def change(rng: Rng, p: FloatArray, n: FloatArray) -> Path2:
        bad = rng.choice(len(p), count, replace=False)
        p[bad] += size * rng.choice([-1.0, 1.0], count)[:, None] * n[bad]
        return p, n

    return change


def drifting(amount: FloatArray | Callable[[Rng, int], FloatArray]) -> Change:
    """Return a drift of the robot along a random direction, of such shape over the contacts [m].

    The true place is the mean one.
    """

    def change(rng: Rng, p: FloatArray, n: FloatArray) -> Path2:
        along = rng.normal(size=3)
        shape = amount(rng, len(p)) if callable(amount) else np.interp(np.linspace(0, 1, len(p)), [0, 1], amount)
        return p + np.outer(shape - shape.mean(), along / np.linalg.norm(along)), n

    return change


def walk(size: float) -> Change:
    """Return a random walk of such a span [m]."""

    def path(rng: Rng, count: int) -> FloatArray:
        walked = np.cumsum(rng.normal(size=count))
        return np.asarray(size * walked / np.ptp(walked))

    return drifting(path)


def texture(height: float, length: float) -> Change:
    """Return waves along all three axes of the base."""

    def change(rng: Rng, p: FloatArray, n: FloatArray) -> Path2:
        k, phase = 2.0 * math.pi / length, rng.uniform(0.0, 2.0 * math.pi, 3)
        wave = height * np.sin(k * p + phase).sum(axis=1)
        slope = height * k * np.cos(k * p + phase)
        return p + wave[:, None] * n, n - (slope - (slope * n).sum(axis=1, keepdims=True) * n)

    return change


def mounted(degrees: float) -> Change:
    """Return normals of a sensor that is mounted turned."""

    def change(rng: Rng, p: FloatArray, n: FloatArray) -> Path2:
        about = rng.normal(size=3)
        return p, Rotation.from_rotvec(math.radians(degrees) * about / np.linalg.norm(about)).apply(n)

    return change


def shifted_origin(amount: float) -> Change:
    """Return contacts of a sensor whose origin is so far off [m]: sideways on the tip, which is where it is."""

    def change(rng: Rng, p: FloatArray, n: FloatArray) -> Path2:
        along = rng.normal(size=3)
        along *= amount / TIP / np.linalg.norm(along)
        leaning = n + along - (n @ along)[:, None] * n
        leaning /= np.linalg.norm(leaning, axis=1, keepdims=True)
        return p + TIP * (n - leaning), leaning

    return change


def outward(degrees: float) -> Change:
    """Return normals that lean away from the middle of the points."""

    def change(rng: Rng, p: FloatArray, n: FloatArray) -> Path2:
        away = p - p.mean(axis=0)
        away -= (away * n).sum(axis=1, keepdims=True) * n
        return p, n + math.radians(degrees) * away / np.linalg.norm(away, axis=1).max()

    return change


def rows_apart(size: float) -> Change:
    """Return rows that are off as a whole, each by another amount."""

    def change(rng: Rng, p: FloatArray, n: FloatArray) -> Path2:
        row = np.arange(len(p)) * felt_shapes.ROWS // len(p)
        return p + size * rng.normal(size=felt_shapes.ROWS)[row][:, None] * n, n

    return change


def back_and_forth(size: float) -> Change:
    """Return contacts that lag behind along the path, forward and back [m]."""

    def change(rng: Rng, p: FloatArray, n: FloatArray) -> Path2:
        along = np.gradient(p, axis=0)
        return p - size * along / np.linalg.norm(along, axis=1, keepdims=True), n

    return change


def tails(rng: Rng, p: FloatArray, n: FloatArray) -> Path2:
    """Return noise with Student's distribution of two degrees of freedom."""
    return p + 2e-5 * rng.standard_t(2.0, len(p))[:, None] * n, n


def rough_normals(rng: Rng, p: FloatArray, n: FloatArray) -> Path2:
    """Return noise of normals that grows from contact to contact."""
    return p, n + np.linspace(0.0, 3.0, len(n))[:, None] * NORMAL_SD * rng.normal(size=n.shape)


def dented(depth: float) -> Change:
    """Return a dent of 5 mm."""

    def change(rng: Rng, p: FloatArray, n: FloatArray) -> Path2:
        away = p - p[rng.integers(len(p))]
        near = depth * np.exp(-0.5 * (away**2).sum(axis=1) / 5e-3**2)
        slope = near[:, None] * away / 5e-3**2
        return p - near[:, None] * n, n - (slope - (slope * n).sum(axis=1, keepdims=True) * n)

    return change


CASES = (
    Case("nothing", holds=True),
    Case("half of each shape", paths=patch(0.5)),
    Case("a quarter of each shape", paths=patch(0.25)),
    Case("an eighth of each shape", paths=patch(0.125)),
    Case("25 contacts", count=25),
    Case("the shape is chosen", chosen=True),
    Case("the shape is chosen, half", chosen=True, paths=patch(0.5)),
    Case("the shape is chosen, a quarter", chosen=True, paths=patch(0.25)),
    Case("one contact 1 mm off", outliers(1, 1e-3)),
    Case("3 % of contacts 0.3 mm off", outliers(6, 3e-4)),
    Case("10 % of contacts 0.1 mm off", outliers(20, 1e-4)),
    Case("noise with heavy tails", tails),
    Case("normals ever noisier", rough_normals),
    Case("drift of 0.05 mm", drifting(np.array([0.0, 5e-5]))),
    Case("drift of 0.2 mm", drifting(np.array([0.0, 2e-4]))),
    Case("drift of 1 mm", drifting(np.array([0.0, 1e-3]))),
    Case("jump of 0.2 mm", drifting(lambda rng, n: 2e-4 * (np.arange(n) >= rng.integers(n // 4, 3 * n // 4)))),
    Case("walk of 0.2 mm", walk(2e-4)),
    Case("texture of 2 mm, 0.01 mm", texture(1e-5, 2e-3)),
    Case("texture of 2 mm, 0.05 mm", texture(5e-5, 2e-3)),
    Case("texture of 8 mm, 0.02 mm", texture(2e-5, 8e-3)),
    Case("texture of 8 mm, 0.1 mm", texture(1e-4, 8e-3)),
    Case("tip 0.1 mm larger", offset=1e-4),
    Case("tip 0.1 mm smaller", offset=-1e-4),
    Case("sensor's origin off by 0.1 mm", shifted_origin(1e-4)),
    Case("sensor's origin off by 0.5 mm", shifted_origin(5e-4)),
    Case("sensor mounted 0.5 degrees off", mounted(0.5)),
    Case("sensor mounted 2 degrees off", mounted(2.0)),
    Case("normals lean outwards by 0.5 degrees", outward(0.5)),
    Case("normals lean outwards by 2 degrees", outward(2.0)),
    Case("rows off by 0.02 mm", rows_apart(2e-5)),
    Case("rows off by 0.1 mm", rows_apart(1e-4)),
    Case("noise alike over 5 mm", alike=5e-3),
    Case("contacts lag by 0.2 mm", back_and_forth(2e-4)),
    Case("waves of 40 mm, 0.02 mm", texture(2e-5, 4e-2)),
    Case("waves of 40 mm, 0.1 mm", texture(1e-4, 4e-2)),
    Case("a dent of 0.05 mm", dented(5e-5)),
    Case("a dent of 0.3 mm", dented(3e-4)),
)


def felt(
    kind: PrimitiveKind, case: Case, rng: Rng
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray, float]:
    """Return points, normals, where the shape is and how it is turned, and the correlation that is assumed."""
    position, normal, arc = evenly(*(case.paths or PATHS)[kind](rng), case.count)
    offset = rng.normal(0.0, TIP_SIZE_SD) if case.offset is None else case.offset
    R, c = felt_shapes.random_rotation(rng), rng.uniform(-0.5, 0.5, 3)
    smooth = SmoothErrors.of((position - position.mean(axis=0)) / np.ptp(position), normal, TIP_SIZE_SD)
    factors = smooth.sd * rng.normal(size=len(smooth.sd))
    off = smooth.functions[:, 1:] @ factors[1:] if case.holds else 0.0
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


def one(kind: PrimitiveKind, case: Case, seed: int) -> tuple[bool, FloatArray, list[str], bool]:
    """Return whether the verdict is OK, all deviations, what is broken, and whether the shape is wrong."""
    rng = np.random.default_rng([seed, sum(map(ord, kind.value))])
    position, normal, c, R, alike = felt(kind, case, rng)
    try:
        cloud = cloud_at(position, normal)
        if case.chosen:
            choice = choose_primitive(cloud, correlation_points=alike)
            names = [each.assumption.name for each in choice.verdict.broken]
            if choice.kind is not kind:
                return choice.verdict.ok, np.zeros(0), names, choice.kind is not None
            return choice.verdict.ok, deviations(choice.fits[kind], kind, c, R), names, False
        fit = fit_primitive(cloud, kind, correlation_points=alike)
    except InvalidValueError:
        return False, np.zeros(0), ["refused"], False
    if not fit.exists:
        return False, np.zeros(0), [each.assumption.name for each in fit.verdict.broken], False
    return fit.verdict.ok, deviations(fit, kind, c, R), [e.assumption.name for e in fit.verdict.broken], False


def main() -> int:
    """Print a row per case; 1 if anything is silently wrong, or a coverage missed."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=60)
    parser.add_argument("--each", action="store_true", help="a row of every kind of shape")
    parser.add_argument("--only", default="")
    asked = parser.parse_args()
    table, missed = Table(title="Shapes"), 0
    for heading in ("data", "honest", "reported", "silently wrong", "in 95 %", "largest OK |z|", "what broke"):
        table.add_column(heading, justify="left" if heading in ("data", "what broke") else "right")
    rows = [
        (case, kinds)
        for case in CASES
        if asked.only in case.name
        for kinds in ([(kind,) for kind in PrimitiveKind] if asked.each or case.holds else [tuple(PrimitiveKind)])
    ]
    for case, kinds in track(rows, "fitting", transient=True):
        broken: Counter[str] = Counter()
        silent, honest, worst, z = 0, 0, 0.0, []
        count = asked.seeds * (MORE if case.holds else 1)
        for seed in range(count):
            ok, off, names, wrong = one(kinds[seed % len(kinds)], case, seed)
            broken.update(names)
            largest = float(np.abs(off).max(initial=0.0))
            silent += ok and (wrong or largest > SILENT)
            honest += ok and not wrong and largest <= SILENT
            worst = max(worst, largest * ok)
            z.append(off)
        inside = float(np.mean(np.abs(np.concatenate(z)) <= TWO_SIDED))
        missed += silent > WORST * count or (case.holds and not COVERED[0] <= inside <= COVERED[1])
        table.add_row(
            case.name + (f", {kinds[0].value}" if len(kinds) == 1 else ""),
            *(f"{100.0 * n / count:.1f} %" for n in (honest, count - honest - silent, silent)),
            f"{100.0 * inside:.1f} %",
            f"{worst:.1f}",
            ", ".join(f"{name} {100.0 * n / count:.0f}" for name, n in broken.most_common(3)),
        )
    Console(width=150).print(table)
    return int(missed > 0)


if __name__ == "__main__":
    sys.exit(main())
