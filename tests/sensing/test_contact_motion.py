"""Rolling, sliding and spinning told apart, on motions that are known in closed form."""

import math

import hypothesis
import numpy as np
import pytest
from hypothesis import strategies as st

from palpate.errors import InvalidValueError
from palpate.sensing.contact_motion import (
    ContactMotionKind,
    ContactMotionTracker,
    MotionThresholds,
    contact_motion,
)

R = 0.01
STILL, ROLLING, SLIDING, SPINNING = (
    ContactMotionKind.STILL,
    ContactMotionKind.ROLLING,
    ContactMotionKind.SLIDING,
    ContactMotionKind.SPINNING,
)
PERIOD = 1e-3


def turn(axis, angle):
    x, y, z = np.asarray(axis, float) / np.linalg.norm(axis)
    K = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + math.sin(angle) * K + (1 - math.cos(angle)) * K @ K


def ball_on_a_plane(slip, roll, spin, duration=0.1, offset=(0.002, -0.001, 0.003)):
    """A ball of radius R on the plane z = 0, its tip frame off its centre; everything in tip coordinates.

    Args:
        slip: Velocity of the material at the contact along x [m/s].
        roll: Angular velocity about y [rad/s].
        spin: About the vertical [rad/s].
    """
    omega = np.array([0.0, roll, spin])
    contact_from_centre = np.array([0.0, 0.0, -R])
    centre_velocity = np.array([slip, 0.0, 0.0]) - np.cross(omega, contact_from_centre)
    for i in range(round(duration / PERIOD)):
        t = i * PERIOD
        rotation = turn(omega, np.linalg.norm(omega) * t) if omega.any() else np.eye(3)
        back = rotation.T
        centre_to_origin = rotation @ -np.array(offset)
        yield (
            t,
            back @ contact_from_centre + offset,
            back @ [0.0, 0.0, -1.0],
            back @ (centre_velocity + np.cross(omega, centre_to_origin)),
            back @ omega,
        )


def follow(samples, tracker=None, noise=0.0, seed=0):
    rng = np.random.default_rng(seed)
    tracker = tracker or ContactMotionTracker()
    found = []
    for t, c, n, v, w in samples:
        felt = c + rng.normal(0, noise, 3)
        motion = tracker.step(t, *(tuple(float(x) for x in a) for a in (felt, n, v, w)))
        if motion:
            found.append(motion)
    return found


CASES = [
    (0.0, 0.0, 0.0, STILL),
    (0.0, 2.0, 0.0, ROLLING),
    (0.0, -2.0, 0.0, ROLLING),
    (0.02, 0.0, 0.0, SLIDING),
    (-0.02, 0.0, 0.0, SLIDING),
    (0.0, 0.0, 1.0, SPINNING),
    (0.02, 2.0, 0.0, ROLLING | SLIDING),
    (0.02, -2.0, 0.0, ROLLING | SLIDING),  # as a wheel that spins in place: slip takes up the rolling
    (0.02, 0.0, -1.0, SLIDING | SPINNING),
    (0.0, 2.0, 1.0, ROLLING | SPINNING),
    (0.02, 2.0, 1.0, ROLLING | SLIDING | SPINNING),
]


@pytest.mark.parametrize(("slip", "roll", "spin", "kind"), CASES)
def test_a_ball_on_a_plane(slip, roll, spin, kind):
    found = follow(ball_on_a_plane(slip, roll, spin))
    assert len(found) == 86
    for motion in found:
        assert motion.kind == kind
        assert np.linalg.norm(motion.slip_velocity) == pytest.approx(abs(slip), abs=1e-6)
        # a ball's contact runs over it at radius times rate
        assert np.linalg.norm(motion.migration_velocity) == pytest.approx(abs(roll) * R, rel=1e-3, abs=1e-12)
        assert motion.roll_rate == pytest.approx(abs(roll), rel=1e-3)
        assert motion.spin_rate == pytest.approx(-spin, rel=1e-3), "about the outward normal, which points down"
        assert motion.separation_speed == pytest.approx(0.0, abs=1e-5)
        # over the plane it moves as fast as the ball's centre: slip and rolling added with their directions
        assert np.linalg.norm(motion.path_velocity) == pytest.approx(abs(slip + roll * R), rel=1e-3, abs=1e-6)


@pytest.mark.parametrize("turns", [5.0, 30.0])
def test_a_pendulum_that_rocks_on_its_round_end_only_rolls(turns):
    """Rolling back and forth: the rolling velocity follows the motion, slip stays zero."""
    rocking, t = [], np.arange(0, 0.5, PERIOD)
    for at in t:
        angle, rate = 0.3 * math.sin(turns * at), 0.3 * turns * math.cos(turns * at)
        back = turn([0, 1, 0], angle).T
        omega = np.array([0.0, rate, 0.0])
        rocking.append(
            (at, back @ [0, 0, -R], back @ [0, 0, -1.0], back @ -np.cross(omega, [0.0, 0.0, -R]), back @ omega)
        )
    for motion in follow(rocking):
        assert not motion.kind & SLIDING
        rate = 0.3 * turns * math.cos(turns * motion.time)
        assert np.linalg.norm(motion.migration_velocity) == pytest.approx(R * abs(rate), abs=2e-3 * R * turns)


def test_sliding_without_turning_over_a_round_object_is_not_rolling():
    """The centroid migrates since the object's normal turns, but the finger does not roll over anything."""
    big, speed = 0.04, 0.02
    samples = []
    for i in range(200):
        angle = (i - 100) * PERIOD * speed / (R + big)
        n = np.array([-math.sin(angle), 0.0, -math.cos(angle)])  # towards the object below
        velocity = speed * np.array([math.cos(angle), 0.0, -math.sin(angle)])
        samples.append((i * PERIOD, R * n, n, velocity, np.zeros(3)))
    found = follow(samples)
    assert {motion.kind for motion in found} == {SLIDING}
    assert np.linalg.norm(found[0].migration_velocity) == pytest.approx(speed * R / (R + big), rel=1e-3)
    # over the object it moves slower than the tip, which passes further out
    assert np.linalg.norm(found[0].path_velocity) == pytest.approx(speed * big / (R + big), rel=1e-3)


@pytest.mark.slow
@pytest.mark.parametrize(("slip", "roll", "spin", "kind"), CASES)
def test_noise_of_the_centroid_does_not_make_it_roll(slip, roll, spin, kind):
    """30 um of noise, 1 kHz: over 60 samples the slope's deviation is 0.22 mm/s, a quarter of the threshold."""
    tracker = ContactMotionTracker(window=60, thresholds=MotionThresholds(migration_speed=1.5e-3))
    found = follow(ball_on_a_plane(slip, roll, spin, duration=1.0), tracker, noise=30e-6)
    right = [motion.kind == kind for motion in found]
    assert np.mean(right) > 0.995


finite = st.floats(-1, 1, allow_subnormal=False)
vectors = st.tuples(finite, finite, finite)


@hypothesis.settings(max_examples=100, deadline=None, derandomize=True)
@hypothesis.given(vectors, vectors, vectors, vectors, vectors, vectors)
def test_where_the_tip_frame_stands_does_not_matter(c, n, c_dot, v, w, shift):
    """Slip, migration and rates belong to the contact: another origin of the tip frame gives the same."""
    hypothesis.assume(np.linalg.norm(n) > 0.1)
    n = tuple(float(x) for x in np.array(n) / np.linalg.norm(n))
    one = contact_motion(0.0, c, n, c_dot, v, w, MotionThresholds())
    moved_c = tuple(float(x) for x in np.array(c) - shift)
    moved_v = tuple(float(x) for x in np.array(v) + np.cross(w, shift))
    other = contact_motion(0.0, moved_c, n, c_dot, moved_v, w, MotionThresholds())
    for name in ("slip_velocity", "migration_velocity", "path_velocity", "roll_rate", "spin_rate"):
        np.testing.assert_allclose(getattr(one, name), getattr(other, name), atol=1e-13)
    assert np.dot(one.slip_velocity, n) == pytest.approx(0.0, abs=1e-13)
    np.testing.assert_allclose(one.path_velocity, np.add(one.slip_velocity, one.migration_velocity), atol=1e-15)


def test_the_window_fills_anew_after_a_reset():
    tracker = ContactMotionTracker(window=5)
    samples = list(ball_on_a_plane(0.02, 0.0, 0.0, duration=0.02))
    assert len(follow(samples[:10], tracker)) == 6
    tracker.reset()
    assert len(follow(samples[:10], tracker)) == 6, "earlier times are no mistake after a reset"


def test_a_finger_that_lifts_says_so():
    motion = contact_motion(0, (0, 0, -R), (0, 0, -1.0), (0, 0, 0), (0, 0, 0.01), (0, 0, 0), MotionThresholds())
    assert motion.separation_speed == pytest.approx(0.01)
    assert motion.kind == STILL


def test_mistakes_are_named():
    tracker = ContactMotionTracker(window=3)
    zero, n = (0.0, 0.0, 0.0), (0.0, 0.0, -1.0)
    tracker.step(0.0, zero, n, zero, zero)
    with pytest.raises(InvalidValueError, match="in order"):
        tracker.step(0.0, zero, n, zero, zero)
    with pytest.raises(InvalidValueError, match="finite"):
        tracker.step(1.0, (math.nan, 0.0, 0.0), n, zero, zero)
    with pytest.raises(InvalidValueError, match="at least 2"):
        ContactMotionTracker(window=1)
    with pytest.raises(InvalidValueError, match="roll_rate"):
        MotionThresholds(roll_rate=-1.0)
