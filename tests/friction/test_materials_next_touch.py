"""The next best touch: information as it must be, what it prefers, and when it says enough."""

import itertools
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from material_touches import drawn_touches
from scipy.integrate import quad
from scipy.stats import norm

from palpate.friction.materials.library import simulated_materials
from palpate.friction.materials.next_touch import Advice, candidate_touches, expected_bits, next_touch, touch_error
from palpate.friction.materials.recognition import recognise
from palpate.friction.materials.touch_evidence import TouchEvidence
from palpate.friction.materials.touch_sums import speed_shifts
from palpate.friction.materials.trials import UNKNOWN, confusion
from palpate.friction.rubbing.estimate import SensorErrors
from palpate.friction.rubbing.stroke_plan import PlannedSlip
from support.made_up_materials import EXACT, library, material, spread

CANDIDATES = candidate_touches((1.5, 5.0), (0.005, 0.02, 0.1), (2.0,))
LIBRARY = simulated_materials()
NAMED = dict(zip(LIBRARY.names, LIBRARY.materials, strict=True))


def of(*names):
    return library(*(NAMED[name] for name in names))


def two(apart, scatter=0.02):
    """A library of two materials whose frictions differ by a factor of exp(apart)."""
    deviations = {"scatter": spread(scatter), "specimen": EXACT}
    return library(
        *(
            material(name, mu, gamma=0.0, p=2.0, **deviations)
            for name, mu in (("low", 0.4), ("high", 0.4 * math.exp(apart)))
        )
    )


def stroke(mu):
    return TouchEvidence.stroke(mu, 0.004, 0.02)


@given(st.integers(0, 2**32 - 1), st.integers(0, 3))
@settings(deadline=None, max_examples=25)
def test_a_touch_never_tells_more_than_is_not_known_nor_less_than_nothing(seed, count):
    rng = np.random.default_rng(seed)
    source = LIBRARY.materials[int(rng.integers(len(LIBRARY.materials)))]
    slips = [CANDIDATES[i] for i in rng.integers(len(CANDIDATES), size=count)]
    found = recognise(LIBRARY, drawn_touches(source, slips, rng))
    weights = np.append((1 - found.stranger) * found.posterior, found.stranger)
    doubt = -sum(w * math.log2(w) for w in weights if w > 0.0)
    for slip in CANDIDATES:
        assert 0.0 <= expected_bits(found, slip) <= doubt + 1e-3  # of the quadrature


@pytest.mark.parametrize("apart", [0.0, 0.02, 0.08, 0.3])
def test_information_is_the_entropy_of_the_mixture_less_that_of_its_parts(apart):
    found, slip = recognise(two(apart), [], calibration=0.0), PlannedSlip(2.0, 0.02, 0.0)
    w, m = np.append(0.9 * found.posterior, 0.1), found.known.mean[:, 0]
    sd = np.sqrt(found.known.covariance[:, 0, 0] + 0.02**2 + touch_error(slip, np.exp(m), SensorErrors()) ** 2)

    def density(y):
        return float(w @ norm.pdf(y, m, sd))

    ends = sorted({*m, *(m + 5 * sd), *(m - 5 * sd), m[-1] - 8.0 * sd[-1], m[-1] + 8.0 * sd[-1]})
    pieces = [
        quad(lambda y: -density(y) * math.log2(density(y)), a, b, limit=200)[0]
        for a, b in itertools.pairwise(ends)
    ]
    parts = float(w @ (0.5 * np.log2(2 * math.pi * math.e * sd**2)))
    assert expected_bits(found, slip) == pytest.approx(sum(pieces) - parts, abs=1e-3)


def test_it_looks_where_the_two_differ():
    def best(*names):
        return next_touch(recognise(of(*names), []), CANDIDATES).slip

    assert best("polished steel", "glazed tile").spin > 0.0
    light, firm = best("ABS", "cork"), best("cardboard", "greased aluminium")
    assert (light.spin, light.normal_force) == (2.0, 5.0)  # e is alike at 1 N
    assert firm.speed == 0.1
    found, weak = recognise(of("PTFE", "waxed wood"), []), SensorErrors(moment_drift=1e-4)
    firm, light = (expected_bits(found, PlannedSlip(force, 0.0, 2.0), weak) for force in (5.0, 0.3))
    assert firm > light


def test_noise_and_drift_count_by_the_load_that_they_are_on():
    errors, mu = SensorErrors(force_zero=0.0, calibration=0.0), np.array([0.2, 0.4])
    for slide, spin in ((0.02, 0.0), (0.0, 2.0)):
        light, firm = (touch_error(PlannedSlip(force, slide, spin), mu, errors) for force in (1.0, 4.0))
        np.testing.assert_allclose(light / firm, 4.0)
        np.testing.assert_allclose(light[0] / light[1], 2.0)


def test_more_scatter_tells_less():
    slip = PlannedSlip(2.0, 0.02, 0.0)
    bits = [expected_bits(recognise(two(0.08, scatter), []), slip) for scatter in (0.01, 0.03, 0.1)]
    assert bits[0] > bits[1] > bits[2] > 0.0


def test_enough_is_reported_when_it_is_known_unknown_or_inseparable():
    sure = next_touch(recognise(LIBRARY, [stroke(NAMED["PTFE"].friction_at(0.02))]), CANDIDATES)
    assert (sure.advice, sure.slip) == (Advice.RECOGNISED, None)
    assert next_touch(recognise(LIBRARY, [stroke(2.0)]), CANDIDATES).advice is Advice.UNKNOWN
    # touched often: both alike
    alike = recognise(two(1e-4), [stroke(0.4), TouchEvidence.twist(0.4 * 3e-3, 0.004, 2.0, 3.0)] * 5)
    assert next_touch(alike, CANDIDATES).advice is Advice.NOTHING_TELLS
    fresh = next_touch(recognise(two(1e-4), []), CANDIDATES)
    assert fresh.advice is Advice.TOUCH  # a stranger would differ
    assert len(fresh.bits) == len(CANDIDATES)


def test_the_most_telling_touches_recognise_every_material_of_the_library():
    rng, wrong, most = np.random.default_rng(5), 0, 0
    for source in LIBRARY.materials:
        for _ in range(5):
            specimen = source.parameters + np.sqrt(source.specimen.variances) * rng.normal(size=4)
            touches, slip = [], next_touch(recognise(LIBRARY, []), CANDIDATES).slip
            while slip is not None:
                touches += drawn_touches(source, [slip], rng, specimen=specimen)
                found = recognise(LIBRARY, touches)
                slip = next_touch(found, CANDIDATES).slip
            most, wrong = max(most, len(touches)), wrong + (found.best != source.name)
    assert wrong <= 4
    assert most <= 8


def test_a_confusion_matrix_counts_every_case_once():
    rng, slips = np.random.default_rng(0), [PlannedSlip(2.0, 0.02, 0.0), PlannedSlip(2.0, 0.0, 3.0)]
    trials = confusion(
        LIBRARY,
        [(m.name, recognise(LIBRARY, drawn_touches(m, slips, rng))) for m in LIBRARY.materials for _ in range(5)],
    )
    assert trials.truths == LIBRARY.names
    assert trials.predictions == (*LIBRARY.names, UNKNOWN)
    assert (trials.counts.sum(axis=1) == 5).all()
    np.testing.assert_allclose(trials.shares.sum(axis=1), 1.0)
    assert trials.right > 0.8
    odd = recognise(LIBRARY, [stroke(2.0)])
    both = confusion(LIBRARY, [("brick", odd), ("PTFE", odd), ("brick", odd)])
    assert both.truths == (*LIBRARY.names, "brick")
    assert (both.counts[-1, -1], both.counts[0, -1]) == (2, 1)
    assert both.right == pytest.approx(2 / 3)
    assert np.isnan([*both.shares[1], confusion(LIBRARY, []).right]).all()


def test_speed_shifts_are_those_of_the_materials_and_none_of_a_stranger():
    shifts = [math.log(each.static_friction / each.kinetic_friction) for each in LIBRARY.materials]
    assert speed_shifts(LIBRARY, 0.0, 0.0, 1.0) == pytest.approx([*shifts, 0.0])
