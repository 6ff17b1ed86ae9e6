"""Speed of contact sensing against its error: many methods, many kinds of hard contact.

    python benchmarks/contact.py [--quick] [--picture FILE]

The error is that of the centroid relative to its true length, against a reference in 180 digits: median, largest,
share without an answer or wrong by more than 1e-6. Times stand between two measurements of their neighbour: for a
batch a copy of as many bytes as palpate's answer (121 per contact: 15 float64 and a status) into equally fresh
memory, for a single call palpate's `contact_from_wrench`. The other methods return the centroid alone. About one
minute.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from contact_methods import METHODS, PALPATE, ContactMethod, Rows
from harness.command import start
from harness.study import Case, Effort, Errors, Input, Row, Study, judged
from harness.timing import Timed, Timing, rounds
from mpmath import mp

from reference import quadric
from reference.cases import sample
from reference.compare import Case as HardContact

FAILED = 1e-6
"""Relative error from which an answer counts as failed: 10 nm on a 10 mm fingertip."""

SEMI_AXES = np.array([0.010, 0.012, 0.020])
"""[m] Fingertip of the timed contacts, about a thumb."""

BYTES = 15 * 8 + 1
CONTACTS, QUICK_CONTACTS = 1_000_000, 300_000
"""Contacts in the timed batch. Its answer must exceed 32 MB, up to which the C library keeps memory for the
next."""

ROUNDS = 15


@dataclass(frozen=True, slots=True)
class Category:
    """One kind of hardness: generators of `tests/reference/cases.py` by name, and which contacts count."""

    name: str
    about: str
    makers: tuple[str, ...]
    belongs: Callable[[HardContact], bool] = lambda _: True


def axis_misses(case: HardContact) -> bool:
    """Return whether the wrench axis passes outside the surface, so that only spin explains the wrench."""
    return quadric.solve(case.semi_axes, case.wrench, model="hard").status == quadric.NO_CONTACT


def spin_is_tiny(case: HardContact) -> bool:
    """Return whether the moment along the force is at most a hundredth of |f| times the smallest semi-axis."""
    f, m = np.array(case.wrench[:3]), np.array(case.wrench[3:])
    return bool(abs(f @ m) <= 1e-2 * (f @ f) * min(case.semi_axes))


CATEGORIES = (
    Category("sphere", "ordinary contacts", ("sphere",)),
    Category("ellipsoid", "axes 0.1 to 10", ("ellipsoid", "any_wrench")),
    Category("slender", "axes 1e-3 to 1e6", ("slender", "slender_wrench")),
    Category("tiny spin", "down to 1e-30 of f R", ("spin_range", "spin_exact_hit"), spin_is_tiny),
    Category("zero spin", "exactly, or but for rounding", ("zero_spin", "awkward_hit")),
    Category("grazing", "axis almost tangent", ("grazing", "grazing_sphere", "grazing_exact")),
    Category("extreme scale", "1e-200 to 1e200 N", ("scale", "scale_edges")),
    Category("axis misses", "spin 1e-300 to 1", ("spin_exact_miss", "any_wrench"), axis_misses),
    Category("tangential", "slope 1 to 1e8", ("tangential",)),
)


def hard_case(category: Category, count: int) -> Case:
    """Return about `count` wrenches that have a contact, and its true centroid; the makers take turns."""
    found = [list(_solved(category, name, -(-count // len(category.makers)))) for name in category.makers]
    return Case(category.name, [each for row in zip(*found, strict=True) for each in row], category.about)


def _solved(category: Category, name: str, count: int) -> Iterator[Input]:
    left = count
    for case in sample(name, 10 * count):
        truth = case.wanted() if left and category.belongs(case) else None
        if truth is not None and truth.centroid is not None:
            yield Input(np.array(case.semi_axes), np.array(case.wrench), truth.centroid)
            left -= 1
    assert not left, f"{name}: {left} of {count} cases of {category.name} are missing"


def relative_error(c: Rows, given: Input) -> float:
    """Return |c - true c| / |true c| (judge)."""
    if not np.isfinite(c).all():
        return float("nan")
    with mp.workprec(quadric.PRECISION):
        return float(quadric.distance(list(c), given.truth) / quadric.norm(quadric.digits(given.truth)))


def errors_of(method: ContactMethod, case: Case) -> Errors:
    """Return the errors of a method on a case."""

    def prepare(semi_axes: Rows) -> Callable[[Rows], Rows]:
        solve = method.prepare(semi_axes)
        return lambda wrench: solve(wrench.astype(method.dtype).reshape(1, 6))[0]

    with np.errstate(all="ignore"):  # the simpler methods overflow
        one_by_one = ContactMethod(method.name, prepare, method.most)
        return Errors.of(judged(one_by_one, case, relative_error), FAILED)


def built_wrenches(n: int) -> Rows:
    """Return the wrenches of n ordinary soft contacts on the timed fingertip, shape (n, 6) [N, N m]."""
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
    return np.hstack([force, np.cross(centroid, force) + spin * normal])


@dataclass(frozen=True, slots=True)
class Speeds:
    """Timings per contact by method name: in a batch and in single calls."""

    batch: dict[str, Timing]
    single: dict[str, Timing]


def speeds(methods: Sequence[ContactMethod], contacts: int, count: int) -> Speeds:
    """Time methods in turns: batches beside a copy of the answer, single calls beside palpate's."""
    wrenches = built_wrenches(contacts)
    batches = {each.name: _batch(each, wrenches) for each in methods if each.batch}
    singles = {each.name: _single(each, wrenches[0]) for each in methods}
    numbers, status = np.ones(15 * contacts), np.ones(contacts, np.int8)
    copy = Timed(lambda: (numbers.copy(), status.copy()), contacts)
    with np.errstate(all="ignore"):
        return Speeds(rounds(batches, count, copy), rounds(singles, count, _single(PALPATE, wrenches[0])))


def _batch(method: ContactMethod, wrenches: Rows) -> Timed:
    rows = wrenches[: max(1, int(method.batch * len(wrenches)))].astype(method.dtype)
    solve = method.prepare(SEMI_AXES)
    return Timed(lambda: solve(rows), len(rows))


def _single(method: ContactMethod, wrench: Rows) -> Timed:
    row, solve = wrench.astype(method.dtype), method.one(SEMI_AXES)
    return Timed(lambda: solve(row))


def measure(effort: Effort) -> Study:
    """Measure errors and times of all methods."""
    found: dict[str, dict[str, Errors]] = {method.name: {} for method in METHODS}
    for category in CATEGORIES:
        effort.tell(f"contact: {category.name}")
        case = hard_case(category, effort.of(600, 60))
        for method in METHODS:
            found[method.name][category.name] = errors_of(method, case)
    effort.tell("contact: times")
    timed = speeds(METHODS, effort.of(CONTACTS, QUICK_CONTACTS), ROUNDS)
    rows = []
    for method in METHODS:
        for way, times in (("batch", timed.batch), ("single", timed.single)):
            if method.name in times:
                time = times[method.name]
                rows += [
                    Row(name, f"{method.name}, {way}", time.median, (errors,), method.name, time.ratio)
                    for name, errors in found[method.name].items()
                ]
    hardness = "; ".join(f"{each.name}: {each.about}" for each in CATEGORIES)
    about = f"Median, largest and share failed of the centroid's relative error. {hardness}."
    return Study("Contact sensing", about, "time per contact", "s", (("error of the centroid", ""),), tuple(rows))


PARTS = {"contact": measure}

if __name__ == "__main__":
    start(__doc__, PARTS)
