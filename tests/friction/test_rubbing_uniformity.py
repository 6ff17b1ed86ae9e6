"""Whether mu is the same in all places and directions that were rubbed, and what is reported where it is not."""

import math

import numpy as np
import pytest
from trust.friction import Rubbed, run

from palpate.estimation import Assumption
from palpate.friction.rubbing.uniformity import LARGEST_VARIATION, profile_of, uniformity_of


def rubbed(rng, mu, heading=0.0, length=0.012, noise=0.01, force=2.0):
    """A profile of mu over the place [m], 500 samples there and back."""
    along = np.array([math.cos(heading), math.sin(heading), 0.0])
    s = np.linspace(0.0, length, 500)

    def felt(sense):
        f = np.outer(np.full(500, -force), [0.0, 0.0, 1.0]) - np.outer(sense * force * mu(s), along)
        return f + noise * rng.normal(size=f.shape)

    return profile_of((s, s[::-1]), (felt(1.0), felt(-1.0)[::-1]), along)


def level(s):
    return np.full_like(s, 0.5)


@pytest.mark.parametrize(
    "mu",
    [
        lambda s: 0.5 * (1.0 + 0.05 * (s > 0.006)),
        lambda s: 0.5 * (1.0 + 0.05 * s / 0.012),
        lambda s: 0.5 * (1.0 + 0.05 * np.sin(2.0 * math.pi * s / 0.008)),
    ],
    ids=["step", "gradient", "grating of 8 mm"],
)
def test_5_percent_by_place_is_reported_and_the_interval_counts_it(mu):
    found = [uniformity_of([rubbed(np.random.default_rng(seed), mu)]) for seed in range(20)]
    assert all(each.verdict.breaks(Assumption.WHITE_IN_PLACE) for each in found)
    assert all(2.0 * each.variation > 0.03 for each in found)


@pytest.mark.parametrize("axis", [0.0, 30.0, 45.0, 77.0])
def test_5_percent_by_direction_is_reported_whichever_axis_it_has(axis):
    """mu along the axis is 5 % more than the mean, across it 5 % less."""

    def along(heading):
        turned = heading - math.radians(axis)
        return lambda s: np.full_like(s, 0.5 * math.hypot(1.05 * math.cos(turned), 0.95 * math.sin(turned)))

    for seed in range(10):
        rng = np.random.default_rng(seed)
        headings = (0.0, math.pi / 3.0, 2.0 * math.pi / 3.0)
        found = uniformity_of([rubbed(rng, along(heading), heading) for heading in headings])
        assert found.verdict.breaks(Assumption.WHITE_IN_DIRECTION)
        assert not found.verdict.breaks(Assumption.WHITE_IN_PLACE)


@pytest.mark.parametrize("force", [0.3, 2.0])
def test_noise_alone_is_never_reported(force):
    for seed in range(100):
        rng = np.random.default_rng(seed)
        profiles = [rubbed(rng, level, heading, force=force) for heading in (0.0, 1.0, 2.0)]
        found = uniformity_of(profiles, [rubbed(rng, level, length=0.02, force=force)])
        assert found.verdict.ok
        assert found.variation == 0.0


def test_mu_at_other_speeds_is_compared_along_each_stroke_only():
    rng = np.random.default_rng(1)
    faster = rubbed(rng, lambda s: 0.8 * level(s))
    assert uniformity_of([rubbed(rng, level)], [faster]).verdict.ok
    assert LARGEST_VARIATION < 0.05


def test_single_spikes_are_left_out_and_many_are_reported():
    few = run(Rubbed(outliers=0.001), 3)
    assert few.ok
    assert few.furthest < 4.0
    assert not run(Rubbed(outliers=0.03, quick=True), 3).ok
