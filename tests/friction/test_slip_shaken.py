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


def latency(told_by, rng, lag, phase):
    """Samples from slip to alarm: a load of nine tenths that goes over into slip, friction `lag` late."""
    for k in range(200):
        time = k * PERIOD
        share = 0.9 * MU * GRIP if k < 100 else MU * pressed(time - lag, phase)
        if told_by.step(felt(rng, pressed(time, phase), share)) is not None:
            return k - 100
    return math.inf


@pytest.mark.parametrize("lag", [0.0, 1e-3])
def test_slip_is_found_as_soon_whether_friction_follows_at_once_or_a_millisecond_late(lag):
    rng = np.random.default_rng(1)
    late = [latency(detector(), rng, lag, phase) for phase in np.linspace(0.0, 6.0, 60)]
    assert min(late) > 0
    assert np.median(late) <= 15


def test_friction_that_follows_late_is_detected_sooner_than_by_who_does_not_allow_for_it():
    rng = np.random.default_rng(1)
    allowed, not_allowed = (
        [latency(detector(lag=lag), rng, 1e-3, phase) for phase in np.linspace(0.0, 6.0, 60)]
        for lag in (1e-3, 0.0)
    )
    assert np.mean(allowed) < np.mean(not_allowed) - 1.0


@pytest.mark.parametrize("frequency", [15.0, 25.0, 40.0])
def test_a_shaken_load_that_sticks_is_no_slip(frequency):
    """At most 80 % of what is borne, above the weakest surface; ten seconds of it."""
    rng, told_by, phase = np.random.default_rng(4), detector(), 1.0
    alarms, before = 0, False
    for k in range(10000):
        time = k * PERIOD
        force = MU * GRIP * (0.5 + 0.3 * math.sin(2.0 * math.pi * frequency * time))
        now = told_by.step(felt(rng, pressed(time, phase), force)) is not None
        alarms, before = alarms + (now and not before), now
    assert alarms == 0


@settings(max_examples=8, deadline=None)
@given(st.floats(0.0, 6.3), st.floats(0.1, 10.0))
def test_what_counts_against_a_swinging_load_depends_on_neither_direction_nor_scale(across, scale):
    """Noise scaled with it; all of it is a ratio."""

    def told(c, s, by):
        rng, noise = np.random.default_rng(6), LoadNoise(NOISE.force * by, NOISE.torque * by)
        its = ExcitedSlip(WEAK, GripDither(), PERIOD, noise)
        evidence = []
        for k in range(120):
            f = by * (GRIP + 0.3 * math.sin(0.5 * math.pi * k + 0.7))
            load = 0.9 * MU * by * GRIP * (1.0 + 0.01 * k) if k < 60 else MU * f
            a, b = rng.standard_normal(2) * 0.01 * by
            its.step(ContactLoad(f + a, (0.0, c * (load + b), s * (load + b)), 0.0))
            evidence.append(its.evidence)
        return evidence

    # to other axes the same blows say nothing, but a direction between two is felt on both
    assert told(1.0, 0.0, 1.0) == pytest.approx(told(1.0, 0.0, scale), abs=1e-6)
    assert told(0.0, 1.0, 1.0) == pytest.approx(told(1.0, 0.0, 1.0), abs=1e-9)
    assert max(told(math.cos(across), math.sin(across), 1.0)) == 1.0


def test_noise_of_a_load_is_that_of_its_moment_about_the_tip():
    """As touch takes it: normal from the centroid on a sphere at some distance before the sensor."""
    radius, lever, force, moment = 0.008, 0.012, 0.010, 0.1e-3
    said = LoadNoise.of_touch(force, moment, radius, lever)
    rng = np.random.default_rng(8)
    center, pressing = np.array([0.0, 0.0, lever]), np.array([-4.0, 0.0, 0.0])
    forces, torques = [], []
    for _ in range(4000):
        f = pressing + force * rng.standard_normal(3)
        about = np.cross(center, pressing) + moment * rng.standard_normal(3) - np.cross(center, f)
        # about the tip's centre: m = R n x f + q n, to first order in the noise
        n = np.array([1.0, 0.0, 0.0]) + np.cross(f, about) / (radius * f @ f)
        n /= np.linalg.norm(n)
        forces.append((f - (f @ n) * n)[1:])
        torques.append(about @ n)
    assert np.std(torques) == pytest.approx(said.torque, rel=0.25)
    assert np.std(forces) == pytest.approx(said.force, rel=0.25)
    assert said.torque > 1.4 * LoadNoise.of_touch(force, moment, radius).torque
