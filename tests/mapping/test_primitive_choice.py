import numpy as np
import pytest

from mapping.felt_shapes import ANSWER, cloud_at, random_case
from palpate.errors import InvalidValueError
from palpate.mapping.primitives import choose_primitive


def answers(kind, count):
    for seed in range(count):
        case = random_case(kind, np.random.default_rng([seed, sum(map(ord, kind))]))
        found = choose_primitive(case.cloud, correlation_points=case.correlation_points)
        yield None if found.kind is None else found.kind.value


@pytest.mark.slow
@pytest.mark.parametrize("kind", list(ANSWER))
def test_the_right_shape_or_none_of_them(kind):
    assert [answer == ANSWER[kind] for answer in answers(kind, 4)].count(True) >= 3


@pytest.mark.slow
@pytest.mark.parametrize("kind", list(ANSWER))
def test_at_least_95_of_100(kind):
    assert [answer == ANSWER[kind] for answer in answers(kind, 200)].count(True) >= 190


def test_too_few_contacts_tell_nothing_apart():
    with pytest.raises(InvalidValueError, match="cannot tell shapes apart"):
        choose_primitive(cloud_at(np.eye(10, 3), np.tile([0.0, 0.0, 1.0], (10, 1))))
