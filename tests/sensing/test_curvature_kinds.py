"""The shape operator is how the normal turns: against differences of the solver's own normals, for every kind."""

import numpy as np
import pytest

from palpate import (
    Capsule,
    Paraboloid,
    RoundedBox,
    Superellipsoid,
    contact_from_wrench,
    contacts_from_wrenches,
)
from palpate.sensing.curvature import shape_operator
from palpate.sensing.uncertainty import UncertaintyStatus, contact_uncertainty, white_noise
from palpate.surfaces import Hyperboloid

TURN = np.array([[0.36, 0.48, -0.8], [-0.8, 0.6, 0.0], [0.48, 0.64, 0.6]])
KINDS = {
    "paraboloid": Paraboloid((0.01, 0.02), rotation=TURN, center=(0.001, 0.002, 0.003)),
    "hyperboloid": Hyperboloid((0.01, 0.02, 0.03), rotation=TURN),
    "capsule": Capsule(0.01, 0.03, rotation=TURN),
    "rounded box": RoundedBox((0.02, 0.015, 0.01), 0.004, rotation=TURN),
    "superellipsoid": Superellipsoid((0.01, 0.012, 0.02), 3.0, rotation=TURN),
}


def pressed(surface, rng):
    """A contact with a force roughly along the tip's own -z, where every kind has surface."""
    force = -TURN[:, 2] + rng.uniform(-0.4, 0.4, 3)
    point = np.asarray(getattr(surface, "center", np.zeros(3))) + 0.002 * rng.normal(size=3)
    return contact_from_wrench(
        surface, np.concatenate([force, np.cross(point, force) + 1e-3 * rng.normal(size=3)])
    )


@pytest.mark.parametrize("name", KINDS)
def test_the_normal_turns_as_the_shape_operator_says(name):
    surface, rng = KINDS[name], np.random.default_rng(3)
    for _ in range(20):
        at = pressed(surface, rng)
        assert at.status == 0
        W = shape_operator(surface, at.centroid[None])[0]
        np.testing.assert_allclose(W @ at.normal, 0.0, atol=1e-9)
        np.testing.assert_allclose(W, W.T, atol=1e-9)
        # contacts around it: pure pushes along the normals of points a little way off
        step = 1e-6 * np.cross(at.normal, rng.normal(size=3))
        both = []
        for sign in (1.0, -1.0):
            f = -at.normal - sign * W @ step
            c = at.centroid + sign * step
            both.append(contact_from_wrench(surface, np.concatenate([f, np.cross(c, f)])))
        dc, dn = both[0].centroid - both[1].centroid, both[0].normal - both[1].normal
        if np.linalg.norm(dc) > 0.0:
            np.testing.assert_allclose(dn, W @ dc, atol=1e-3 * np.linalg.norm(dn) + 1e-9)


@pytest.mark.parametrize("name", KINDS)
def test_predicted_spread_is_that_of_noisy_wrenches(name):
    surface, rng = KINDS[name], np.random.default_rng(5)
    at = pressed(surface, rng)
    wrench = np.concatenate([at.force, np.cross(at.centroid, at.force) + at.spin_torque * at.normal])
    predicted = contact_uncertainty(surface, at, white_noise(0.005, 5e-5))
    assert predicted.status == UncertaintyStatus.VALID
    noise = rng.standard_normal((20_000, 6)) * ([0.005] * 3 + [5e-5] * 3)
    found = contacts_from_wrenches(surface, wrench + noise)
    spread = np.sqrt(np.trace(np.cov(found.centroid.T)))
    assert np.sqrt(np.trace(predicted.centroid)) == pytest.approx(spread, rel=0.03)
    assert np.sqrt(predicted.spin_torque) == pytest.approx(found.spin_torque.std(), rel=0.03)
