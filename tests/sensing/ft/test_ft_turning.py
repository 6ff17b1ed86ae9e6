import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from palpate.errors import InvalidValueError
from palpate.sensing.compensation import Payload, contact_wrench
from palpate.sensing.ft.turning import TurningPayload, contact_wrench_turning

coordinate = st.floats(-3.0, 3.0)
vectors = st.tuples(coordinate, coordinate, coordinate)
GRAVITY = np.array([0.0, 0.0, -9.81])


def body(rng):
    """A handful of point masses, and the same as a payload."""
    masses = rng.uniform(0.1, 0.5, 6)
    places = rng.uniform((-0.05, -0.05, 0.01), (0.05, 0.05, 0.11), (6, 3))
    mass = masses.sum()
    center = masses @ places / mass
    r = places - center
    inertia = sum(m * (x @ x * np.eye(3) - np.outer(x, x)) for m, x in zip(masses, r, strict=True))
    payload = TurningPayload(Payload(mass, tuple(center)), tuple(map(tuple, inertia)))
    return masses, places, payload


@given(seed=st.integers(0, 10_000), omega=vectors, alpha=vectors, acceleration=vectors)
def test_newton_holds_for_every_point_mass(seed, omega, alpha, acceleration):
    """Accelerations of the points come from a difference quotient of a written-out motion, not from a formula."""
    rng = np.random.default_rng(seed)
    masses, places, payload = body(rng)
    omega, alpha, acceleration = map(np.array, (omega, alpha, acceleration))
    start = Rotation.random(rng=rng)

    def position(t):
        # To second order in t: the frame turns by omega t + alpha t^2/2, its origin moves by a t^2/2.
        turn = start * Rotation.from_rotvec(omega * t + 0.5 * alpha * t**2)
        return start.apply(0.5 * acceleration * t**2) + turn.apply(places)

    step = 1e-4
    accelerations = (position(step) - 2.0 * position(0.0) + position(-step)) / step**2
    contact = rng.normal(size=6)
    forces = masses[:, None] * start.apply(accelerations - GRAVITY, inverse=True)
    # Sum of forces on the payload: contact - load = sum m (a - g); likewise moments about the sensor's origin.
    load = contact - np.hstack([forces.sum(axis=0), np.cross(places, forces).sum(axis=0)])
    shown = acceleration - start.apply(GRAVITY, inverse=True)
    found = contact_wrench_turning(tuple(load), tuple(shown), tuple(omega), tuple(alpha), payload)
    np.testing.assert_allclose(found, contact, atol=2e-6)


@given(seed=st.integers(0, 10_000), acceleration=vectors)
def test_an_arm_that_does_not_turn_needs_no_inertia(seed, acceleration):
    rng = np.random.default_rng(seed)
    payload = body(rng)[2]
    load = tuple(rng.normal(size=6))
    still = (0.0, 0.0, 0.0)
    found = contact_wrench_turning(load, acceleration, still, still, payload)
    np.testing.assert_allclose(found, contact_wrench(load, acceleration, payload.payload), rtol=1e-14, atol=1e-14)


@pytest.mark.parametrize(
    ("inertia", "reason"),
    [
        (((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 3.0)), "sum of the other two"),
        (((-1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)), "must be 0 or above"),
        (((1.0, 0.5, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)), "symmetric"),
        (((1.0, 0.0, 0.0), (0.0, float("nan"), 0.0), (0.0, 0.0, 1.0)), "finite"),
    ],
)
def test_impossible_inertias_are_refused(inertia, reason):
    with pytest.raises(InvalidValueError, match=reason):
        TurningPayload(Payload(), inertia)
