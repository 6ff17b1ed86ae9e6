"""Limit surfaces: what is borne, what slips and how, how far away slip is."""

import dataclasses
import math

import mpmath
import numpy as np
import pytest
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st

from palpate import ContactLoad, LimitSurface, Slip, Sphere, contact_from_wrench
from palpate.spatial import add_scaled, rotate, scale

EXPONENTS = st.sampled_from([1.0, 1.1, 1.5, 2.0]) | st.floats(1.0, 2.0)
GROWTHS = st.sampled_from([0.0, 0.2, 1.0 / 3.0]) | st.floats(1e-3, 1.0 / 3.0)
SIGNED = st.floats(-1.0, 1.0)
SCALES = st.floats(-6.0, 6.0).map(lambda power: 10.0**power)
ROTATIONS = st.floats(-math.pi, math.pi).map(
    lambda angle: (
        (math.cos(angle), -math.sin(angle), 0.0),
        (math.sin(angle), math.cos(angle), 0.0),
        (0.0, 0.0, 1.0),
    )
)
NONE = (0.0, 0.0, 0.0)
SURFACES = st.builds(LimitSurface, st.floats(0.05, 1.5), st.floats(1e-4, 1e-2), GROWTHS, EXPONENTS)


@st.composite
def loads(draw, surface, size):
    """A load of about `size` [N] whose three parts matter about equally."""
    most = surface.friction * size
    x, y, spin = draw(SIGNED), draw(SIGNED), draw(SIGNED)
    return ContactLoad(size, (most * x, most * y, 0.0), most * surface.spin_length_at(size) * spin)


def of(surface, load, function="load_ratio"):
    return getattr(surface, function)(load.normal_force, load.tangential_length, load.spin_torque)


def combined(load, k, direction=None, factor=1.0):
    """factor load + k direction."""
    change = direction or ContactLoad(0.0, NONE, 0.0)
    return ContactLoad(
        factor * load.normal_force + k * change.normal_force,
        add_scaled(scale(factor, load.tangential_force), k, change.tangential_force),
        factor * load.spin_torque + k * change.spin_torque,
    )


def times(factor, load):
    return combined(load, 0.0, factor=factor)


@settings(deadline=None)
@given(st.data(), SURFACES, SCALES, SCALES)
def test_ratio_margin_and_least_normal_force_agree(data, surface, size, k):
    """A contact of constant size carries k times as much at k times the normal force."""
    load = data.draw(loads(surface, size))
    ratio, margin = of(surface, load), of(surface, load, "margin")
    assert margin == pytest.approx(surface.friction * size * (1.0 - ratio), abs=1e-12 * surface.friction * size)
    least = surface.least_normal_force(load.tangential_length, load.spin_torque)
    if least > 0.0:
        assert of(surface, ContactLoad(least, load.tangential_force, load.spin_torque)) == pytest.approx(1.0)
        assert (ratio < 1.0) == (least < size) or abs(ratio - 1.0) < 1e-12
    constant = dataclasses.replace(surface, load_exponent=0.0)
    one, more = of(constant, load, "margin"), of(constant, times(k, load), "margin")
    assert of(constant, times(k, load)) == pytest.approx(of(constant, load), rel=1e-12)
    assert more == pytest.approx(k * one, rel=1e-9, abs=1e-12 * k * size)


@settings(deadline=None)
@given(SURFACES.filter(lambda surface: surface.load_exponent > 0.0), SCALES, SCALES)
@example(LimitSurface(0.5, 0.004, 1.0 / 3.0, 1.0), 1.0, 0.004)
def test_the_least_normal_force_is_the_root_in_forty_digits(surface, force, arm):
    torque = force * arm * surface.spin_length
    found = surface.least_normal_force(force, torque)
    with mpmath.workdps(40):
        mu, c, g, p, f = map(
            mpmath.mpf,
            (surface.friction, surface.spin_length, surface.load_exponent, surface.norm_exponent, found),
        )

        def excess(f):
            return (force / (mu * f)) ** p + (torque / (mu * c * f ** (1 + g))) ** p - 1

        # the root to first order from here: relative error
        assert abs(excess(f) / (mpmath.diff(excess, f) * f)) < 5e-15


def on_it(surface, load):
    """The load scaled onto the surface, without its normal force."""
    ratio = of(surface, load)
    assume(ratio > 1e-3)
    return dataclasses.replace(times(1 / ratio, load), normal_force=load.normal_force)


@settings(deadline=None)
@given(st.data(), SURFACES, st.floats(0.01, 100.0))
def test_slip_takes_more_power_from_its_load_than_from_any_other(data, surface, normal_force):
    """Maximum dissipation, there and back: slip -> load and load -> slip."""
    load, other = (on_it(surface, data.draw(loads(surface, normal_force))) for _ in range(2))
    most, slip = surface.friction * normal_force, surface.slip_direction(load)

    def power(load):
        return float(np.dot(load.tangential_force, slip.velocity) + load.spin_torque * slip.spin)

    assert power(load) == pytest.approx(most, rel=1e-9)  # a slip speed of 1 m/s
    assert power(surface.load_for_slip(normal_force, slip)) == pytest.approx(most, rel=1e-9)
    assert power(other) <= most * (1.0 + 1e-9)


@settings(deadline=None)
@given(SURFACES.filter(lambda s: s.norm_exponent >= 1.05), st.floats(0.01, 100.0), SIGNED, SIGNED, SIGNED)
def test_the_load_for_a_slip_is_on_the_surface_and_slips_in_that_direction(surface, normal_force, x, y, spin):
    e = surface.spin_length_at(normal_force)
    assume(math.hypot(x, y, spin) > 1e-2)
    load = surface.load_for_slip(normal_force, Slip((x, y, 0.0), spin / e))
    assert of(surface, load) == pytest.approx(1.0, rel=1e-9)
    back = surface.slip_direction(load)
    found = np.array([*back.velocity, e * back.spin])
    length = math.hypot(x, y, spin) / np.linalg.norm(found)
    assert length * found == pytest.approx([x, y, 0.0, spin], abs=1e-9)


@settings(deadline=None)
@given(st.data(), SURFACES, ROTATIONS)
def test_turning_the_tangent_plane_turns_the_slip_and_nothing_else(data, surface, rotation):
    load, direction = data.draw(loads(surface, 2.0)), data.draw(loads(surface, 1.0))
    turned, also = (
        dataclasses.replace(each, tangential_force=rotate(rotation, each.tangential_force))
        for each in (load, direction)
    )
    assert of(surface, turned) == pytest.approx(of(surface, load), rel=1e-12)
    there, here = surface.distance_to_slip(turned, also), surface.distance_to_slip(load, direction)
    if of(surface, load) < 0.999 and here < 1e6:
        assert there == pytest.approx(here, rel=1e-6)
    slip, expected = surface.slip_direction(turned), surface.slip_direction(load)
    assert np.allclose(slip.velocity, rotate(rotation, expected.velocity), rtol=0, atol=1e-9)
    assert slip.spin == pytest.approx(expected.spin, rel=1e-9)


@st.composite
def journeys(draw):
    """A surface, a load inside, a direction; sizes from 1e-6 to 1e6, parts of them exactly 0 at times."""
    surface, size, pace = draw(SURFACES), draw(SCALES), draw(SCALES)
    load, rate = draw(loads(surface, size)), draw(loads(surface, size))
    normal, sideways, turning = draw(st.tuples(*[st.sampled_from([0.0, 1.0])] * 3))
    change = ContactLoad(
        pace * size * normal * draw(st.floats(-2.0, 2.0)),
        scale(pace * sideways, rate.tangential_force),
        pace * turning * rate.spin_torque,
    )
    return surface, load, change


SHARES = [*np.linspace(0.0, 1.0, 61).tolist(), *(1.0 - np.logspace(-9, -3, 7)).tolist()]


@settings(deadline=None, max_examples=200)
@given(journeys())
def test_the_distance_to_slip_is_the_first_exit(journey):
    surface, load, direction = journey
    found = surface.distance_to_slip(load, direction)
    if of(surface, load) >= 1.0:
        assert found == 0.0
        return
    unit = surface.friction * load.normal_force
    rate = max(abs(direction.normal_force), direction.tangential_length, abs(direction.spin_torque) / 1e-2)
    far = 1e3 * load.normal_force / rate if rate > 0.0 else 1.0
    end = min(found, far, 1e300)  # finite, however slow the direction is
    for share in SHARES:
        there = combined(load, share * end, direction)
        assert of(surface, there, "margin") >= -1e-9 * (unit + surface.friction * there.normal_force)
    if found < math.inf:
        there = combined(load, found * (1.0 + 1e-9), direction)
        assert of(surface, there, "margin") <= 1e-8 * (unit + abs(surface.friction * there.normal_force))


def test_where_the_set_is_not_convex_the_first_of_three_crossings_counts():
    """tau = mu c f^(4/3) is convex: a chord of it from 0.3 N to 8 N is outside, and its ends are inside."""
    surface = LimitSurface(0.5, 0.004, load_exponent=1.0 / 3.0)
    light, heavy = (0.5 * 0.004 * f ** (4.0 / 3.0) for f in (0.3, 8.0))
    slope = (heavy - light) / 7.7
    there, back = ContactLoad(1.0, NONE, slope), ContactLoad(-1.0, NONE, -slope)
    at_light, at_heavy = (ContactLoad(f, NONE, light + (f - 0.3) * slope) for f in (0.2, 9.0))
    assert surface.distance_to_slip(at_light, there) == pytest.approx(0.1, rel=1e-12)
    assert surface.distance_to_slip(at_heavy, back) == pytest.approx(1.0, rel=1e-12)
    assert surface.distance_to_slip(at_heavy, there) == math.inf


@settings(deadline=None)
@given(SURFACES, st.floats(0.1, 10.0), st.floats(0.05, 0.95))
def test_a_steady_pull_slips_where_force_and_torque_alone_say(surface, normal_force, share):
    most, p = surface.friction * normal_force, surface.norm_exponent
    load, unloaded = ContactLoad(normal_force, (share * most, 0.0, 0.0), 0.0), ContactLoad(normal_force, NONE, 0.0)
    for start, way, distance in (
        (load, ContactLoad(0.0, (most, 0.0, 0.0), 0.0), 1.0 - share),
        (load, ContactLoad(0.0, (-most, 0.0, 0.0), 0.0), 1.0 + share),
        (
            load,
            ContactLoad(0.0, NONE, -surface.spin_length_at(normal_force) * most),
            (1.0 - share**p) ** (1.0 / p),
        ),
        (load, ContactLoad(-normal_force, NONE, 0.0), 1.0 - share),
        (unloaded, ContactLoad(-2.0, NONE, 0.0), normal_force / 2.0),
        (unloaded, ContactLoad(2.0, NONE, 0.0), math.inf),
        (unloaded, ContactLoad(0.0, NONE, 0.0), math.inf),
    ):
        assert surface.distance_to_slip(start, way) == pytest.approx(distance, rel=1e-9)


def test_a_diamond_slips_along_the_axes_of_its_corners_and_the_normal_of_its_edges():
    """A torque alone only spins, however small it is, also on a surface that is nearly a diamond."""
    surface, e = LimitSurface(0.5, 0.004, norm_exponent=1.0), 0.004
    assert surface.slip_direction(ContactLoad(2.0, (0.0, -1.0, 0.0), 0.0)) == Slip((0.0, -1.0, 0.0), 0.0)
    assert surface.slip_direction(ContactLoad(2.0, NONE, -e)) == Slip(NONE, -1.0 / e)
    both = surface.slip_direction(ContactLoad(2.0, (0.1, 0.0, 0.0), 0.9 * e))
    assert both.velocity[0] == pytest.approx(e * both.spin)
    assert surface.load_for_slip(2.0, Slip((1.0, 0.0, 0.0), 200.0)) == ContactLoad(2.0, (1.0, 0.0, 0.0), 0.0)
    assert of(surface, surface.load_for_slip(2.0, Slip((1.0, 0.0, 0.0), 250.0))) == pytest.approx(1.0)
    slip = LimitSurface(0.5, 0.004, 0.2, 1.01).slip_direction(ContactLoad(1e299, NONE, -5e-309))
    assert slip.velocity == NONE
    assert slip.spin == pytest.approx(-1.0 / LimitSurface(0.5, 0.004, 0.2).spin_length_at(1e299))


@pytest.mark.parametrize("growth", [0.0, 0.25])
def test_without_normal_force_nothing_is_carried(growth):
    surface = LimitSurface(0.5, 0.004, growth)
    assert surface.load_ratio(0.0, 0.0, 0.0) == surface.least_normal_force(0.0, 0.0) == 0.0
    for normal_force in (0.0, -1.0):
        ratios = [surface.load_ratio(normal_force, *load) for load in ((0.1, 0.0), (0.0, 1e-9))]
        assert ratios == [math.inf, math.inf]
        assert surface.margin(normal_force, 0.1, 1e-3) < 0.0
        pulled = ContactLoad(normal_force, (0.1, 0.0, 0.0), 1e-3)
        assert surface.distance_to_slip(pulled, pulled) == 0.0
        slipping = surface.load_for_slip(normal_force, Slip((1.0, 0.0, 0.0), 1.0))
        assert (slipping.tangential_force, slipping.spin_torque) == (NONE, 0.0)
    assert surface.slip_direction(ContactLoad(1.0, NONE, 0.0)) == Slip(NONE, 0.0)
    assert surface.load_for_slip(1.0, Slip(NONE, 0.0)) == ContactLoad(1.0, NONE, 0.0)


@given(SURFACES, st.sampled_from(["normal_force", "tangential_force", "spin_torque"]), st.floats(0.0, 2.0))
def test_a_load_with_a_nan_is_nan_and_never_passes_for_one_that_is_carried(surface, lost, other):
    """One NaN is enough, also beside zeros, where it could be taken for no load at all."""
    values = {"normal_force": 1.0, "tangential_force": other, "spin_torque": 0.003 * other, lost: math.nan}
    found = [surface.load_ratio(**values), surface.margin(**values)]
    if lost != "normal_force":
        del values["normal_force"]
        found.append(surface.least_normal_force(**values))
    nan, push = ContactLoad(math.nan, (math.nan,) * 3, math.nan), ContactLoad(1.0, NONE, 0.0)
    found += [surface.distance_to_slip(nan, push), surface.distance_to_slip(push, nan)]
    assert np.isnan([*found, of(surface, nan), of(surface, nan, "margin")]).all()


SIZES = st.floats(0.0, 1e300)


@given(SURFACES, st.tuples(SIZES, SIZES), st.tuples(SIZES, SIZES))
@example(LimitSurface(0.5, 0.004, 0.2), (5e-324, 0.0), (0.0, 1.0))
@example(LimitSurface(0.5, 0.004, 0.2), (math.inf, 0.0), (0.0, 1.0))
@example(LimitSurface(0.5, 0.004, 0.2), (1.0, 0.0), (0.0, math.inf))
@example(LimitSurface(0.5, 0.004, 0.2, 1.5), (1e308, 0.0), (0.0, 1e308))
@example(LimitSurface(0.5, 0.004, 0.2, 1.5), (1.0, 0.0), (0.0, 0.01))
def test_forces_that_hold_two_loads_hold_both_together(surface, first, second):
    """The least normal force of a sum is between the larger one and the sum, however large or small they are.

    A grip thus holds a load and an error of its measurement if its reserve holds the error alone.
    """
    alone = surface.least_normal_force(*first), surface.least_normal_force(*second)
    both = surface.least_normal_force(first[0] + second[0], first[1] + second[1])
    assert max(alone) * (1.0 - 1e-12) <= both <= sum(alone) * (1.0 + 1e-12)


def test_the_load_of_a_contact_has_its_signs():
    """Pressed from above, dragged along +x and twisted about the normal, which points down into the object."""
    wrench = np.array([0.3, 0.0, 2.0, 0.0, -3e-3, 0.0])
    contact = contact_from_wrench(Sphere(0.01), wrench)
    load = ContactLoad.of(contact)
    assert load.normal_force == pytest.approx(-contact.force @ contact.normal)
    assert load.normal_force > 0.0
    force = np.array(load.tangential_force) - load.normal_force * contact.normal
    moment = np.cross(contact.centroid, force) + load.spin_torque * contact.normal
    np.testing.assert_allclose(np.concatenate([force, moment]), wrench, rtol=0, atol=1e-12)


HELD = (LimitSurface(0.5, 0.003), ContactLoad(2.0, (0.1, 0.0, 0.0), 1e-4), ContactLoad(0.1, (0.3, 0.0, 0.0), 1e-4))


@settings(deadline=None)
@given(journeys(), st.integers(-900, 900), st.integers(-900, 900))
@example(HELD, 900, 0)
@example(HELD, -900, 900)
def test_the_distance_to_slip_does_not_depend_on_the_unit_of_force(journey, of_load, of_rate):
    """Neither does it over- or underflow: e is the same length at the same load, in any unit."""
    surface, load, direction = journey
    other = dataclasses.replace(
        surface, spin_length=surface.spin_length * 2.0 ** (-surface.load_exponent * of_load)
    )
    assume(of(surface, load) < 0.999)  # on the surface, rounding decides
    there, way = times(2.0**of_load, load), times(2.0**of_rate, direction)
    assume(times(2.0**-of_load, there) == load and times(2.0**-of_rate, way) == direction)  # to the last bit
    found, wanted = other.distance_to_slip(there, way), surface.distance_to_slip(load, direction)
    if wanted == math.inf:
        assert found > 1e12
    else:
        with np.errstate(over="ignore"):
            wanted = float(np.ldexp(wanted, of_load - of_rate))
        assert found == pytest.approx(wanted, rel=1e-6, abs=1e-300)


@pytest.mark.parametrize("kind", [int, np.float32, np.float64, np.array])
def test_numbers_of_any_type_are_the_same_number(kind):
    """Also of numpy, and whole ones; results are plain floats."""
    surface = LimitSurface(kind(1), np.float32(0.5), np.float64(0.25), kind(2))
    assert surface == LimitSurface(1.0, 0.5, 0.25, 2.0)
    values = surface.friction, surface.load_ratio(kind(2), kind(1), kind(0)), surface.margin(kind(2), 1, 0)
    assert [type(value) for value in values] == [float] * 3
    assert values[1] == 0.5
