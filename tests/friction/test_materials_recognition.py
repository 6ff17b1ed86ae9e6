"""Materials told apart by touch: Bayes by brute force, order, scale, bounds, and tests that keep their rate."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from material_touches import drawn_touches
from scipy.special import softmax
from scipy.stats import binom, multivariate_normal

from palpate.estimation import Assumption
from palpate.friction.materials.recognition import RecognitionOutcome, recognise
from palpate.friction.materials.recognition_checks import recognition_verdict
from palpate.friction.materials.touch_evidence import NeverSlipped, TouchEvidence
from palpate.friction.rubbing.slip_load import SlipLoad
from palpate.friction.rubbing.stroke_plan import PlannedSlip
from palpate.friction.rubbing.surface_fit import fit_limit_surface
from palpate.sim.friction.law import FrictionLaw
from support.made_up_materials import EXACT, library, material, spread

STROKE, TWIST, FIRM_TWIST = PlannedSlip(2.0, 0.02, 0.0), PlannedSlip(2.0, 0.0, 3.0), PlannedSlip(5.0, 0.0, 3.0)

THREE = library(material("a", 0.4), material("b", 0.44, 2.5e-3, 0.3), material("c", 0.5, scatter=0.06))


def mixed_touches(seed, count):
    """Touches of "b" drawn at random."""
    rng = np.random.default_rng(seed)
    slips = [(STROKE, TWIST, FIRM_TWIST)[i] for i in rng.integers(3, size=count)]
    return drawn_touches(THREE.materials[1], slips, rng)


def stroke(mu, error=0.004, speed=0.02):
    return TouchEvidence.stroke(mu, error, speed)


@given(st.integers(0, 2**32 - 1), st.integers(1, 6))
@settings(deadline=None, max_examples=30)
def test_the_posterior_is_that_of_one_big_normal_over_all_touches(seed, count):
    """All logarithms at once: covariance H B H' + blocks of scatter and sensor."""
    touches, prior = mixed_touches(seed, count), {"a": 2.0, "b": 1.0, "c": 0.5}
    found = recognise(THREE, touches, prior, false_rejection=1e-300, calibration=0.0)
    H = np.vstack([touch.rows for touch in touches])
    y = np.concatenate([touch.values for touch in touches])
    R = np.diag([touch.covariance[0, 0] for touch in touches])
    log_weights = []
    for each in THREE.materials:
        S = np.eye(count) * (H @ np.diag(each.scatter.variances) @ H.T)
        C = H @ np.diag(each.specimen.variances) @ H.T + S + R
        log_weights.append(math.log(prior[each.name]) + multivariate_normal(H @ each.parameters, C).logpdf(y))
    np.testing.assert_allclose(found.posterior, softmax(log_weights), rtol=1e-6, atol=1e-12)


@given(st.integers(0, 2**32 - 1))
@settings(deadline=None, max_examples=20)
def test_the_order_of_touches_does_not_matter(seed):
    touches = [*mixed_touches(seed, 6), NeverSlipped.stroke(0.41), NeverSlipped.twist(1e-3, 2.0)]
    order = np.random.default_rng(seed).permutation(len(touches))
    one, other = recognise(THREE, touches), recognise(THREE, [touches[i] for i in order])
    np.testing.assert_allclose(one.posterior, other.posterior, rtol=1e-9, atol=1e-300)
    np.testing.assert_allclose(one.fit, other.fit, rtol=1e-9, atol=1e-300)
    assert one.outcome is other.outcome


@given(st.floats(0.1, 5.0), st.floats(0.1, 5.0), st.integers(0, 2**32 - 1))
@settings(deadline=None, max_examples=20)
def test_only_ratios_of_friction_and_of_lengths_count(by_friction, by_length, seed):
    """Without speed dependence speeds do not matter."""
    touches, logs = mixed_touches(seed, 4), np.array([math.log(by_friction), math.log(by_length), 0.0, 0.0])
    scaled = library(
        *(
            material(m.name, m.kinetic_friction * by_friction, m.spin_length * by_length, m.load_exponent,
                     m.norm_exponent, m.scatter.friction)
            for m in THREE.materials
        )
    )  # fmt: skip
    moved = [
        TouchEvidence(t.values + t.rows @ logs, t.rows, t.covariance, t.speed, t.spin, t.normal_force)
        for t in touches
    ]
    one, other = recognise(THREE, touches), recognise(scaled, moved)
    np.testing.assert_allclose(one.posterior, other.posterior, rtol=1e-7, atol=1e-12)
    np.testing.assert_allclose(one.fit, other.fit, rtol=1e-7, atol=1e-12)


def test_the_deviation_of_a_specimen_is_not_averaged_away():
    """Half-way between two whose specimens differ by more than that, no number of touches decides."""
    both = library(*(material(name, mu, specimen=spread(0.1)) for name, mu in (("a", 0.4), ("b", 0.44))))
    half = material("half", math.sqrt(0.4 * 0.44), specimen=EXACT)
    found = recognise(both, drawn_touches(half, [STROKE] * 1000, np.random.default_rng(0)))
    assert found.outcome is RecognitionOutcome.UNDECIDED
    assert found.posterior.min() > 0.4


# 4 standard deviations of chance above the promised rate
@pytest.mark.slow
@pytest.mark.parametrize("slips", [[STROKE], [STROKE, TWIST, FIRM_TWIST], [STROKE] * 8, [TWIST, FIRM_TWIST] * 3])
def test_the_true_material_is_refused_as_rarely_as_promised(slips):
    rng, rate, trials = np.random.default_rng(len(slips)), 0.05, 300
    alone = library(THREE.materials[1])
    refused = sum(
        recognise(alone, drawn_touches(alone.materials[0], slips, rng), false_rejection=rate).outcome
        is RecognitionOutcome.UNKNOWN
        for _ in range(trials)
    )
    assert binom.sf(refused - 1, trials, rate) > 3e-5
    # not much more cautious than that either: at most two tests share the rate
    assert refused > 0.25 * rate * trials


FIRST = library(THREE.materials[0])


def alternating(off):
    """Strokes on average as "a", as two surfaces on one object."""
    return [stroke(0.4 * math.exp(sign * off)) for sign in (1.0, -1.0) * 4]


OUTCOMES = {
    "another friction": (THREE, [stroke(0.9)] * 3, RecognitionOutcome.UNKNOWN),
    "another length": (THREE, [TouchEvidence.twist(0.4 * 6e-3, 0.004, 2.0, 3.0)] * 3, RecognitionOutcome.UNKNOWN),
    "one surface": (FIRST, alternating(0.0), RecognitionOutcome.RECOGNISED),
    "two surfaces": (FIRST, alternating(0.12), RecognitionOutcome.UNKNOWN),
    "no touch": (FIRST, [], RecognitionOutcome.UNDECIDED),
    "a bound of 0": (FIRST, [NeverSlipped.stroke(0.0)], RecognitionOutcome.UNDECIDED),
    "a bound above all": (THREE, [NeverSlipped.stroke(2.0)], RecognitionOutcome.UNKNOWN),
}


@pytest.mark.parametrize("name", OUTCOMES)
def test_outsiders_fit_nothing_by_place_or_by_scatter(name):
    known, touches, outcome = OUTCOMES[name]
    assert recognise(known, touches).outcome is outcome


def test_an_error_of_calibration_that_all_touches_share_makes_nothing_unknown():
    """Without touches the prior stays."""
    exact, off = library(material("a", 0.4, specimen=EXACT)), [stroke(0.4 * 1.005)] * 400
    assert recognise(exact, off, calibration=0.003).fit[0] > 0.05
    assert recognise(exact, off, calibration=0.0).outcome is RecognitionOutcome.UNKNOWN
    found = recognise(THREE, [], {"a": 3.0, "c": 1.0})
    np.testing.assert_allclose(found.posterior, [0.75, 0.0, 0.25])
    assert (found.fit == 1.0).all()


def test_a_contact_that_never_slipped_only_rules_out_less_friction():
    """Holding it again is no new evidence; a bound is one of static friction."""
    weak, strong = material("weak", 0.2), material("strong", 0.8)
    both = library(weak, strong)
    found = [recognise(both, [NeverSlipped.stroke(mu)]).posterior[0] for mu in (0.05, 0.5, 0.7)]
    assert found == pytest.approx([0.5, 0.0, 0.0], abs=1e-6)
    once, often = (recognise(both, [NeverSlipped.stroke(0.205)] * n) for n in (1, 50))
    np.testing.assert_allclose(once.posterior, often.posterior)
    assert 0.1 < once.posterior[0] < 0.4
    turned = recognise(both, [NeverSlipped.twist(0.5 * weak.spin_length_at(4.0), 4.0)])
    assert turned.posterior[1] > 0.999
    slow, even = library(material("slow", 0.3, static_friction=0.6)), library(material("even", 0.3))
    assert recognise(slow, [NeverSlipped.stroke(0.55)]).fit[0] > 0.5
    assert recognise(even, [NeverSlipped.stroke(0.55)]).fit[0] < 1e-6


def test_speeds_separate_friction_that_grows_from_friction_that_does_not():
    even, film = material("even", 0.5), material("film", 0.45, viscous_friction=2.5)
    both, at_one = library(even, film), stroke(0.5)
    assert film.friction_at(0.02) == even.friction_at(0.02)
    np.testing.assert_allclose(recognise(both, [at_one]).posterior, 0.5)
    assert recognise(both, [at_one, stroke(0.7, speed=0.1)]).best == "film"
    # a twist slips as fast as e omega, with e of its load
    for force in (0.5, 2.0, 8.0):
        e = film.spin_length_at(force)
        turned = recognise(both, [at_one, TouchEvidence.twist(0.7 * e, 0.004, force, 0.1 / e)])
        assert turned.outcome is RecognitionOutcome.RECOGNISED
        np.testing.assert_allclose(turned.known.mean[1], film.parameters, rtol=1e-9)


def test_a_fitted_surface_separates_materials_that_differ_in_p_alone():
    round_one, diamond = material("round", 0.5, p=1.9), material("diamond", 0.5, p=1.2)
    law = FrictionLaw(0.5, 0.5, spin_length=3e-3, load_exponent=0.1, norm_exponent=1.2)
    kinds = ((0.02, 0.0), (0.0, 0.02), (0.014, 0.014), (0.014, 0.018), (0.018, 0.014))
    slips = [(force, v, w / law.spin_length_at(force)) for force in (1.0, 4.0) for v, w in kinds]
    loads = [SlipLoad(slip[0], *law.slipping_load(*slip), *slip[1:]) for slip in slips]
    fitted = fit_limit_surface(loads, scatter=0.02)
    found = recognise(library(round_one, diamond), [TouchEvidence.of_fit(fitted, 0.02)])
    assert found.best == "diamond"
    assert found.outcome is RecognitionOutcome.RECOGNISED


@pytest.mark.parametrize(
    ("touches", "assumption"),
    [
        ([0.7] * 3, None),
        ([0.42] * 3, Assumption.UNIQUE),
        ([1.2] * 3, Assumption.NOISE_LEVEL),
        ([0.7, 0.7, 0.7, 0.6], Assumption.EVEN_INFLUENCE),
        ([], Assumption.ENOUGH_DATA),
    ],
    ids=["plain", "between a and b", "a stranger", "one touch that is off", "no touch"],
)
def test_the_verdict_names_why_a_material_is_not_to_be_relied_on(touches, assumption):
    known, felt = (
        library(material("a", 0.4), material("b", 0.44), material("c", 0.7)),
        [stroke(mu, 0.01) for mu in touches],
    )
    verdict = recognition_verdict(recognise(known, felt), felt)
    assert verdict.ok if assumption is None else verdict.breaks(assumption), verdict
