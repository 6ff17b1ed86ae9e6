"""What is said of values in another unit, of another type, or out of all proportion."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from palpate.cli import main
from palpate.errors import InvalidValueError
from palpate.experiments.explore.config import ExploreConfig
from palpate.experiments.kit.contact_checks import check_compression
from support.explore_runs import plan_of


@given(st.floats(1.0, 1e6))
def test_a_stiffness_is_doubted_where_the_tip_is_not_to_blame(stiffness):
    tip = 0.5 * 2.0 / stiffness
    check_compression((1.01 * tip,), 2.0, stiffness)
    with pytest.raises(InvalidValueError) as refused:
        check_compression((0.99 * tip,), 2.0, stiffness)
    assert ("is the stiffness in another unit" in str(refused.value)) is (stiffness < 1e3)


def test_the_time_of_an_active_exploration_bounds_what_is_foreseen_of_it():
    free, *timed = (plan_of(ExploreConfig(strategy="active", time=time)) for time in (None, 1.0, 5.0, 20.0, 1e3))
    foreseen = [(each.expected_duration, each.longest_duration) for each in timed]
    assert foreseen == sorted(foreseen)
    assert foreseen[-1] == (free.expected_duration, free.longest_duration)
    expected, longest = foreseen[1]
    assert 5.0 < expected < 12.0
    assert longest < 0.1 * free.longest_duration


@pytest.mark.parametrize("form", ["csv", "jsonl"])
def test_no_zero_of_a_contact_is_written_with_a_sign(tmp_path, form):
    """A push along the normal has no spin torque: n.m is a sum of products with both signs of zero."""
    (tmp_path / "w.csv").write_text("fx,fy,fz,mx,my,mz\n0,0,-2,0,0,0\n0,0,2,0,0,0\n-1,0,0,0,0,0\n0,-1,0,0,0,0\n")
    out = tmp_path / "c.txt"
    assert (
        main(["contact", str(tmp_path / "w.csv"), "--sphere", "0.008", "--format", form, "--out", str(out)]) == 0
    )
    cells = out.read_text().replace("]", ",").replace("[", ",").replace("}", ",").replace(" ", "").split(",")
    assert not {"-0.0", '"spin_torque_Nm":-0.0'} & set(cells)
