"""Slip told by a ripple: friction that follows late, loads that shake, and what noise makes of a load."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.friction.contact_load import ContactLoad
from palpate.friction.limit_surface import LimitSurface
from palpate.friction.slip.excited_slip import ExcitedParameters, ExcitedSlip
from palpate.friction.slip.grip_dither import GripDither
from palpate.friction.slip.load_noise import LoadNoise

PERIOD = 1e-3
MU, E, GRIP = 0.5, 0.004, 4.0
WEAK = LimitSurface(0.7 * MU, 0.7 * E)
NOISE = LoadNoise(0.02, 0.16e-3)
RIPPLE, FREQUENCY = 0.16, 100.0
"""[N, Hz] What the simulated hand's fingertips press with."""


def pressed(time, phase=0.0):
    return GRIP + RIPPLE * math.sin(2.0 * math.pi * FREQUENCY * time + phase)


def felt(rng, normal_force, force, torque=0.0):
    a, b, c, d = rng.standard_normal(4)
    return ContactLoad(
        normal_force + 0.01 * a, (0.0, NOISE.force * b, force + NOISE.force * c), torque + NOISE.torque * d
    )


def detector(**more):
    return ExcitedSlip(WEAK, GripDither(RIPPLE, FREQUENCY), PERIOD, NOISE, ExcitedParameters(**more))


def latencies(lag, allowed=None):
    """Samples from slip to alarm by phase: a load of nine tenths that turns into slip, friction `lag` late."""
    rng, found = np.random.default_rng(1), []
    for phase in np.linspace(0.0, 6.0, 60):
        detecting = detector() if allowed is None else detector(lag=allowed)
        alarms = (
            detecting.step(
                felt(rng, pressed(t, phase), 0.9 * MU * GRIP if t < 0.0 else MU * pressed(t - lag, phase))
            )
            for t in PERIOD * np.arange(-100, 100)
        )
        found.append(next((k - 100 for k, alarm in enumerate(alarms) if alarm is not None), math.inf))
    return found


@pytest.mark.parametrize("lag", [0.0, 1e-3])
def test_slip_is_found_as_soon_whether_friction_follows_at_once_or_a_millisecond_late(lag):
    found = latencies(lag)
    assert min(found) > 0
    assert np.median(found) <= 15


def test_friction_that_follows_late_is_detected_sooner_by_allowing_for_it():
    assert np.mean(latencies(1e-3, allowed=1e-3)) < np.mean(latencies(1e-3, allowed=0.0)) - 1.0


@pytest.mark.parametrize("frequency", [15.0, 25.0, 40.0])
def test_a_shaken_load_that_sticks_is_no_slip(frequency):
    """At most 80 % of the limit, above the weakest surface; ten seconds of it."""
    rng, detecting = np.random.default_rng(4), detector()
    for time in PERIOD * np.arange(10_000):
        force = MU * GRIP * (0.5 + 0.3 * math.sin(2.0 * math.pi * frequency * time))
        assert detecting.step(felt(rng, pressed(time, 1.0), force)) is None


@settings(max_examples=8, deadline=None)
@given(st.floats(0.0, 6.3), st.floats(0.1, 10.0))
def test_the_evidence_of_slip_depends_on_neither_direction_nor_scale(across, scale):
    """Noise is scaled with the load; the evidence is a ratio."""

    def evidence(c, s, by):
        rng, noise = np.random.default_rng(6), LoadNoise(NOISE.force * by, NOISE.torque * by)
        detecting, found = ExcitedSlip(WEAK, GripDither(), PERIOD, noise), []
        for k in range(120):
            f = by * (GRIP + 0.3 * math.sin(0.5 * math.pi * k + 0.7))
            load = 0.9 * MU * by * GRIP * (1.0 + 0.01 * k) if k < 60 else MU * f
            a, b = rng.standard_normal(2) * 0.01 * by
            detecting.step(ContactLoad(f + a, (0.0, c * (load + b), s * (load + b)), 0.0))
            found.append(detecting.evidence)
        return found

    # along one axis the other sees no blows, but a direction between two is felt on both
    assert evidence(1.0, 0.0, 1.0) == pytest.approx(evidence(1.0, 0.0, scale), abs=1e-6)
    assert evidence(0.0, 1.0, 1.0) == pytest.approx(evidence(1.0, 0.0, 1.0), abs=1e-9)
    assert max(evidence(math.cos(across), math.sin(across), 1.0)) == 1.0


def test_noise_of_a_load_is_that_of_its_moment_about_the_tip():
    """As touch takes it: normal from the centroid on a sphere at some distance before the sensor."""
    radius, lever, force, moment = 0.008, 0.012, 0.010, 0.1e-3
    noise, draws = (
        LoadNoise.of_touch(force, moment, radius, lever),
        np.random.default_rng(8).standard_normal((2, 4000, 3)),
    )
    center, pressing = np.array([0.0, 0.0, lever]), np.array([-4.0, 0.0, 0.0])
    f = pressing + force * draws[0]
    about = np.cross(center, pressing) + moment * draws[1] - np.cross(center, f)
    # about the tip's centre: m = R n x f + q n, to first order in the noise
    n = np.array([1.0, 0.0, 0.0]) + np.cross(f, about) / (radius * np.sum(f * f, axis=1)[:, None])
    n /= np.linalg.norm(n, axis=1)[:, None]
    tangential = f - np.sum(f * n, axis=1)[:, None] * n
    assert np.std(np.sum(about * n, axis=1)) == pytest.approx(noise.torque, rel=0.25)
    assert np.std(tangential[:, 1:]) == pytest.approx(noise.force, rel=0.25)
    assert noise.torque > 1.4 * LoadNoise.of_touch(force, moment, radius).torque
