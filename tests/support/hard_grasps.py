"""Grasps that break solvers: scaled loads and rows of contacts as `problem.statement` takes them."""

from collections.abc import Iterator

import numpy as np

from palpate.errors import FloatArray

Instance = tuple[str, FloatArray, FloatArray]
"""Family, contacts (n, 16), load (6,) of length one."""


def contact(
    place: FloatArray, normal: FloatArray, e: float, mu: float, lo: float = 0.0, hi: float = np.inf
) -> list[float]:
    """Return one contact's row; its tangents are any."""
    n = np.asarray(normal, float) / np.linalg.norm(normal)
    t1 = np.cross(n, np.eye(3)[np.argmin(np.abs(n))])
    t1 /= np.linalg.norm(t1)
    return [*place, *n, *t1, *np.cross(n, t1), e, mu, lo, hi]


def unit(rng: np.random.Generator, size: int = 3) -> FloatArray:
    """Return a direction, all alike."""
    v = rng.normal(size=size)
    return v / np.linalg.norm(v)


def around(
    rng: np.random.Generator, n: int, mu: float = 0.5, e: float = 0.2, tilt: float = 0.3, hi: float = np.inf
) -> FloatArray:
    """Return contacts on a sphere that press inward, more or less."""
    places = [unit(rng) for _ in range(n)]
    return np.array([contact(p, -p + tilt * rng.normal(size=3), e, mu, hi=hi) for p in places])


def held(rng: np.random.Generator, contacts: FloatArray, share: float) -> FloatArray:
    """Return a load of length one that forces inside all limits hold; `share` of friction is used."""
    n = len(contacts)
    f = np.minimum(rng.uniform(0.5, 2.0, n), 0.5 * (contacts[:, 14] + np.minimum(contacts[:, 15], 1e3)))
    f = np.maximum(f, contacts[:, 14])
    u = np.array([unit(rng) for _ in range(n)]) * (share * contacts[:, 13] * f)[:, None]
    load = -pushed(contacts, np.column_stack([f, u]))
    size = np.linalg.norm(load)
    contacts[:, 14:16] /= size
    return load / size


def pushes(contacts: FloatArray) -> FloatArray:
    """Return A (6, 4) of each contact, shape (n, 6, 4)."""
    p, n, t1, t2 = (contacts[:, 3 * i : 3 * i + 3] for i in range(4))
    top = np.stack([n, t1, t2, 0.0 * n], axis=2)
    bottom = np.stack([np.cross(p, n), np.cross(p, t1), np.cross(p, t2), contacts[:, 12:13] * n], axis=2)
    return np.concatenate([top, bottom], axis=1)


def pushed(contacts: FloatArray, forces: FloatArray) -> FloatArray:
    """Return sum A_i x_i, shape (6,)."""
    return np.einsum("nij,nj->i", pushes(contacts), forces)


def antipodal(mu: float, e: float, spin: float, press: float = 1.0) -> tuple[FloatArray, FloatArray]:
    """Return two fingers held to a force, and a load that spins about their line by `spin` of what they bear."""
    contacts = np.array(
        [contact([-1.0, 0, 0], [1.0, 0, 0], e, mu, hi=press), contact([1.0, 0, 0], [-1.0, 0, 0], e, mu, hi=press)]
    )
    load = np.zeros(6)
    load[3] = 2.0 * spin * mu * e * press
    size = float(load[3])
    contacts[:, 14:16] /= size
    return contacts, load / size


def instances(seed: int, each: int) -> Iterator[Instance]:
    """Yield `each` of every family."""
    for i in range(each):
        rng = np.random.default_rng([seed, i])
        n = int(rng.integers(2, 9))
        yield "random", around(rng, n), unit(rng, 6)
        yield "random, with f_max", around(rng, n, hi=rng.uniform(0.3, 5.0)), unit(rng, 6)
        for mu in (0.05, 2.0):
            contacts = around(rng, n, mu=mu)
            yield f"mu {mu}", contacts, unit(rng, 6)
            contacts = around(rng, n, mu=mu)
            yield f"mu {mu}, holds", contacts, held(rng, contacts, 0.999)
        for spin in (0.99, 1.01):
            yield (f"spin {spin}", *antipodal(rng.uniform(0.1, 1.5), rng.uniform(0.02, 0.3), spin))
        contacts = around(rng, n)
        contacts[:, 3:12] = contact(contacts[0, :3], -contacts[0, :3], 0.2, 0.5)[3:12]
        contacts[:, 3:6] += 1e-4 * rng.normal(size=(n, 3))
        contacts = np.array([contact(c[:3], c[3:6], 0.2, 0.5) for c in contacts])
        yield "nearly parallel", contacts, unit(rng, 6)
        yield "nearly parallel, holds", contacts, held(rng, contacts, 0.9)
        contacts = np.repeat(around(rng, max(n // 2, 1)), 2, axis=0)
        yield "coincident", contacts, unit(rng, 6)
        yield "coincident, holds", contacts, held(rng, contacts, 1.0)
        along = unit(rng)
        contacts = np.array([contact(rng.uniform(-1, 1) * along, unit(rng), 1e-3, 0.5) for _ in range(n)])
        yield "on a line", contacts, unit(rng, 6)
        yield "on a line, holds", contacts, held(rng, contacts, 0.9)
        contacts = around(rng, 1)
        yield "one contact", contacts, unit(rng, 6)
        yield "one contact, holds", contacts, held(rng, contacts, 0.5)
        contacts = around(rng, n, hi=1.5)
        contacts[:, 14] = rng.uniform(0.0, 0.7, n)
        yield "f_min, f_max, holds", contacts, held(rng, contacts, 0.8)
        contacts = around(rng, n, hi=1.0)
        contacts[:, 14] = 1.0
        yield "f given, holds", contacts, held(rng, contacts, 0.8)
        contacts = around(rng, n)
        contacts[:, 12] = 10.0 ** rng.uniform(-4, 0, n)
        yield "small e", contacts, held(rng, contacts, 0.95)
        contacts = around(rng, n)
        contacts[: n // 2, 15] = rng.uniform(0.2, 2.0)
        yield "f_max of some, unequal mu", contacts, held(rng, contacts, 0.95)
