"""What is said of values in another unit, of another type, or out of all proportion."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from palpate.cli import main
from palpate.errors import InvalidValueError
from palpate.experiments.explore.config import ExploreConfig
from palpate.experiments.friction.config import FrictionConfig
from palpate.experiments.grasp.config import GraspConfig
from palpate.experiments.kit.contact_checks import check_compression
from palpate.experiments.regulate.config import RegulateConfig
from support.explore_runs import plan_of
from support.grasp_runs import plan_of as grasp_plan_of

ALL = (ExploreConfig, RegulateConfig, FrictionConfig, GraspConfig)


@pytest.mark.parametrize("kind", [ExploreConfig, RegulateConfig, FrictionConfig])
def test_noise_in_millinewtons_is_told_as_such(kind):
    with pytest.raises(InvalidValueError, match=r"force_noise = 10 N: too large .* 15 N; for 10 mN give 0\.01"):
        kind(force_noise=10.0)


@pytest.mark.parametrize("kind", ALL)
def test_friction_has_one_bound_and_per_cent_are_told(kind):
    kind(friction=10.0)
    with pytest.raises(InvalidValueError, match=r"friction = 30: must be at most 10; for 30 % give 0\.3"):
        kind(friction=30.0)


@pytest.mark.parametrize("kind", ALL)
def test_spin_length_has_one_bound_and_millimetres_are_told(kind):
    kind(spin_length=0.1)
    with pytest.raises(
        InvalidValueError, match=r"spin_length = 4 m: must be at most 0\.1 m; for 4 mm give 0\.004"
    ):
        kind(spin_length=4.0)


@pytest.mark.parametrize("kind", [ExploreConfig, RegulateConfig, FrictionConfig])
def test_a_fingertip_in_millimetres_is_told_as_such(kind):
    with pytest.raises(InvalidValueError, match=r"tip = 8 m: must be at most 2 m; for 8 mm give 0\.008"):
        kind(tip=(8.0,))


@pytest.mark.parametrize("kind", ALL)
def test_a_number_is_no_string_and_a_folder_may_be_one(kind):
    assert kind(out="x") == kind(out=Path("x"))
    with pytest.raises(InvalidValueError, match=r"friction = '0\.5': must be a number"):
        kind(friction="0.5")
    assert kind(friction=np.float32(0.5)).friction == 0.5


def test_a_force_that_is_no_number_is_refused_by_name():
    for force in ("2", None, [2.0]):
        with pytest.raises(InvalidValueError, match=r"force = .*: must be a number"):
            ExploreConfig(force=force)


@given(st.floats(1.0, 1e6))
def test_a_stiffness_is_doubted_where_the_tip_is_not_to_blame(stiffness):
    tip = 0.5 * 2.0 / stiffness
    check_compression((1.01 * tip,), 2.0, stiffness)
    with pytest.raises(InvalidValueError) as refused:
        check_compression((0.99 * tip,), 2.0, stiffness)
    assert ("is the stiffness in another unit" in str(refused.value)) is (stiffness < 1e3)


def test_a_slippery_object_is_refused_in_whole_sentences():
    with pytest.raises(InvalidValueError, match=r"\(--friction\); with mu = .* \(planned with\) and a"):
        grasp_plan_of(friction=0.01)


def test_a_swing_that_nobody_typed_is_told_as_such():
    with pytest.raises(InvalidValueError, match=r"swing = 10 N \(swing: left out, half of it\): together"):
        RegulateConfig(force=20.0, profile="step")
    with pytest.raises(InvalidValueError, match="swing = 2 N: together"):
        RegulateConfig(force=14.0, swing=2.0, profile="step")


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
