"""The right shape is chosen, or none where no shape fits; many more cases: benchmarks/fits.py."""

import numpy as np
import pytest

from mapping.felt_shapes import ANSWER, random_case
from palpate.mapping.primitives import choose_primitive


@pytest.mark.slow
@pytest.mark.parametrize("kind", list(ANSWER))
def test_the_right_shape_or_none_of_them(kind):
    right = 0
    for seed in range(6):
        case = random_case(kind, np.random.default_rng([seed, sum(map(ord, kind))]))
        found = choose_primitive(case.cloud, correlation_points=case.correlation_points).kind
        right += (None if found is None else found.value) == ANSWER[kind]
    assert right >= 5
