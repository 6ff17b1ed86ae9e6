"""Interior point method: optimal by the conditions of the statement, certain about what cannot be held."""

from collections.abc import Callable
from functools import lru_cache
from pathlib import Path

import casadi
import numpy as np
import pytest

from palpate.errors import FloatArray, InvalidValueError
from palpate.grasp import compiled
from palpate.grasp.attempts import ATTEMPTS, Attempt
from palpate.grasp.compiled import Compiled, Interpreted, cache_folder
from palpate.grasp.contact_problem import ContactProblem
from palpate.grasp.grasp_proof import proof_value
from palpate.grasp.interior_point import InteriorPoint, InteriorPointResult, InteriorPointStatus
from palpate.grasp.objective import Objective
from palpate.grasp.statement import optimality, state_contact
from support.hard_grasps import antipodal, around, contact, held, instances, pushed, pushes, unit

SOLVED, INFEASIBLE = InteriorPointStatus.SOLVED, InteriorPointStatus.INFEASIBLE


@lru_cache(maxsize=128)
def solver(n: int, objective: Objective, actuators: int = 0) -> InteriorPoint:
    """Not compiled: what is tested is the method."""
    return InteriorPoint(n, objective, actuators, executor=Interpreted())


@lru_cache(maxsize=128)
def conditions(n: int, objective: Objective, actuators: int = 0) -> Callable[..., list[object]]:
    found: Callable[..., list[object]] = optimality(n, objective, actuators)
    return found


def assert_optimal(
    objective: Objective,
    contacts: FloatArray,
    load: FloatArray,
    answer: InteriorPointResult,
    rows: FloatArray | None = None,
    limits: FloatArray | None = None,
) -> None:
    n = len(contacts)
    k = 0 if limits is None else limits.shape[1]
    flat = np.zeros((0, n)) if rows is None else rows.reshape(n, -1).T
    most = np.zeros((0, n)) if limits is None else limits.T
    m = answer.multipliers.T
    found = conditions(n, objective, k)(
        contacts.T,
        load,
        flat,
        most,
        np.tile([[0.0], [2.0]], n),
        answer.forces.T,
        answer.theta,
        answer.dual,
        m[:4],
        m[4:],
    )
    stationarity, equilibrium, feasible, dual_feasible, _, gap, value = (np.array(each).ravel() for each in found)
    size = np.linalg.norm(load)
    scale = max(size, contacts[:, 14].max()) or 1.0
    assert np.abs(equilibrium).max() <= 1e-9 * scale
    assert feasible[0] >= -1e-9 * scale
    f = answer.forces[:, 0]
    assert max((contacts[:, 14] - f).max(), (f - contacts[:, 15]).max()) <= 1e-9 * scale
    unit_of_dual = 1.0 + np.abs(answer.dual).max()
    assert np.abs(stationarity).max() <= 1e-8 * unit_of_dual
    assert dual_feasible[0] >= -1e-8 * unit_of_dual
    floor = {Objective.MIN_EFFORT: scale**2, Objective.LOAD_FACTOR: 1.0}.get(objective, scale)
    assert abs(gap[0]) <= 1e-8 * max(abs(value[0]), 1e-3 * floor) * 1.1


def assert_proof(contacts: FloatArray, load: FloatArray, y: FloatArray) -> None:
    """For no forces inside all limits y . (pushed + load) is zero or less."""
    g = np.einsum("nij,i->nj", pushes(contacts), y)
    pays = g[:, 0] - contacts[:, 13] * np.linalg.norm(g[:, 1:], axis=1)
    lo, hi = contacts[:, 14], contacts[:, 15]
    at_end = np.where(pays >= 0.0, lo * pays, np.where(np.isinf(hi), 0.0, np.minimum(hi, 1e300) * pays))
    wrong = np.where(np.isinf(hi), np.maximum(-pays, 0.0), 0.0).max()
    assert y @ load + at_end.sum() - 1e8 * np.linalg.norm(load) * wrong > 0.0


@pytest.mark.slow
@pytest.mark.parametrize("objective", Objective)
def test_every_family_is_solved_or_proved_impossible(objective: Objective) -> None:
    linear = objective in (Objective.MAX_MARGIN, Objective.LOAD_FACTOR)
    for family, contacts, load in instances(11, 1):
        if linear:
            contacts[:, 15] = np.minimum(contacts[:, 15], 30.0)  # else both are without end where forces close
        answer = solver(len(contacts), objective).solve(contacts, load)
        assert answer.status in (SOLVED, INFEASIBLE), family
        if answer.status is SOLVED:
            assert_optimal(objective, contacts, load, answer)
        else:
            assert "holds" not in family
            assert answer.certificate is not None
            assert_proof(contacts, load, answer.certificate)


@pytest.mark.slow
@pytest.mark.parametrize("objective", Objective)
def test_of_two_thousand_hard_grasps_none_is_left_undecided(objective: Objective) -> None:
    for family, contacts, load in instances(314, 100):
        if objective in (Objective.MAX_MARGIN, Objective.LOAD_FACTOR):
            contacts[:, 15] = np.minimum(contacts[:, 15], 30.0)
        answer = solver(len(contacts), objective).solve(contacts, load)
        assert answer.status in (SOLVED, INFEASIBLE), family
        if answer.status is SOLVED:
            assert_optimal(objective, contacts, load, answer)
        else:
            assert "holds" not in family
            assert answer.certificate is not None
            assert_proof(contacts, load, answer.certificate)


@pytest.mark.parametrize("attempt", ATTEMPTS)
def test_a_grasp_seen_from_elsewhere_is_the_same_grasp(attempt: Attempt) -> None:
    rng = np.random.default_rng(3)
    contacts, forces, y = around(rng, 4), rng.normal(size=(4, 4)), rng.normal(size=6)
    seen = pushed(attempt.contacts(contacts), forces)
    np.testing.assert_allclose(seen, attempt.wrench(pushed(contacts, forces)), atol=1e-14)
    assert y @ seen == pytest.approx(attempt.back(y) @ pushed(contacts, forces), abs=1e-13)


@pytest.mark.slow
@pytest.mark.parametrize("objective", [Objective.MIN_EFFORT, Objective.MIN_PEAK])
def test_load_factor_and_feasibility_agree_on_six_hundred_grasps(objective: Objective) -> None:
    for family, contacts, load in instances(5, 30):
        n = len(contacts)
        answer = solver(n, objective).solve(contacts, load)
        bounded = contacts.copy()
        bounded[:, 15] = np.minimum(bounded[:, 15], 1e4)
        factor = solver(n, Objective.LOAD_FACTOR).solve(bounded, load)
        if answer.status is SOLVED:
            assert_optimal(objective, contacts, load, answer)
        if factor.status is not SOLVED:
            continue  # f_min alone cannot be balanced
        if factor.theta <= 0.999:
            assert answer.status is INFEASIBLE, family
            assert answer.certificate is not None
            assert_proof(contacts, load, answer.certificate)
        elif factor.theta >= 1.0001:
            assert answer.status is SOLVED, family


@pytest.mark.parametrize("objective", Objective)
def test_spin_about_the_line_of_two_fingers_is_borne_by_e_alone(objective: Objective) -> None:
    mu, e = 0.4, 0.1
    for spin in (0.5, 0.99, 0.999, 1.001, 1.01):
        contacts, load = antipodal(mu, e, spin)
        answer = solver(2, objective).solve(contacts, load)
        press = contacts[0, 15]
        if objective is Objective.LOAD_FACTOR:
            assert answer.theta == pytest.approx(1.0 / spin, rel=1e-8)
        elif objective is Objective.MAX_MARGIN:
            assert answer.theta == pytest.approx(mu * press * (1.0 - spin), rel=1e-7)
        elif spin > 1.0:
            assert answer.status is INFEASIBLE
        else:
            np.testing.assert_allclose(answer.forces[:, 0], spin * press, rtol=1e-8)


@pytest.mark.parametrize("beyond", [-0.25, 0.25])
def test_a_limit_is_exceeded_in_units_of_the_load_however_large_it_is(beyond: float) -> None:
    problem = ContactProblem(state_contact(Objective.MIN_EFFORT))
    row = np.array(contact(np.zeros(3), np.array([0.0, 0.0, 1.0]), 0.2, 0.5, hi=1000.0))
    data = problem.prepared()(row, np.zeros((0, 1)), np.zeros((0, 1)), 1.0)[0]
    point = np.ones(problem.point.size)
    point[problem.point.where["v"]] = [0.5 * (1000.0 + beyond), 0.0, 0.0, 0.0]
    point[problem.point.where["s"]] = [1000.0 + beyond, 1e-9]
    still = np.zeros(problem.steps.size)
    worst = np.array(problem.moved()(data, point, still, 0.0, np.zeros(6), 0.0, 1.0)[2]).ravel()
    assert worst[1] == pytest.approx(max(beyond, abs(beyond) / 1000.0), rel=1e-5)


@pytest.mark.parametrize("objective", Objective)
def test_units_of_force_do_not_matter(objective: Objective) -> None:
    rng = np.random.default_rng(2)
    contacts = around(rng, 4, hi=4.0)
    contacts[:, 14] = 0.1
    load = held(rng, contacts, 0.5)
    one = solver(4, objective).solve(contacts, load)
    for unit_of_force in (2.0**-10, 1e-3, 1e-2, 1e2, 1e3, 2.0**10):
        scaled = contacts.copy()
        scaled[:, 14:16] *= unit_of_force
        answer = solver(4, objective).solve(scaled, unit_of_force * load)
        assert answer.status is SOLVED
        if np.log2(unit_of_force).is_integer():  # then not even rounding differs
            assert answer.iterations == one.iterations
        if objective is Objective.MIN_EFFORT:  # of the others theta alone is unique
            np.testing.assert_allclose(answer.forces, unit_of_force * one.forces, atol=1e-7 * unit_of_force)
        unit_of_theta = 1.0 if objective is Objective.LOAD_FACTOR else unit_of_force
        assert answer.theta == pytest.approx(unit_of_theta * one.theta, rel=1e-8)
        assert_optimal(objective, scaled, unit_of_force * load, answer)


def test_rotating_everything_changes_nothing() -> None:
    rng = np.random.default_rng(4)
    contacts = around(rng, 3)
    load = held(rng, contacts, 0.6)
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    turn *= np.linalg.det(turn)
    turned = contacts.copy()
    turned[:, :12] = (contacts[:, :12].reshape(-1, 4, 3) @ turn.T).reshape(-1, 12)
    again = np.concatenate([turn @ load[:3], turn @ load[3:]])
    a = solver(3, Objective.MIN_EFFORT).solve(contacts, load)
    b = solver(3, Objective.MIN_EFFORT).solve(turned, again)
    np.testing.assert_allclose(a.forces, b.forces, atol=1e-7)


@pytest.mark.slow
@pytest.mark.parametrize("objective", Objective)
def test_actuator_limits_bind_or_make_it_impossible(objective: Objective) -> None:
    rng = np.random.default_rng(8)
    solved = bound = 0
    for _ in range(8):
        contacts = around(rng, 3, hi=5.0)
        load = held(rng, contacts, 0.5)
        rows = rng.normal(size=(3, 2, 4))
        free = solver(3, objective).solve(contacts, load)
        limits = 0.97 * np.abs(np.einsum("nkj,nj->nk", rows, free.forces)) + 1e-3
        limits[0, 0] = np.inf
        answer = solver(3, objective, 2).solve(contacts, load, rows, limits)
        assert answer.status in (SOLVED, INFEASIBLE)
        if answer.status is not SOLVED:
            continue
        solved += 1
        loaded = np.abs(np.einsum("nkj,nj->nk", rows, answer.forces))
        assert (loaded <= limits + 1e-8 * np.maximum(limits, 1.0)).all()
        bound += bool((loaded >= limits - 1e-6)[np.isfinite(limits)].any())
        assert_optimal(objective, contacts, load, answer, rows, limits)
        # infinite limits are none at all
        none = solver(3, objective, 2).solve(contacts, load, rows, np.full((3, 2), np.inf))
        assert none.theta == pytest.approx(free.theta, rel=1e-6, abs=1e-7)
    assert solved >= 4
    assert bound >= 3


def test_actuators_are_given_if_and_only_if_it_was_built_for_them() -> None:
    rng = np.random.default_rng(8)
    contacts = around(rng, 3, hi=5.0)
    load, rows, limits = held(rng, contacts, 0.5), rng.normal(size=(3, 2, 4)), np.ones((3, 2))
    with_two, without = solver(3, Objective.MIN_EFFORT, 2), solver(3, Objective.MIN_EFFORT)
    with_two.solve(contacts, load, rows, limits)
    for given in ((), (rows,), (None, limits), (rows[:, :1], limits[:, :1]), (rows[:2], limits[:2])):
        with pytest.raises(InvalidValueError, match="built for 3 contacts with 2 actuators"):
            with_two.solve(contacts, load, *given)
    with pytest.raises(InvalidValueError, match="or none"):
        without.solve(contacts, load, rows, limits)


def test_nothing_to_hold_needs_nothing() -> None:
    contacts = around(np.random.default_rng(1), 3)
    answer = solver(3, Objective.MIN_EFFORT).solve(contacts, np.zeros(6))
    assert answer.status is SOLVED
    np.testing.assert_allclose(answer.forces, 0.0, atol=1e-6)
    assert solver(3, Objective.MIN_PEAK).solve(contacts, np.zeros(6)).theta == pytest.approx(0.0, abs=1e-8)


def test_theta_without_end_is_reported() -> None:
    # two fingers against each other press without limit: no largest margin, no largest load
    contacts, load = antipodal(0.5, 0.2, 0.5)
    contacts[:, 15] = np.inf
    for objective in (Objective.MAX_MARGIN, Objective.LOAD_FACTOR):
        answer = solver(2, objective).solve(contacts, load)
        assert answer.status is InteriorPointStatus.UNBOUNDED
        rest = load if objective is Objective.LOAD_FACTOR else np.zeros(6)
        np.testing.assert_allclose(pushed(contacts, answer.forces), -rest, atol=1e-8)
        used = np.linalg.norm(answer.forces[:, 1:], axis=1)
        assert (0.5 * answer.forces[:, 0] - used >= (objective is Objective.MAX_MARGIN) - 1e-8).all()


def test_least_violation_is_a_margin_below_zero() -> None:
    contacts, load = antipodal(0.5, 0.2, 1.5)
    answer = solver(2, Objective.MAX_MARGIN).solve(contacts, load)
    violation = np.linalg.norm(answer.forces[:, 1:], axis=1) - 0.5 * answer.forces[:, 0]
    np.testing.assert_allclose(violation, -answer.theta, rtol=1e-6)
    assert answer.theta < 0.0


def test_a_hundred_contacts_take_hardly_more_iterations() -> None:
    rng = np.random.default_rng(6)
    contacts = around(rng, 100)
    load = unit(rng, 6)
    answer = solver(100, Objective.MIN_PEAK).solve(contacts, load)
    assert answer.status is SOLVED
    assert answer.iterations <= 25
    assert_optimal(Objective.MIN_PEAK, contacts, load, answer)


@pytest.fixture
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    return tmp_path / "palpate" / "grasp"


def square() -> casadi.Function:
    x = casadi.SX.sym("x")
    return casadi.Function("square", [x], [x * x])


@pytest.mark.slow
def test_machine_code_gives_the_same_bits(cache: Path) -> None:
    if Compiled().compiler is None:
        pytest.skip("no C compiler here")
    contacts = np.array([contact([-1.0, 0, 0], [1, 0, 0], 0.2, 0.5), contact([1.0, 0, 0], [-1, 0.1, 0], 0.2, 0.5)])
    load = np.array([0.0, 0.3, 0.1, 0.02, 0.0, 0.0])
    quick = InteriorPoint(2, Objective.MIN_EFFORT, executor=Compiled())
    assert len(list(cache.iterdir())) == 1
    a, b = quick.solve(contacts, load), solver(2, Objective.MIN_EFFORT).solve(contacts, load)
    np.testing.assert_array_equal(a.forces, b.forces)


def test_machine_code_is_kept(cache: Path) -> None:
    if Compiled().compiler is None:
        pytest.skip("no C compiler here")
    assert cache_folder() == cache
    (quick,) = Compiled().prepare([square()])
    assert quick.class_name() != square().class_name()
    assert float(quick(3.0)) == 9.0
    (library,) = cache.iterdir()
    made = library.stat().st_mtime_ns
    Compiled().prepare([square()])
    assert library.stat().st_mtime_ns == made


@pytest.mark.parametrize("trouble", ["no compiler", "compiler fails", "no room", "spoilt"])
def test_without_machine_code_it_still_works(trouble: str, cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    executor = Compiled()
    if trouble == "no compiler":
        executor = Compiled(compiler="no-such-compiler")
    elif trouble == "compiler fails":
        monkeypatch.setattr(compiled, "FLAGS", ("--no-such-flag",))
    elif trouble == "no room":
        cache.parent.write_text("a file where a folder should be")
    elif executor.compiler is not None:
        folder = cache / "made"
        Compiled(folder=folder).prepare([square()])
        (library,) = folder.iterdir()
        cache.joinpath(library.name).write_bytes(library.read_bytes()[:100])
    (found,) = executor.prepare([square()])
    assert float(found(3.0)) == 9.0
    if trouble == "spoilt" and executor.compiler is not None:
        assert cache.joinpath(library.name).read_bytes() == library.read_bytes()


@pytest.mark.slow
@pytest.mark.parametrize("objective", Objective)
def test_nothing_proves_that_a_load_that_is_held_cannot_be(objective: Objective) -> None:
    rng = np.random.default_rng(9)
    value = proof_value(3, objective, 1)
    closest = -np.inf
    for i in range(300):
        contacts = around(rng, 3, hi=2.0)
        contacts[:, 14] = 0.3
        f = rng.uniform(0.3, 2.0, 3)
        u = np.array([unit(rng) for _ in range(3)]) * (0.5 * f)[:, None]
        forces = np.column_stack([f, u])
        load, rows = -pushed(contacts, forces), rng.normal(size=(3, 4))
        limits = np.abs(np.einsum("nj,nj->n", rows, forces))
        # at these forces friction, bounds and actuators leave nothing: the hardest y has them as its least
        y = rng.normal(size=6)
        if i % 2:
            contacts[:, 14] = contacts[:, 15] = f
            y = -np.linalg.lstsq(pushes(contacts)[0].T, [1.0, *(-2.0 * u[0])], rcond=None)[0]
        z = rng.exponential(size=(3, 2)) * (i % 3 == 0)
        closest = max(closest, float(value(contacts.T, load, rows.T, limits[None], y, z.T)))
    assert closest <= 1e-12


@pytest.mark.parametrize("objective", Objective)
def test_of_what_actuators_just_hold_a_proof_is_exactly_worth_nothing(objective: Objective) -> None:
    """Each actuator bears all that y asks of its contact, at its limit: a limit any lower would be a proof."""
    rng = np.random.default_rng(10)
    value, tried = proof_value(3, objective, 1), 0
    while tried < 50:
        contacts, y = around(rng, 3, hi=10.0), rng.normal(size=6)
        rows = np.einsum("nij,i->nj", pushes(contacts), y)
        forces = np.column_stack([rng.uniform(0.5, 3.0, 3), 0.05 * rng.normal(size=(3, 3))])
        loaded = np.einsum("nj,nj->n", rows, forces)
        if (loaded >= 0.0).any():
            continue
        tried += 1
        worth = []
        for share in (0.999, 1.0, 1.001):
            limits = -share * loaded
            z = np.column_stack([np.zeros(3), np.maximum(limits, 1.0)])  # rows are over their limits, or 1
            worth.append(float(value(contacts.T, -pushed(contacts, forces), rows.T, limits[None], y, z.T)))
        assert worth[0] > 0.0
        assert abs(worth[1]) <= 1e-13 * np.abs(loaded).sum()
        assert worth[2] < 0.0
