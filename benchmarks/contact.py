"""Speed of contact sensing, as ratios of things measured side by side in one run.

    python benchmarks/contact.py [--contacts 1000000] [--rounds 15]

Batch: all result fields of n contacts, one thread, against a plain copy of as many bytes into equally fresh
arrays; the two take turns, and each ratio is of neighbours in time. Single call: a wrench to a `Contact`, against
one row of the same formula in vectorised numpy and against scipy's root finders on the paper's four equations.
The medians are quoted: these machines are shared.
"""

import argparse
import statistics
import time
from collections.abc import Callable

import numpy as np
from rich.console import Console
from rich.table import Table
from scipy.optimize import least_squares, root

from palpate import Ellipsoid, contact_from_wrench, contacts_from_wrenches
from palpate.errors import FloatArray
from palpate.sensing.kernels.quadric import solve_quadric

SEMI_AXES = np.array([0.010, 0.012, 0.020])


def built_contacts(n: int) -> tuple[FloatArray, FloatArray]:
    """Return centroids on the ellipsoid and the wrenches of pushing soft contacts there."""
    generator = np.random.default_rng(7)
    direction = generator.normal(size=(n, 3))
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    centroid = direction * SEMI_AXES
    normal = direction / SEMI_AXES
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    tangent = np.cross(normal, generator.normal(size=(n, 3)))
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    force = generator.uniform(0.5, 5.0, (n, 1)) * (-normal + generator.uniform(0.0, 1.0, (n, 1)) * tangent)
    spin = generator.normal(scale=2e-3, size=(n, 1))
    return centroid, np.hstack([force, np.cross(centroid, force) + spin * normal])


def numpy_rows(wrenches: FloatArray) -> tuple[FloatArray, ...]:
    """Return the same fields by the same formula, in plain vectorised numpy: no scaling, no compensation."""
    A, C, D = 1 / SEMI_AXES, np.prod(1 / SEMI_AXES) * SEMI_AXES, np.prod(1 / SEMI_AXES)
    f, m = wrenches[:, :3], wrenches[:, 3:]
    a, b = m * C, f * A
    s = np.einsum("ij,ij->i", f, m)
    real, imaginary = np.einsum("ij,ij->i", b, b) - np.einsum("ij,ij->i", a, a), 2 * D * s
    z = -np.sqrt(real + 1j * imaginary)
    g, k = z.real, z.imag
    K = k / D
    numerator = K[:, None] * C**2 * m + np.cross(A**2 * f, m) + g[:, None] * f
    c = numerator / (k**2 + np.einsum("ij,ij->i", b, b))[:, None]
    gradient = A**2 * c
    length = np.linalg.norm(gradient, axis=1)
    normal = gradient / length[:, None]
    normal_force = -g / length
    condition = np.sqrt((np.einsum("ij,ij->i", a, a) + np.einsum("ij,ij->i", b, b)) / np.abs(z) ** 2)
    return c, normal, f.copy(), f + normal_force[:, None] * normal, normal_force, K * length, condition


def scipy_problem(wrench: FloatArray) -> tuple[Callable[[FloatArray], FloatArray], FloatArray]:
    """Return the paper's equations 11 and 13, scaled to unit size, and the usual start: -f through the centre."""
    size, force = SEMI_AXES.max(), np.linalg.norm(wrench[:3])
    A2 = (size / SEMI_AXES) ** 2
    f, m = wrench[:3] / force, wrench[3:] / force / size

    def equations(unknown: FloatArray) -> FloatArray:
        c, K = unknown[:3], unknown[3]
        return np.append(K * A2 * c + np.cross(c, f) - m, c @ (A2 * c) - 1.0)

    return equations, np.append(-f / np.sqrt(f @ (A2 * f)), 0.0)


def seconds(action: Callable[[], object], calls: int = 1) -> float:
    """Return the time of one call."""
    started = time.perf_counter()
    for _ in range(calls):
        action()
    return (time.perf_counter() - started) / calls


def batch(n: int, rounds: int) -> tuple[Table, float]:
    """Compare the batch with a copy of as many bytes."""
    surface = Ellipsoid(tuple(SEMI_AXES))
    centroid, wrenches = built_contacts(n)
    found = contacts_from_wrenches(surface, wrenches)
    error = float(np.max(np.linalg.norm(found.centroid - centroid, axis=1) / np.linalg.norm(centroid, axis=1)))
    fields = [getattr(found, name) for name in found.__slots__]
    solve, copy = [], []
    for _ in range(rounds):
        solve.append(seconds(lambda: contacts_from_wrenches(surface, wrenches)))
        copy.append(seconds(lambda: [np.array(field, copy=True) for field in fields]))
    plain = [seconds(lambda: numpy_rows(wrenches)) for _ in range(3)]
    ratios = [a / b for a, b in zip(solve, copy, strict=True)]
    table = Table(
        title=f"{n:.0e} contacts, all fields, {sum(f.nbytes for f in fields) / n:.0f} bytes each, one thread"
    )
    for heading in ("path", "ns per contact", "ratio to copy: min / median / max"):
        table.add_column(heading, justify="right")
    table.add_row("copy of as many bytes", f"{statistics.median(copy) / n * 1e9:.1f}", "1")
    table.add_row(
        "contacts_from_wrenches",
        f"{statistics.median(solve) / n * 1e9:.1f}",
        f"{min(ratios):.2f} / {statistics.median(ratios):.2f} / {max(ratios):.2f}",
    )
    numpy_ratio = statistics.median(plain) / statistics.median(copy)
    table.add_row("the formula in numpy", f"{statistics.median(plain) / n * 1e9:.0f}", f"{numpy_ratio:.0f}")
    table.caption = (
        f"largest relative distance of c from the built centroid: {error:.1e} (rounding of the wrench included)"
    )
    return table, statistics.median(ratios)


def single(rounds: int) -> Table:
    """Compare one call with numpy on one row and with scipy's root finders."""
    surface = Ellipsoid(tuple(SEMI_AXES))
    wrench = built_contacts(1)[1][0]
    row = wrench.reshape(1, 6)
    result, status = np.empty(15), np.empty(1, np.int8)
    equations, start = scipy_problem(wrench)
    paths: dict[str, tuple[Callable[[], object], int]] = {
        "compiled kernel alone": (lambda: solve_quadric(surface.packed, row, False, result, status), 2000),
        "contact_from_wrench": (lambda: contact_from_wrench(surface, wrench), 2000),
        "one row of numpy": (lambda: numpy_rows(row), 200),
        "scipy root (hybr)": (lambda: root(equations, start, tol=1e-12), 30),
        "scipy least_squares": (lambda: least_squares(equations, start, xtol=1e-12), 5),
    }
    times: dict[str, list[float]] = {name: [] for name in paths}
    for _ in range(rounds):
        for name, (action, calls) in paths.items():
            times[name].append(seconds(action, calls))
    table = Table(title="one contact")
    for heading in ("path", "us", "times contact_from_wrench"):
        table.add_column(heading, justify="right")
    for name, taken in times.items():
        ratio = statistics.median(t / own for t, own in zip(taken, times["contact_from_wrench"], strict=True))
        table.add_row(name, f"{statistics.median(taken) * 1e6:.2f}", f"{ratio:.2f}")
    return table


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--contacts", type=int, default=10**6, help="contacts in the batch (default: 1000000)")
    parser.add_argument("--rounds", type=int, default=15, help="rounds of each measurement (default: 15)")
    arguments = parser.parse_args()
    console = Console()
    console.print(batch(arguments.contacts, arguments.rounds)[0])
    console.print(single(arguments.rounds))


if __name__ == "__main__":
    main()
