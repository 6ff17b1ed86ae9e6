"""Touches drawn again, of another object: they come as the library says, and confuse what is alike."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.friction.materials.touch_evidence import STROKE_ROW, TouchEvidence, twist_row
from palpate.friction.materials.trials import confusion_of_touches, drawn_again
from support.made_up_materials import library, spread
from support.made_up_materials import material as made_up


def material(name, mu, e=3e-3, scatter=0.02, specimen=0.01, **more):
    return made_up(name, mu, e, scatter=spread(scatter), specimen=spread(specimen), **more)


def made(error=0.004, speed=0.01):
    """A stroke and two twists at one place, as one touch."""
    rows = np.array([STROKE_ROW, twist_row(1.0), twist_row(4.0)])
    return TouchEvidence(np.zeros(3), rows, error**2 * np.eye(3), speed)


def test_touches_drawn_again_have_the_materials_mean_and_all_of_its_spread():
    """What a place has of its own, all its rubs share: H (S + B) H' + R, with the calibration's in B."""
    steel, touch = material("steel", 0.4, specimen=0.015, static_friction=0.5), made()
    rng = np.random.default_rng(1)
    drawn = np.array([drawn_again(steel, [touch], rng, calibration=0.01)[0].values for _ in range(4000)])
    mean = touch.rows @ steel.parameters + np.log(steel.friction_at(0.01) / 0.4)
    # calibration is of two loads each: of ln mu and ln c
    spread = np.diag([0.02**2 + 0.015**2 + 0.01**2] * 2 + [0.0, 0.0])
    covariance = touch.rows @ spread @ touch.rows.T + touch.covariance
    np.testing.assert_allclose(drawn.mean(axis=0), mean, atol=5.0 * np.sqrt(np.diag(covariance).max() / 4000))
    np.testing.assert_allclose(np.cov(drawn.T), covariance, atol=0.1 * covariance.max())


def test_a_specimen_is_the_same_in_all_its_touches_and_its_scatter_is_not():
    rng = np.random.default_rng(2)
    several = [made(1e-6)] * 4
    own = drawn_again(material("own", 0.4, scatter=1e-6, specimen=0.1), several, rng, 0.0)
    each = drawn_again(material("each", 0.4, scatter=0.1, specimen=0.0), several, rng, 0.0)
    assert np.ptp([touch.values[0] for touch in own]) < 1e-4
    assert np.ptp([touch.values[0] for touch in each]) > 0.02


@settings(deadline=None, max_examples=10)
@given(st.integers(0, 2**32 - 1))
def test_the_same_seed_gives_the_same_matrix_and_the_values_of_the_touches_do_not_matter(seed):
    both = library(*(material("a", 0.4), material("b", 0.43)))
    felt = made()
    other = TouchEvidence(felt.values + 7.0, felt.rows, felt.covariance, felt.speed)
    first, again = (
        confusion_of_touches(both, [touch], 10, np.random.default_rng(seed)).counts for touch in (felt, other)
    )
    np.testing.assert_array_equal(first, again)
    assert first.sum() == 20


def test_materials_alike_are_confused_half_the_time_others_never():
    alike = (material("a", 0.4), material("as a", 0.4), material("far", 0.8))
    found = confusion_of_touches(library(*alike), [made()], 200, np.random.default_rng(3))
    shares = found.shares
    assert found.truths == ("a", "as a", "far")
    assert shares[2, 2] > 0.97
    assert shares[:2, 2].max() == shares[2, :2].max() == 0.0
    # of two that are the very same the first is the likeliest
    assert shares[:2, :2].sum(axis=1) == pytest.approx([1.0, 1.0], abs=0.03)
    assert shares[0, 0] == pytest.approx(shares[1, 0], abs=0.1)


def test_strokes_alone_cannot_tell_what_twists_do():
    two = library(*(material("a", 0.4), material("b", 0.4, e=3.6e-3)))
    stroke = TouchEvidence.stroke(0.4, 0.004, 0.01)
    blind, told = (
        confusion_of_touches(two, [touch], 100, np.random.default_rng(4)).right for touch in (stroke, made())
    )
    assert blind == pytest.approx(0.5, abs=0.12)
    assert told > 0.95
