"""Tests of residuals: their p-values are uniform where residuals are white, and small where they are not."""

import numpy as np
import pytest

from palpate.errors import InvalidValueError
from palpate.estimation import HELD, Assumption, BrokenAssumption, Verdict
from palpate.estimation.whiteness import white_in_direction, white_in_place, white_in_time

RUNS = 400


def directions(rng, n, d):
    u = rng.normal(size=(n, d))
    return u / np.linalg.norm(u, axis=1, keepdims=True)


TESTS = {
    "time": lambda rng, n, white, offset: white_in_time(white + offset * np.linspace(-1.7, 1.7, n)),
    "place": lambda rng, n, white, offset: (
        lambda at: white_in_place(at, white + offset * np.sin(6.0 * at[:, 0]) * 1.4)
    )(rng.uniform(size=(n, 2))),
    "direction": lambda rng, n, white, offset: (lambda u: white_in_direction(u, white + offset * 1.7 * u[:, 0]))(
        directions(rng, n, 3)
    ),
    "plane": lambda rng, n, white, offset: (
        lambda u: white_in_direction(u, white + offset * 2.0 * u[:, 0] * u[:, 1] * 1.4)
    )(directions(rng, n, 2)),
}


@pytest.mark.parametrize("name", TESTS)
@pytest.mark.parametrize("n", [30, 200])
def test_white_residuals_are_rarely_called_dependent(name, n):
    rng = np.random.default_rng(1)
    p = np.array([TESTS[name](rng, n, rng.normal(size=n), 0.0) for _ in range(RUNS)])
    for level in (0.01, 0.05, 0.2):
        assert np.mean(p < level) <= level + 3.0 * np.sqrt(level * (1 - level) / RUNS) + 0.01


@pytest.mark.parametrize("name", TESTS)
def test_what_is_as_large_as_the_noise_is_found(name):
    """With 100 data, at 1e-3, nine times out of ten."""
    rng = np.random.default_rng(2)
    p = np.array([TESTS[name](rng, 100, rng.normal(size=100), 1.0) for _ in range(100)])
    assert np.mean(p < 1e-3) > 0.9


def test_too_few_are_refused():
    with pytest.raises(InvalidValueError, match="8 finite rows"):
        white_in_time([1.0, 2.0])
    with pytest.raises(InvalidValueError, match="as many"):
        white_in_place(np.zeros((9, 2)), np.zeros(10))


def test_a_verdict_says_what_broke_by_how_much_and_what_to_do():
    drift = BrokenAssumption(Assumption.WHITE_IN_TIME, "lag-1 correlation 0.83, at most 0.2", "tare in between")
    verdict = HELD.and_also([drift])
    assert HELD.ok
    assert not verdict.ok
    assert verdict.breaks(Assumption.WHITE_IN_TIME)
    assert not verdict.breaks(Assumption.CONVERGED)
    assert str(verdict) == (
        "not so that residuals do not depend on time: lag-1 correlation 0.83, at most 0.2; tare in between"
    )
    assert Verdict().and_also(verdict) == verdict
