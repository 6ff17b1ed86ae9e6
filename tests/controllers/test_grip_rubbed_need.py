"""The grip a load needs where e was measured up to some normal force only."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.controllers.grip.need import NeedWithSpin
from palpate.controllers.grip.rubbed_need import NeedWithinRubbed
from palpate.errors import InvalidValueError
from palpate.friction.limit_surface import LimitSurface

surfaces = st.builds(
    LimitSurface, st.floats(0.1, 1.2), st.floats(1e-3, 8e-3), st.floats(0.0, 1.0 / 3.0), st.floats(1.0, 2.0)
)
forces, torques, largest = st.floats(0.0, 8.0), st.floats(0.0, 0.05), st.floats(0.2, 20.0)


@settings(max_examples=150)
@given(surfaces, forces, torques, largest)
def test_what_was_not_rubbed_never_bears_more_than_what_was(surface, force, torque, most):
    """Beyond the largest force the true e lies between that there and the one that goes on growing."""
    grown = NeedWithSpin().least(surface, force, torque)
    need = NeedWithinRubbed(most).least(surface, force, torque)
    assert need >= grown * (1.0 - 1e-12)
    if grown <= most:
        assert need == grown
    else:
        stays = LimitSurface(surface.friction, surface.spin_length_at(most), 0.0, surface.norm_exponent)
        assert stays.load_ratio(need, force, torque) == pytest.approx(1.0)


@settings(max_examples=100)
@given(surfaces, forces, torques, largest)
def test_no_step_where_rubbing_ended(surface, force, torque, most):
    """A grip that jumps would be a blow: just above the border it is what it is just below."""
    need = NeedWithinRubbed(most)
    at = NeedWithSpin().least(surface, force, torque)
    if at < 1e-3:
        return
    scale = most / at  # about which the need comes up to the border
    below, above = (need.least(surface, share * scale * force, share * scale * torque) for share in (0.999, 1.001))
    assert 0.0 <= above - below <= 0.01 * above


def test_where_nothing_was_rubbed_it_is_as_the_surface_says():
    surface = LimitSurface(0.5, 0.004, 0.3, 1.5)
    need = NeedWithinRubbed(float("inf"))
    assert need.least(surface, 3.0, 0.02) == surface.least_normal_force(3.0, 0.02)
    with pytest.raises(InvalidValueError, match="largest"):
        NeedWithinRubbed(0.0)
