"""What keeps a grip from giving way again depends on why it did."""

import pytest

from palpate.experiments.grasp.words import against_slip
from support.grasp_runs import plan_of


@pytest.mark.parametrize(
    ("options", "told", "unheard"),
    [
        ({"known": "touched"}, ("--margin",), ("palpate friction",)),
        (
            {"known": "touched", "believed_friction": 0.9},
            ("mu was believed to be 0.9, and is 0.5", "palpate friction", "--known nudged"),
            ("--margin",),
        ),
        (
            {"known": "touched", "believed_spin_length": 0.008},
            ("e was believed to be 8 mm, and is ", "palpate friction"),
            ("--margin",),
        ),
        ({"known": "nudged", "believed_friction": 0.9}, ("palpate friction",), ("--known nudged",)),
        ({"controller": "coulomb", "believed_friction": 0.9}, ("--controller limit-surface",), ("mu",)),
        ({"friction": 0.05}, ("--pull",), ("--margin", "believed")),
    ],
)
def test_advice_fits_the_cause(options, told, unheard):
    advice = against_slip(plan_of(**options), known=True)
    assert all(words in advice for words in told)
    assert not any(words in advice for words in unheard)


def test_on_a_robot_nobody_knows_why():
    advice = against_slip(plan_of(), known=False)
    assert "--margin" in advice
    assert "palpate friction" in advice
