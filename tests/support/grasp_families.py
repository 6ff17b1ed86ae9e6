"""Grasps to solve, easy and hard, and what an independent solver of cone programmes says of them."""

import math
from dataclasses import dataclass, replace

import clarabel
import mpmath
import numpy as np
from scipy import sparse

from palpate.grasp.problem.contacts import GraspContacts
from palpate.grasp.problem.scaled import ScaledGrasp
from palpate.grasp.solvers.least_effort import LeastEffort

FAMILIES = ("random", "slippery", "sticky", "antipodal", "parallel", "coincident", "in line", "large e")
"""`antipodal` grasps bear a load about the line of contacts, which only e carries."""

FACTORS = (0.5, 0.9, 0.99, 0.999, 1.0001, 1.001, 1.01, 1.1, 2.0, 5.0)
"""By which a load could be larger: below 1 nothing holds it."""


@dataclass(frozen=True)
class Instance:
    """A grasp and a load on it, of which `factor` times as much could be held."""

    family: str
    factor: float
    grasp: GraspContacts
    load: np.ndarray


def frame(normal, rng):
    """A right-handed frame whose first axis is `normal`."""
    aside = np.cross(normal, rng.normal(size=3))
    aside /= np.linalg.norm(aside)
    return np.stack([normal, aside, np.cross(normal, aside)], axis=1)


def grasp_of(positions, normals, friction, spin_length, rng, **more):
    """A grasp with unit normals and tangents at random."""
    normals = normals / np.linalg.norm(normals, axis=1)[:, None]
    frames = np.stack([frame(each, rng) for each in normals])
    return GraspContacts(positions, frames, friction, spin_length, **more)


def around(n, rng, size=0.03, rough=0.2):
    """Positions and normals of n contacts around an object."""
    out = rng.normal(size=(n, 3))
    out /= np.linalg.norm(out, axis=1)[:, None]
    return size * out, -out + rough * rng.normal(size=(n, 3))


def drawn(family, rng):
    """A grasp of a family and a load on it, its size at random."""
    n, scale = int(rng.integers(2, 6)), 10.0 ** rng.uniform(-3.0, 3.0)
    friction, length = rng.uniform(0.3, 1.2, n), 0.03
    positions, normals = around(n, rng)
    load = rng.normal(size=6) * [1.0, 1.0, 1.0, length, length, length]
    match family:
        case "slippery":
            positions, normals = around(n + 2, rng, rough=0.0)
            friction = np.full(n + 2, 0.05)
        case "sticky":
            friction = np.full(n, 2.0)
        case "antipodal":
            positions = length * np.array([[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0]])
            normals, friction = -positions, rng.uniform(0.2, 1.0, 2)
            load = np.array([0.0, 0.0, 0.0, 0.01, 0.0, 0.0]) + (rng.random() < 0.5) * 0.1 * load
        case "parallel":
            normals = np.array([0.0, 0.0, 1.0]) + 1e-3 * rng.normal(size=(n, 3))
            normals[0] *= -1.0
            positions[:, 2] *= 0.01
        case "coincident":
            positions[1], normals[1] = positions[0], normals[0]
        case "in line":
            positions = np.outer(rng.normal(size=n), [length, 0.0, 0.0])
            normals = np.outer(np.where(np.arange(n) % 2, 1.0, -1.0), [0.0, 0.0, 1.0])
            load[3] = 0.0  # nothing bears a torque about the line itself
        case "large e":
            positions = 1e-2 * positions
    n = len(positions)
    grasp = grasp_of(
        positions,
        normals,
        friction,
        rng.uniform(0.001, 0.008, n),
        rng,
        force_max=scale * rng.uniform(0.5, 3.0, n),
    )
    return grasp, scale * load


def instances(seed, per_family, factors=FACTORS):
    """Grasps of every family under loads of known factors."""
    rng = np.random.default_rng(seed)
    for family in FAMILIES:
        found = 0
        while found < per_family:
            grasp, load = drawn(family, rng)
            most = Reference(grasp).load_factor(load)
            if not 1e-3 < most < 1e6:
                continue
            found += 1
            for factor in factors:
                yield Instance(family, factor, grasp, load * (most / factor))


def within_limits(rng, **limits):
    """A grasp of three to five contacts with limit surfaces of any shape, and a load of about a newton."""
    n = int(rng.integers(3, 6))
    friction, spin_length = rng.uniform(0.4, 1.0, n), rng.uniform(0.002, 0.006, n)
    grasp = grasp_of(*around(n, rng), friction, spin_length, rng, force_max=40.0, **limits)
    return grasp, rng.normal(size=6) * [1.0, 1.0, 1.0, 0.01, 0.01, 0.01]


def opposite(friction, spin_length, **more):
    """Two opposite contacts on the x axis, 60 mm apart."""
    frames = np.stack([np.eye(3), np.diag([-1.0, -1.0, 1.0])])
    places = np.array([[-0.03, 0.0, 0.0], [0.03, 0.0, 0.0]])
    return GraspContacts(places, frames, friction, spin_length, **more)


def solved(grasp, load, reserve=None, weight=0.01):
    """Outcome of least effort, its evaluations, forces (n, 4), and the solver."""
    solver, forces = LeastEffort(ScaledGrasp.of(grasp, reserve), weight), np.zeros((len(grasp), 4))
    outcome, used = solver.solve(np.asarray(load, float), forces)
    return outcome, used, forces, solver


def check_forces(grasp, load, forces, most=1e-9):
    """Check that forces balance a load and keep all limits, both within `most` [N, N m]."""
    assert np.abs(grasp.grasp_map @ forces.ravel() + load).max() <= most
    assert grasp.margins(forces).min() >= -most
    assert (forces[:, 0] <= grasp.force_max + most).all()


def paired(seed, force_min, force_max):
    """Two or four contacts in opposite pairs: whatever they press with at least balances itself."""
    rng = np.random.default_rng(seed)
    places, axes = around(2 * int(rng.integers(1, 3)), rng, rough=0.05)
    half = len(places) // 2
    places[half:], axes[half:] = -places[:half], -axes[:half]
    return grasp_of(places, axes, 0.5, 0.004, rng, force_min=force_min, force_max=force_max)


def least_value(grasp, load, y, reach):
    """The least of y . (G w + load) at 50 digits; contacts without a largest force share `reach`."""
    with mpmath.workdps(50):
        total = mpmath.fdot(map(mpmath.mpf, y), map(mpmath.mpf, load))
        worst = mpmath.mpf(0)
        for i in range(len(grasp)):
            columns = [[mpmath.mpf(each) for each in row] for row in grasp.frames[i].T]
            px, py, pz = map(mpmath.mpf, grasp.positions[i])
            a, b, c, u, v, w = map(mpmath.mpf, y)
            at = [a + v * pz - w * py, b + w * px - u * pz, c + u * py - v * px]
            g = [mpmath.fdot(at, column) for column in columns]
            g.append(mpmath.mpf(grasp.spin_length[i]) * mpmath.fdot([u, v, w], columns[0]))
            pays = g[0] - mpmath.mpf(grasp.friction[i]) * mpmath.norm(g[1:])
            if pays >= 0:
                total += pays * mpmath.mpf(grasp.force_min[i])
            elif math.isinf(grasp.force_max[i]):
                worst = min(worst, pays)
            else:
                total += pays * mpmath.mpf(grasp.force_max[i])
        return total + (worst * mpmath.mpf(reach) if worst < 0 else 0)


class Reference:
    """Clarabel's answers, in units of the load and of the grasp's size."""

    def __init__(self, grasp):
        n = len(grasp)
        self.grasp = grasp
        self.center = grasp.positions.mean(axis=0)
        arms = grasp.positions - self.center
        self.length = max(np.linalg.norm(arms, axis=1).max(), grasp.spin_length.max())
        self.map = replace(grasp, positions=arms).grasp_map.copy()
        self.map[:, 3::4] *= grasp.spin_length  # columns for u3 = tau / e
        self.map[3:] /= self.length
        cones = []
        for i in range(n):
            block = np.zeros((4, 4 * n))
            block[0, 4 * i] = -grasp.friction[i]
            block[[1, 2, 3], [4 * i + 1, 4 * i + 2, 4 * i + 3]] = -1.0
            cones.append(block)
        self.cones = cones

    def _scaled(self, load):
        out = np.array(load, float)
        out[3:] = (out[3:] - np.cross(self.center, out[:3])) / self.length
        size = np.linalg.norm(out) or 1.0
        return out / size, size

    def _solve(self, quadratic, linear, extra, load, size):
        """Minimise over 4 n forces and no other unknown, a factor of the load, or six that are left of it."""
        grasp, n = self.grasp, len(self.grasp)
        wide = np.zeros(
            (6, 4 * n + extra)
        )  # unknowns beyond the forces: a factor of the load, or what is left of it
        wide[:, : 4 * n] = self.map
        if extra == 1:
            wide[:, -1] = load
        else:
            wide[:, 4 * n :] = -np.eye(6)[:, :extra]
        rows, right = [wide], [np.zeros(6) if extra == 1 else -load]
        kinds = [clarabel.ZeroConeT(6)]
        for block in self.cones:
            rows.append(np.pad(block, ((0, 0), (0, extra))))
            right.append(np.zeros(4))
            kinds.append(clarabel.SecondOrderConeT(4))
        normal = np.zeros((n, 4 * n + extra))
        normal[np.arange(n), 4 * np.arange(n)] = 1.0
        bounded = np.isfinite(grasp.force_max)
        rows += [-normal, normal[bounded]]
        right += [-grasp.force_min / size, grasp.force_max[bounded] / size]
        kinds.append(clarabel.NonnegativeConeT(n + int(bounded.sum())))
        how = clarabel.DefaultSettings()
        how.verbose = False
        how.tol_gap_abs = how.tol_gap_rel = how.tol_feas = 1e-11
        matrix = sparse.csc_matrix(np.vstack(rows))
        solver = clarabel.DefaultSolver(
            sparse.csc_matrix(quadratic), linear, matrix, np.concatenate(right), kinds, how
        )
        return solver.solve()

    def load_factor(self, load):
        """The largest factor of the load that can be held; infinite if any."""
        scaled, size = self._scaled(load)
        count = 4 * len(self.grasp) + 1
        linear = np.zeros(count)
        linear[-1] = -1.0
        answer = self._solve(np.zeros((count, count)), linear, 1, scaled, size)
        if "Dual" in str(answer.status):
            return np.inf
        return -answer.obj_val if "Solved" in str(answer.status) else np.nan

    def least_effort(self, load, weight=0.01):
        """The least sum of f_n^2 + weight (f_t^2 + (tau / e)^2) [N^2]; infinite if none, NaN if undecided."""
        scaled, size = self._scaled(load)
        quadratic = np.diag(np.tile([2.0, *[2.0 * weight] * 3], len(self.grasp)))
        answer = self._solve(quadratic, np.zeros(len(quadratic)), 0, scaled, size)
        match str(answer.status):
            case "Solved":
                return answer.obj_val * size**2
            case "PrimalInfeasible":
                return np.inf
        return np.nan

    def least_left(self, load):
        """The least length of what is left of the load, moments over the size of the grasp, over the load's."""
        scaled, size = self._scaled(load)
        count = 4 * len(self.grasp)
        quadratic = np.zeros((count + 6, count + 6))
        quadratic[count:, count:] = 2.0 * np.eye(6)
        answer = self._solve(quadratic, np.zeros(count + 6), 6, scaled, size)
        return np.sqrt(max(answer.obj_val, 0.0))
