"""Identification: known springs, servos and delays are found, within the uncertainty that is claimed."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import Phase, given, settings
from hypothesis import strategies as st

from palpate.controllers import IdentifyController, IdentifyParameters, series_stiffness
from palpate.controllers.identification import PressRecord, identify
from palpate.controllers.measured_loop import ForceResponse
from palpate.controllers.tone import Tone
from palpate.estimation import Assumption
from palpate.runtime import Ending, Finger, Limits, Supervisor, Touch, run
from palpate.sensing.compensation import SensorPayload
from palpate.sim import Box, ContactLaw, Fidelity, MujocoBackend, Stage, Tip, build_scene, white_noise
from palpate.surfaces import Sphere

PERIOD = 1e-3


def identified(stiffness, friction=0.3, seed=0, time_step=0.5e-3):
    """On a simulated stage, with the noise of a Nano17: (result of the run, identification, largest force)."""
    tip, target = Tip(Sphere(0.008)), Box((0.1, 0.1, 0.04))
    law = ContactLaw(stiffness=stiffness, friction=friction)
    scene = build_scene(tip, target, law, (0.0, 0.0, target.top + 0.0085), Stage(), Fidelity(time_step))
    backend = MujocoBackend(scene, PERIOD, white_noise(3.1e-3, 1.6e-5, seed))
    controller, forces = IdentifyController(IdentifyParameters(), PERIOD), []
    result = run(
        backend,
        Touch(Finger(Sphere(0.008), SensorPayload(tip.mass))),
        controller,
        Supervisor(Limits()),
        duration=30.0,
        observers=(lambda *_: forces.append(math.hypot(*backend.truth().force)),),
    )
    return result, controller.result(), max(forces)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("stiffness", "friction", "time_step"),
    [(500.0, 0.3, 0.5e-3), (20e3, 1.0, 0.5e-3), (200e3, 0.3, 0.25e-3)],
)
def test_stiffness_servo_and_a_stable_gain_are_found(stiffness, friction, time_step):
    result, found, largest = identified(stiffness, friction, time_step=time_step)
    assert result.ending is Ending.DONE
    assert largest < 3.3
    assert found.stiffness.value == pytest.approx(stiffness, rel=0.01)
    assert found.linear
    servo = Stage().stiffness(Tip(Sphere(0.008)).mass)
    assert found.servo_stiffness is not None
    assert found.servo_stiffness.value == pytest.approx(servo, rel=0.04)
    assert found.series_stiffness.value == pytest.approx(series_stiffness(stiffness, servo), rel=0.012)
    # the simulated contact is damped critically, by the moving mass
    assert found.damping_time == pytest.approx(2.0 * math.sqrt(5.03 / stiffness), rel=0.05)
    # in contact the servo's damping and the contact's brake, both springs drive
    mass, damping = 5.03, 2.0 * 100.0 * 5.03 + found.damping_time * stiffness
    assert found.lag.value == pytest.approx(damping / (servo + stiffness), rel=0.12)
    assert mass * 100.0**2 == pytest.approx(servo, rel=0.01)
    assert found.gain.gain_margin >= math.pi * (1 - 1e-9)
    assert found.phase_margin_deg > 61.0


def tones_of(
    response=lambda w: 14e3 * np.exp(-0.02j * w), frequencies=(2.0, 5.0, 10.0, 20.0, 40.0, 80.0), noise=0.0
):
    """Tones as a response P, given at a frequency [rad/s], would leave them."""
    rng, tones = np.random.default_rng(4), []
    for frequency in frequencies:
        tone = Tone(frequency, PERIOD, 3)
        P = response(tone.angular)
        for i in range(6 * round(1.0 / (tone.frequency * PERIOD))):
            turn = np.exp(1j * tone.angular * i * PERIOD)
            tone.add(0.3 + (0.8 * turn).real, turn.real, (P * turn).real + 2.0 + noise * float(rng.normal()))
        tones.append(tone)
    return tones


def ramps(stiffness, servo, lag, damping_time=0.0, noise=0.0, quadratic=0.0, seed=5):
    """Four ramps of force against depth and command."""
    speed, way = 4.0 / stiffness, np.concatenate([np.full(500, s) for s in (1.0, -1.0, 1.0, -1.0)])
    depth = np.cumsum(way) * speed * PERIOD
    elastic = stiffness * depth + quadratic * (depth - 0.5 * depth.max()) ** 2
    force = 1.0 + elastic + stiffness * damping_time * speed * way
    wanted = depth + force / servo + lag * speed * way
    steady = np.tile((np.arange(500) > 2) & (np.arange(500) < 497), 4)  # differences reach over the turns
    noisy = force + noise * np.random.default_rng(seed).normal(size=2000)
    return PressRecord(noisy, depth, wanted, steady, PERIOD)


@pytest.mark.slow
@settings(max_examples=10, deadline=None, derandomize=True, phases=[Phase.explicit, Phase.generate])
@given(st.floats(500.0, 5e5), st.floats(2e4, 2e5), st.floats(0.005, 0.05), st.floats(0.0, 0.1))
def test_a_delayed_spring_is_recovered(stiffness, servo, delay, damping_time):
    series = series_stiffness(stiffness, servo)
    found = identify(
        ramps(stiffness, servo, 0.02, damping_time),
        tones_of(lambda w: series * np.exp(-1j * w * (delay - 0.5 * PERIOD))),
        0.0,
    )
    assert found.stiffness.value == pytest.approx(stiffness, rel=1e-3)
    assert found.damping_time == pytest.approx(damping_time, abs=1e-4)
    if found.servo_stiffness is not None:
        assert found.servo_stiffness.value == pytest.approx(servo, rel=0.01)
    else:
        assert servo > 20.0 * stiffness
    if found.oscillation_frequency < 79.0 and delay < 0.03:  # linear interpolation of the phase bends by 5 %
        assert found.delay.value == pytest.approx(delay, rel=0.08)
        assert found.gain.gain_margin >= math.pi * (1.0 - 1e-6)


@pytest.mark.slow
def test_the_claimed_uncertainty_is_honest():
    """Of 40 records with white noise, about 38 lie within two standard deviations."""
    records, tones = [ramps(20e3, 50e3, 0.02, noise=3.1e-3, seed=seed) for seed in range(40)], tones_of()
    found = [identify(record, tones, 0.0).stiffness for record in records]
    assert sum(abs(each.value - 20e3) < 2.0 * each.sd for each in found) >= 34


@pytest.mark.parametrize(
    ("changed", "second", "noise", "assumption"),
    [
        ({}, 1.0, 0.0, None),
        ({"quadratic": 1.5e8}, 1.0, 0.0, Assumption.WHITE_IN_PLACE),
        ({}, 0.7, 0.0, Assumption.WHITE_IN_TIME),
        ({}, 1.0, 6e4, Assumption.CONDITIONED),
    ],
    ids=["plain", "stiffens", "gives way", "noisy"],
)
def test_the_verdict_says_why_force_control_may_not_go_by_it(changed, second, noise, assumption):
    """One that stiffens by a fifth from the least to the largest force, q = dK / (2 range), is not linear"""
    record = ramps(20e3, 50e3, 0.02, noise=3.1e-3, **changed)
    force = np.where(np.arange(2000) < 1000, record.force, second * record.force)
    verdict = identify(replace(record, force=force), tones_of(noise=noise), 0.0).verdict
    assert verdict.ok if assumption is None else verdict.breaks(assumption), verdict
    quadratic = 0.2 * 20e3 / (2.0 * 4.0 / 20e3 * 0.5)
    found = identify(ramps(20e3, 50e3, 0.02, noise=3.1e-3, quadratic=quadratic), tones_of(), 0.0)
    assert not found.linear
    assert found.stiffness_high - found.stiffness_low == pytest.approx(0.2 * 20e3, rel=0.05)


@settings(max_examples=30, deadline=None, derandomize=True)
@given(st.floats(1e3, 1e5), st.floats(0.004, 0.02), st.floats(0.1, 1.2))
def test_the_measured_gain_has_the_margins_of_the_delayed_integrator(stiffness, delay, loop_gain):
    w = np.geomspace(5.0, 800.0, 60)
    response = ForceResponse(w, stiffness * np.exp(-1j * w * (delay - 0.5 * PERIOD)), PERIOD)
    gain = response.gain(loop_gain)
    assert gain * stiffness * delay == pytest.approx(loop_gain, rel=0.06)
    assert response.phase_margin_deg(gain) >= 90.0 - math.degrees(loop_gain) - 0.5


def test_a_tone_is_measured_through_noise_and_offsets():
    tone, rng, a = Tone(7.0, PERIOD, 1), np.random.default_rng(6), 0.3 - 0.4j
    cycle = round(1.0 / (tone.frequency * PERIOD))
    for i in range(10 * cycle):
        tone.add(5.0 + (a * np.exp(1j * tone.angular * i * PERIOD)).real + 0.05 * float(rng.normal()))
    assert abs(tone.amplitude(0) - a) < 4.0 * tone.noise(0)
    assert tone.noise(0) == pytest.approx(0.05 * math.sqrt(2.0 / (10 * cycle)), rel=0.1)
    assert tone.frequency <= 7.0
