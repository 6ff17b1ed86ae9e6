"""A hand's slip and what it learns of friction from it."""

import numpy as np
import pytest

from palpate.friction.contact_load import ContactLoad
from palpate.friction.limit_surface import LimitSurface
from palpate.friction.slip.belief import FrictionBelief
from palpate.friction.slip.fingers import FingerSlips, LearntSurface
from palpate.friction.slip.kinds import SlipKind
from support.ratio_detector import RatioDetector

PERIOD = 1e-3
TRUE = LimitSurface(0.5, 0.004)


def pulled(ratio, normal_force=3.0):
    return ContactLoad(normal_force, (0.0, ratio * TRUE.friction * normal_force, 0.0), 0.0)


def wide():
    return FrictionBelief(0.6, 0.004, friction_deviation=0.3, spin_length_deviation=0.4)


def learnt_from(ratios, onsets=()):
    """A surface learnt from loads over what the contact carries; slips are detected at `onsets`."""
    learnt, rng = LearntSurface(wide), np.random.default_rng(3)
    for k, ratio in enumerate(ratios):
        load = pulled(ratio + 0.02 * rng.standard_normal())
        learnt.watch(k * PERIOD, (load, load), (k in onsets, False))
    return learnt


def test_each_finger_reports_for_itself_and_only_when_slip_begins():
    """A missing finger reports nothing; a start forgets."""
    slips = FingerSlips(lambda: RatioDetector(TRUE))
    reports = [slips.step(k * PERIOD, (pulled(1.1 if 20 <= k < 60 else 0.3), pulled(0.3))) for k in range(100)]
    assert [k for k, (first, _) in enumerate(reports) if first] == [20]
    assert not any(second for _, second in reports)
    assert slips.kinds == (None, None)
    assert slips.step(0.1, (None, pulled(0.3))) == (False, False)
    for k in range(5):
        slips.step(0.101 + k * PERIOD, (None, pulled(1.1)))
    assert slips.kinds == (None, SlipKind.SLIDE)
    slips.start()
    assert slips.kinds == ()


def test_held_loads_raise_the_cautious_surface_but_never_beyond_the_largest():
    learnt, prior = learnt_from(np.linspace(0.0, 0.9, 1000)), LearntSurface(wide).surface(0)
    assert prior.friction < learnt.surface(1).friction < 0.95 * TRUE.friction
    learnt.start()
    assert learnt.surface(0) == prior


def test_the_loads_until_a_slip_is_detected_are_no_evidence_of_holding():
    """They climb to 1.3 times what the contact carries, as static friction may be larger, and then it slips."""
    ratios = np.concatenate([np.full(100, 0.5), np.linspace(1.0, 1.3, 35), np.full(5, 1.0)])
    warned = learnt_from(np.concatenate([ratios, np.full(100, 0.3)]), onsets=(139,))
    unaware = learnt_from(np.concatenate([ratios, np.full(60, 1.3)]))
    assert warned.surface(0).friction < TRUE.friction < unaware.surface(0).friction
    assert warned.belief.quantile(0.5).friction == pytest.approx(TRUE.friction, rel=0.06)


def test_no_contact_no_lesson():
    learnt, before = LearntSurface(wide), LearntSurface(wide).surface(0)
    for k in range(200):
        learnt.watch(k * PERIOD, (None, pulled(0.9)), (False, False))
        learnt.watch(k * PERIOD, (None, pulled(0.9)), (True, False))
    assert learnt.surface(0) == before
