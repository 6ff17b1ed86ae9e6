"""Layers on a mesh: means of the nearest contacts, whatever moves or scales; nothing where nothing was felt."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from palpate.mapping.layers import vertex_layer

RNG = np.random.default_rng(0)
POINTS = RNG.uniform(0.0, 0.01, (60, 3))
VERTICES = RNG.uniform(0.0, 0.01, (40, 3))


@given(slope=st.floats(-10.0, 10.0), shift=st.floats(-10.0, 10.0))
def test_mean_and_deviation_follow_the_unit_of_the_value(slope, shift):
    value = np.sin(300.0 * POINTS[:, 0])
    plain = vertex_layer("v", VERTICES, POINTS, value, 0.005)
    other = vertex_layer("v", VERTICES, POINTS, slope * value + shift, 0.005)
    np.testing.assert_allclose(other.mean, slope * plain.mean + shift, atol=1e-9)
    np.testing.assert_allclose(other.sd, abs(slope) * plain.sd, atol=1e-7)


def test_what_is_the_same_everywhere_is_the_same_on_the_mesh():
    layer = vertex_layer("v", VERTICES, POINTS, np.full(60, 0.3), 0.1)
    np.testing.assert_allclose(layer.mean, 0.3)
    np.testing.assert_allclose(layer.sd, 0.0, atol=1e-12)


def test_a_far_contact_says_nothing():
    layer = vertex_layer("v", np.outer([0.0, 1.0], np.ones(3)), np.zeros((1, 3)), np.ones(1), 0.1)
    assert layer.mean[0] == 1.0
    assert np.isnan(layer.sd).all()  # one contact does not scatter
    assert np.isnan(layer.mean[1])
    assert np.isnan(vertex_layer("v", VERTICES, np.zeros((0, 3)), np.zeros(0), 1.0).mean).all()
