"""Vectors in kernels: the same bits as in Python."""

import math

import numpy as np
import pytest

from palpate.controllers.small_vectors import length, unit


@pytest.mark.parametrize("size", [1e-100, 1e-6, 1.0, 1e100])
def test_a_length_is_what_python_rounds_it_to(size):
    vectors = size * np.random.default_rng(0).standard_normal((3000, 3))
    vectors[:1000, 1:] *= 1e-6
    assert [length(*each) for each in vectors.tolist()] == [math.hypot(*each) for each in vectors.tolist()]


def test_what_has_no_length_has_no_direction():
    assert length(0.0, 0.0, 0.0) == 0.0
    with pytest.raises(ZeroDivisionError):
        unit((0.0, 0.0, 0.0))
