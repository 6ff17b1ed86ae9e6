"""The contact benchmark measures what it says, on inputs small enough for seconds."""

import math
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

sys.path.append(str(Path(__file__).resolve().parents[1] / "benchmarks"))

from contact import run
from contact.categories import CATEGORIES, FAILED, Known, error, errors, known_cases
from contact.closed_forms import dot, prepare_one_formula, prepare_paper, prepare_wrench_axis
from contact.iterations import jacobians, prepare_newton, prepare_root, residuals, solve_each
from contact.methods import KERNEL, METHODS, PALPATE, SOLVER, Method, Pace
from contact.picture import MARKS
from contact.speed import BYTES, SEMI_AXES, built_wrenches, measure

from palpate import Ellipsoid, contacts_from_wrenches
from reference.compare import Case

BENCHMARKS = Path(__file__).resolve().parents[1] / "benchmarks"
FEW = 40
seeds = st.integers(0, 2**32 - 1)


def spins(semi_axes, wrenches, c):
    """K in q = K A^2 c of the paper's equation 13, from the moment about c, and what is left of it."""
    q = wrenches[:, 3:] - np.cross(c, wrenches[:, :3])
    gradient = c / semi_axes**2
    K = dot(q, gradient) / dot(gradient, gradient)
    return K, q - K[:, None] * gradient


# the paper's own formula cancels where the spin is small
@pytest.mark.parametrize(
    ("prepare", "off"), [(prepare_one_formula, 1e-14), (prepare_root, 1e-14), (prepare_paper, 1e-7)]
)
def test_exact_methods_solve_the_papers_equations_with_a_pushing_force(prepare, off):
    wrenches = built_wrenches(FEW)
    c = prepare(SEMI_AXES)(wrenches)
    np.testing.assert_allclose(dot(c / SEMI_AXES, c / SEMI_AXES), 1.0, rtol=off)
    q = wrenches[:, 3:] - np.cross(c, wrenches[:, :3])
    normal = c / SEMI_AXES**2
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    assert np.abs(np.cross(q, normal)).max() < off * np.abs(wrenches[:, 3:]).max()
    assert (dot(normal, wrenches[:, :3]) < 0.0).all()


@pytest.mark.parametrize("prepare", [prepare_one_formula, prepare_paper])
def test_without_spin_the_exact_formulas_give_the_wrench_axis(prepare):
    # force along z, moment across it: f.m is exactly zero
    wrenches = np.array([[0.0, 0.0, -2.0, 0.004, 0.008, 0.0], [0.0, 0.0, -1.0, -0.003, 0.001, 0.0]])
    expected = prepare_wrench_axis(SEMI_AXES)(wrenches)
    with np.errstate(invalid="ignore"):
        np.testing.assert_allclose(prepare(SEMI_AXES)(wrenches), expected, rtol=1e-14, atol=1e-18)


@given(seeds)
def test_the_jacobian_is_the_slope_of_the_residuals(seed):
    rng = np.random.default_rng(seed)
    A2, f, m = rng.uniform(0.1, 1.0, 3), rng.normal(size=(1, 3)), rng.normal(size=(1, 3))
    x, step = rng.normal(size=(1, 4)), rng.normal(size=(1, 4))
    # the equations are quadratic: a central difference is exact but for rounding
    difference = 0.5 * (residuals(A2, f, m, x + step) - residuals(A2, f, m, x - step))
    slope = (jacobians(A2, f, x) @ step[..., None])[..., 0]
    np.testing.assert_allclose(difference, slope, rtol=1e-10, atol=1e-10)


def test_newton_squares_a_small_error_with_every_step():
    tip, wrenches = Ellipsoid(SEMI_AXES), built_wrenches(FEW)
    found = contacts_from_wrenches(tip, wrenches)
    # hardly any spin left, so that the wrench axis is a good start
    wrenches[:, 3:] -= 0.99 * found.spin_torque[:, None] * found.normal
    truth = contacts_from_wrenches(tip, wrenches).centroid
    off = [np.abs(prepare_newton(SEMI_AXES, n)(wrenches) - truth).max() / SEMI_AXES.max() for n in (1, 2, 3)]
    assert off[0] < 1e-2
    assert off[1] < 20.0 * off[0] ** 2
    assert off[2] < max(20.0 * off[1] ** 2, 1e-14)


def test_a_singular_system_does_not_spoil_its_neighbours():
    J = np.array([np.eye(4), np.zeros((4, 4)), 2.0 * np.eye(4)])
    x = solve_each(J, np.ones((3, 4)))
    np.testing.assert_array_equal(x, [np.ones(4), np.full(4, np.nan), 0.5 * np.ones(4)])


@pytest.mark.parametrize("category", CATEGORIES, ids=lambda category: category.name)
def test_palpate_is_right_in_every_category(category):
    known = list(known_cases(category, 6))
    assert len(known) == 6
    found = errors(PALPATE, known)
    assert found.failed == found.no_number == 0.0
    assert found.largest < 1e-15


def shifted(offset):
    """A method that is wrong by `offset`, on the unit sphere pushed from above."""
    return Method("shifted", lambda _axes: lambda _wrenches: np.array([[0.0, 0.0, 1.0 + offset]]), Pace.FAST)


@pytest.mark.parametrize(("offset", "no_number", "failed"), [(2.0**-30, 0, 0), (2.0**-10, 0, 1), (math.nan, 1, 1)])
def test_an_error_is_what_was_added_and_no_number_is_a_failure(offset, no_number, failed):
    known = Known(Case("Sphere", 1.0, (0.0, 0.0, -1.0, 0.0, 0.0, 0.0)), [0, 0, 1])
    assert FAILED == 1e-6
    np.testing.assert_equal(error(shifted(offset), known), offset)
    found = errors(shifted(offset), [known])
    assert (found.no_number, found.failed) == (no_number, failed)
    assert found.median == (math.inf if no_number else offset)


def test_the_floor_copies_as_many_bytes_as_the_answer_has():
    answer = contacts_from_wrenches(Ellipsoid(SEMI_AXES), built_wrenches(FEW))
    assert sum(getattr(answer, name).nbytes for name in answer.__slots__) == BYTES * FEW


def test_speeds_are_kept_by_round_against_neighbours():
    seen = []
    speeds = measure((PALPATE, KERNEL, METHODS[3]), contacts=1000, rounds=3, done=lambda: seen.append(1))
    assert len(seen) == 3
    assert set(speeds.batch) == {PALPATE.name, METHODS[3].name}
    assert set(speeds.single) == {PALPATE.name, KERNEL.name, METHODS[3].name}
    for timing in (*speeds.batch.values(), *speeds.single.values()):
        assert len(timing.seconds) == len(timing.ratios) == 3
        least, median, largest = timing.spread
        assert 0.0 < least <= median <= largest
    assert speeds.single[KERNEL.name].median < speeds.single[PALPATE.name].median
    assert 0.0 < speeds.floor < speeds.single[PALPATE.name].median


def test_every_method_has_a_mark_of_its_own():
    assert set(MARKS) == {method.name for method in METHODS} - {KERNEL.name, SOLVER.name}
    assert len({(mark.colour, mark.shape) for mark in MARKS.values()}) == len(MARKS)


@pytest.mark.slow
def test_the_whole_of_it(tmp_path, monkeypatch, capsys):
    picture = tmp_path / "new" / "picture.png"
    monkeypatch.setattr(run, "QUICK", run.Effort(contacts=200, rounds=2, cases=2))
    monkeypatch.setattr(sys, "argv", ["contact", "--quick", "--picture", str(picture)])
    run.main()
    shown = capsys.readouterr().out
    for method in METHODS:
        assert method.name in shown
    for category in CATEGORIES:
        assert category.name in shown
    assert "121 bytes" in " ".join(shown.split())
    assert picture.read_bytes().startswith(b"\x89PNG")


@pytest.mark.slow
def test_it_starts_from_the_folder():
    started = [sys.executable, str(BENCHMARKS / "contact"), "--help"]
    said = subprocess.run(started, check=True, capture_output=True, text=True).stdout
    assert "--quick" in said
    assert "180 digits" in said


@pytest.mark.slow
@pytest.mark.parametrize(
    "script",
    [
        "every_tip.py",
        "exploration.py",
        "loop.py",
        "recording.py",
        "batch.py",
        "open_loop.py",
        "sensors.py",
        "simulation",
        "friction.py",
        "materials.py",
        "slip.py",
        "grasp.py",
        "learning.py",
        "start_up.py",
        "bench.py",
        "sweep.py",
    ],
)
def test_every_benchmark_says_what_it_measures(script):
    started = [sys.executable, str(BENCHMARKS / script), "--help"]
    said = subprocess.run(started, check=True, capture_output=True, text=True).stdout
    assert len(said.splitlines()) > 5


@pytest.mark.slow
@pytest.mark.parametrize(
    ("script", "shown"),
    [
        ("loop.py", "asked"),
        ("recording.py", "asked"),
        ("batch.py", "asked"),
        ("sensors.py", "force RMS error"),
        ("open_loop.py", "threads do"),
    ],
)
def test_what_the_loop_costs_is_measured_to_the_end(script, shown):
    """Whether the figures are kept depends on what else the machine does: they are shown, not judged."""
    started = [sys.executable, str(BENCHMARKS / script), "--quick"]
    said = subprocess.run(started, check=True, capture_output=True, text=True, timeout=300).stdout
    assert shown in said
