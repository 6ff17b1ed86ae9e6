"""Least forces of a grasp: palpate's solver, a general one, and forces that know of no friction."""

import warnings
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
from scipy.optimize import minimize

from palpate.errors import FloatArray
from palpate.experiments.bench.study import Row, Study, Tell
from palpate.experiments.bench.turns import timed_in_turns
from palpate.grasp import GraspContacts, GraspForceOptimizer, SolveStatus

WEIGHT = 0.01
"""Of tangential forces in the effort, as `GraspForceOptimizer` has it."""
FRICTION, SPIN_LENGTH = 0.6, 0.004
SIZE = 0.03
"""Radius of the ball that is held [m]."""
LOAD = (0.3, -0.2, -1.0, 0.002, -0.001, 0.003)
"""About which loads are drawn [N, N m]: a weight of 0.1 kg, pulled at."""

ABOUT = (
    "Three, four and five soft fingers on a ball of 60 mm, mu 0.6, e 4 mm; loads of about 1 N. The error is "
    "the larger of two: by how much friction, equilibrium or the sign of a normal force is violated, over the "
    "load; and by how much the effort exceeds the least that any method found within the limits, relatively. "
    "More solvers, larger grasps, loads that nothing holds: python benchmarks/grasp.py, in a checkout."
)


def ball_grasp(fingers: int, rng: np.random.Generator) -> GraspContacts:
    """Return fingers about a ball, evenly but for 0.3 rad, each pushing at its middle."""
    angle = 2.0 * np.pi * np.arange(fingers) / fingers + rng.uniform(-0.3, 0.3, fingers)
    height = rng.uniform(-0.3, 0.3, fingers)
    out = np.column_stack([np.cos(angle) * np.cos(height), np.sin(angle) * np.cos(height), np.sin(height)])
    inward = -out
    first = np.cross(inward, (0.0, 0.0, 1.0))
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    frames = np.stack([inward, first, np.cross(inward, first)], axis=2)
    return GraspContacts(SIZE * out, frames, FRICTION, SPIN_LENGTH)


def effort(forces: FloatArray) -> float:
    """Return the effort of forces (f_n, f_t1, f_t2, tau), shape (n, 4) [N, N, N, N m]."""
    across = forces[:, 1] ** 2 + forces[:, 2] ** 2 + (forces[:, 3] / SPIN_LENGTH) ** 2
    return float(np.sum(forces[:, 0] ** 2) + WEIGHT * np.sum(across))


def violation(grasp: GraspContacts, load: FloatArray, forces: FloatArray) -> float:
    """Return the largest violation of equilibrium, friction or pushing, over the load's size."""
    left = grasp.grasp_map @ forces.ravel() + load
    left[3:] /= SIZE  # so that moments count as forces
    across = np.sqrt(forces[:, 1] ** 2 + forces[:, 2] ** 2 + (forces[:, 3] / SPIN_LENGTH) ** 2)
    worst = max(np.abs(left).max(), (across - FRICTION * forces[:, 0]).max(), -forces[:, 0].min())
    return float(worst / np.linalg.norm(load[:3]))


def palpate_cold(grasp: GraspContacts) -> Callable[[FloatArray], FloatArray]:
    """Return palpate's solver, which starts afresh for every load."""
    optimizer = GraspForceOptimizer(grasp)
    return lambda load: _forces(optimizer, load, False)


def palpate_warm(grasp: GraspContacts) -> Callable[[FloatArray], FloatArray]:
    """Return palpate's solver, which goes on from the last load, as in a control loop."""
    optimizer = GraspForceOptimizer(grasp)
    return lambda load: _forces(optimizer, load, True)


def least_norm(grasp: GraspContacts) -> Callable[[FloatArray], FloatArray]:
    """Return the pseudoinverse: equilibrium with the least forces, whatever friction can bear."""
    scaled = grasp.grasp_map.copy()
    scaled[:, 3::4] *= SPIN_LENGTH
    inverse = np.linalg.pinv(scaled)

    def solve(load: FloatArray) -> FloatArray:
        forces = -(inverse @ load).reshape(-1, 4)
        forces[:, 3] *= SPIN_LENGTH
        return forces

    return solve


def slsqp(grasp: GraspContacts) -> Callable[[FloatArray], FloatArray]:
    """Return scipy's SLSQP with exact derivatives, on cones rounded by 1e-6."""
    n = len(grasp.friction)
    columns = grasp.grasp_map.copy()
    columns[:, 3::4] *= SPIN_LENGTH
    columns[3:] /= SIZE
    weights = np.tile([1.0, WEIGHT, WEIGHT, WEIGHT], n)
    bounds: Any = [(0.0, None), (None, None), (None, None), (None, None)] * n
    where = np.arange(n)

    def wanted(x: FloatArray) -> float:
        return float(weights @ (x * x))

    def slope(x: FloatArray) -> FloatArray:
        return np.asarray(2.0 * weights * x)

    def cones(x: FloatArray) -> FloatArray:
        rows = x.reshape(-1, 4)
        return np.asarray(FRICTION * rows[:, 0] - np.sqrt((rows[:, 1:] ** 2).sum(axis=1) + 1e-12))

    def slopes(x: FloatArray) -> FloatArray:
        rows = x.reshape(-1, 4)
        used = np.sqrt((rows[:, 1:] ** 2).sum(axis=1) + 1e-12)
        out = np.zeros((n, n, 4))
        out[where, where] = np.column_stack([np.full(n, FRICTION), -rows[:, 1:] / used[:, None]])
        return out.reshape(n, -1)

    def solve(load: FloatArray) -> FloatArray:
        pull = load / np.array([1.0, 1.0, 1.0, SIZE, SIZE, SIZE])
        limits: Any = [
            {"type": "eq", "fun": lambda x: columns @ x + pull, "jac": lambda x: columns},
            {"type": "ineq", "fun": cones, "jac": slopes},
        ]
        found = minimize(
            wanted,
            np.tile([0.5, 0.0, 0.0, 0.0], n),
            jac=slope,
            bounds=bounds,
            constraints=limits,
            method="SLSQP",
            options={"ftol": 1e-12, "maxiter": 200},
        )
        forces = np.array(found.x).reshape(-1, 4)
        forces[:, 3] *= SPIN_LENGTH
        return forces

    return solve


METHODS = {
    "palpate, from the last load": palpate_warm,
    "palpate, afresh": palpate_cold,
    "scipy SLSQP": slsqp,
    "pseudoinverse, numpy": least_norm,
}

WITHIN = 1e-9
"""Violations below this, over the load, are rounding: such forces count for the least effort."""


def measure(quick: bool, seed: int, tell: Tell) -> Study:
    """Measure grasp forces."""
    rng = np.random.default_rng(seed)
    rows = []
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        for fingers in (3, 4, 5):
            tell(f"grasp: {fingers} fingers")
            rows += _rows(fingers, quick, rng)
    rows.sort(key=lambda row: list(METHODS).index(row.series))
    return Study(
        "grasp",
        "Least forces of a grasp",
        ABOUT,
        "time per load",
        "s",
        "(violation or excess effort, relative)",
        "",
        tuple(rows),
    )


def _rows(fingers: int, quick: bool, rng: np.random.Generator) -> list[Row]:
    cases = []
    for _ in range(5 if quick else 30):
        grasp = ball_grasp(fingers, rng)
        loads = np.array(LOAD) * (1.0 + 0.3 * rng.normal(size=(4, 6)))
        cases.append((grasp, loads, {name: make(grasp) for name, make in METHODS.items()}))
    _, first_loads, first = cases[0]

    def through(solve: Callable[[FloatArray], FloatArray]) -> None:
        for load in first_loads:
            solve(load)

    calls = {name: partial(through, solve) for name, solve in first.items()}
    taken = timed_in_turns(calls, 5 if quick else 15)
    errors: dict[str, list[float]] = {name: [] for name in METHODS}
    for grasp, loads, solvers in cases:
        for load in loads:
            found = {name: solve(load) for name, solve in solvers.items()}
            off = {name: violation(grasp, load, forces) for name, forces in found.items()}
            least = min((effort(found[name]) for name in METHODS if off[name] < WITHIN), default=np.nan)
            for name, forces in found.items():
                excess = max(effort(forces) / least - 1.0, 0.0) if np.isfinite(least) else 0.0
                errors[name].append(max(off[name], excess))
    return [
        Row(
            name,
            f"{name}, {fingers} fingers",
            taken[name] / len(first_loads),
            float(np.nanmedian(each)),
            float(np.nanmax(each)),
            _failed(each),
        )
        for name, each in errors.items()
    ]


def _failed(errors: list[float]) -> str:
    none = int(np.count_nonzero(~np.isfinite(errors)))
    return f"no answer to {none} of {len(errors)}" if none else ""


def _forces(optimizer: GraspForceOptimizer, load: FloatArray, warm: bool) -> FloatArray:
    found = optimizer.solve(load, warm)
    return found.forces if found.status is SolveStatus.SOLVED else np.full((len(optimizer.grasp), 4), np.nan)
