"""An arm without a sensor of its own must give way as its fingertip's sensor feels."""

import random
from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.runtime.data import Command
from palpate.runtime.following import AnyMotion, FollowingError
from palpate.runtime.servo_following import CYCLES, SHARE, TIMING, PositionServo, ServoFollowing
from runtime.puppets import PERIOD, sample, touch

LIMIT, STEPS = 20.0, 20
NOW = touch().sense(sample())
SERVO = PositionServo(5e4, 0.02, 0.02)


def felt(time, force):
    """An observation with a felt force along z [N]."""
    return replace(NOW, time=time, fingers=(replace(NOW.fingers[0], wrench=(0.0, 0.0, force, 0.0, 0.0, 0.0)),))


def driven(servo, velocities, push, gain, late=0):
    """Integrate a servo as it is defined; return when what judges it objects, and the push then; None if never.

    Args:
        servo: As it is, and as it is taken for.
        velocities: Commanded along z, period after period [m/s].
        push: From time to force along z [N].
        gain: Of the sensor.
        late: How many periods commands take to the arm.
    """
    first = sample().arm
    judge = ServoFollowing(servo, LIMIT, PERIOD, AnyMotion(PERIOD, first), first)
    rate, lead, dt = 2.0 / servo.response, servo.response - servo.lag, PERIOD / STEPS
    reference = position = velocity = 0.0
    delayed = [0.0] * late + list(velocities)
    for k, commanded in enumerate(velocities):
        for _ in range(STEPS):
            reference += dt * delayed[k]
            goal = reference + lead * delayed[k] + push(k * PERIOD) / servo.stiffness
            velocity += dt * (rate * rate * (goal - position) - 2.0 * rate * velocity)
            position += dt * velocity
        after = sample(time=(k + 1) * PERIOD, position=(0.0, 0.0, position))
        try:
            judge.take(Command((0.0, 0.0, commanded)), felt(k * PERIOD, gain * push(k * PERIOD)), after)
        except FollowingError as error:
            return k * PERIOD, push(k * PERIOD), str(error)
    return None


@given(st.integers(0, 2**32 - 1), st.floats(2e4, 1e5), st.floats(0.01, 0.05), st.booleans())
@settings(max_examples=15)
def test_an_arm_as_described_passes_whatever_is_commanded_and_felt(seed, stiffness, response, fed_forward):
    rng = random.Random(seed)
    servo = PositionServo(stiffness, response, 0.0 if fed_forward else response)
    late = rng.randint(0, int(max(TIMING * response, CYCLES * PERIOD) / PERIOD) - 1)
    velocities = [v for _ in range(6) for v in [rng.uniform(-0.05, 0.05)] * 150]
    level = rng.uniform(0.0, LIMIT)
    assert driven(servo, velocities, lambda t: level * min(1.0, 2.0 * t), 1.0, late) is None


@pytest.mark.parametrize("gain", [0.0, 0.1])
@pytest.mark.parametrize("rate", [20.0, 100.0, 300.0])
def test_a_push_that_is_not_felt_is_found_within_the_share_of_the_limit_and_two_responses(gain, rate):
    found = driven(SERVO, [0.0] * 2000, lambda t: rate * t, gain)
    assert found is not None
    _, force, why = found
    assert force <= SHARE * LIMIT / (1.0 - 1.6 * gain) * 1.5 + 2.0 * SERVO.response * rate
    assert "its sensor does not feel" in why


def test_a_slow_drift_of_the_arm_passes():
    assert driven(SERVO, [0.0] * 3000, lambda t: 5.0 * t, 0.0) is None
