"""The way through the air: straight up and level across; what is touched on it is left, got over, or ends it."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.controllers import ExploreParameters, Room, force_gain
from palpate.controllers.flight import MAX_BUMPS, Airspace, Flight
from palpate.controllers.paths import PathPlane
from palpate.controllers.paths.path_follower import ARRIVAL_DISTANCE, STEERING_RATE
from palpate.controllers.tip_state import TipState
from palpate.runtime.data import Phase
from palpate.spatial import ZERO, add_scaled, norm, scale

PERIOD, TOP = 2e-3, 0.02

WANTED = ExploreParameters(
    force=2.0,
    speed=0.02,
    gain=force_gain(20e3, 0.02),
    lead=0.02,
    travel_speed=0.05,
    room=Room((-1.0,) * 3, (1.0,) * 3),
)

SPACE = Airspace(WANTED, PathPlane(), PERIOD, TOP)

DOWN, UP, SIDE = (0.0, 0.0, -1.0), (0.0, 0.0, 1.0), (1.0, 0.0, 0.0)


def begin(tip, normal=None, **given):
    return Flight(SPACE, TipState(0.0, tip, tip, normal is not None, normal or ZERO, ZERO), **given)


def fly(tip, normal=None, feels=lambda tip, time: None, seconds=40.0, **given):
    """Carry a flight out; returns it and rows of (phase, tip, velocity).

    `feels` gives the normal of a contact, if there is one.
    """
    flight, rows, time = begin(tip, normal, **given), [], 0.0
    while flight.arrived is None and time < seconds:
        normal = feels(tip, time)
        state = TipState(time, tip, tip, normal is not None, normal or ZERO, ZERO)
        flight.step(state)
        velocity = flight.velocity(state, normal or DOWN, 0.0)
        rows.append((flight.phase, tip, velocity))
        tip, time = add_scaled(tip, PERIOD, velocity), time + PERIOD
    return flight, rows


places = st.tuples(st.floats(-0.05, 0.05), st.floats(-0.05, 0.05))


@pytest.mark.slow
@settings(max_examples=20, deadline=None, derandomize=True)
@given(places, places, st.floats(0.0, TOP), st.floats(0.0, TOP))
def test_first_up_then_across_within_speed_and_acceleration(a, b, low, high):
    flight, rows = fly((*a, low), goal=(b, high))
    assert flight.arrived
    if not rows:
        assert math.dist(a, b) <= 1e-3
        return
    tips, velocities = np.array([row[1:] for row in rows]).transpose(1, 0, 2)
    across, speed = np.hypot(*velocities[:, :2].T) > 0.0, np.linalg.norm(velocities, axis=1)
    assert not (across & (velocities[:, 2] != 0.0)).any()
    assert tips[across, 2].min(initial=TOP) >= min(max(low, high), TOP) - 6e-4
    assert np.hypot(*(tips[-1, :2] - b)) <= 6e-4
    # below where the run began, no faster than on landing
    fastest = WANTED.travel_speed if high >= TOP - 5e-4 else WANTED.landing_speed
    assert speed.max() <= fastest * (1 + 1e-9)
    assert (
        np.diff(speed, prepend=0.0).max() <= WANTED.acceleration * PERIOD + STEERING_RATE * ARRIVAL_DISTANCE + 1e-9
    )


@pytest.mark.parametrize("slope", [0.0, 0.7, 1.5])
def test_a_tip_on_the_surface_first_leaves_it_along_the_normal(slope):
    """A return leads back along the axis."""
    into = (-math.sin(slope), 0.0, -math.cos(slope))
    flight, rows = fly(ZERO, into, lambda tip, time: into if norm(tip) < 1e-4 else None, goal=((0.03, 0.0), TOP))
    lift = [row for row in rows if row[0] is Phase.LIFT]
    assert lift[0][2] == pytest.approx(scale(-WANTED.lift_speed, into))
    assert norm(lift[-1][1]) == pytest.approx(WANTED.lift_distance, abs=2e-4)
    assert flight.arrived
    back, rows = fly(ZERO, (0.6, 0.0, -0.8), back=3e-3)
    assert rows[-1][1] == pytest.approx((0.0, 0.0, 3e-3), abs=1e-4)
    assert back.arrived


def test_between_two_walls_a_lift_ends_after_twice_its_time_and_the_tip_rises():
    """Walls 2 mm apart: beside each contact the other wall is less than a lift away; no lift gets 5 mm away."""

    def held(tip, time):
        side = 1.0 if int(time / PERIOD) % 2 else -1.0
        return scale(side, SIDE) if tip[2] < 0.01 else None

    flight, rows = fly(ZERO, SIDE, held, goal=((0.03, 0.0), TOP))
    lifted = sum(row[0] is Phase.LIFT for row in rows) * PERIOD
    assert lifted == pytest.approx(2.0 * WANTED.lift_distance / WANTED.lift_speed, abs=5 * PERIOD)
    assert flight.arrived


def test_rising_along_a_wall_continues_and_under_a_ledge_does_not():
    """A ledge from x = -1 mm on, met at a height of 10 mm, is left sideways and downwards."""
    up, leaning = ((0.0, 0.0), TOP), (0.6, 0.0, 0.8)
    along, rows = fly(ZERO, feels=lambda tip, time: SIDE if tip[2] < 0.01 else None, goal=up)
    assert {row[0] for row in rows} == {Phase.TRAVEL}

    def ledge(tip, time):
        return leaning if 0.01 < tip[2] < 0.013 and tip[0] > -1e-3 else None

    under, rows = fly(ZERO, feels=ledge, goal=up)
    assert Phase.LIFT in {row[0] for row in rows}
    assert not any(0.0105 < row[1][2] < 0.0125 for row in rows if row[1][0] > -1e-3)
    assert along.arrived
    assert under.arrived


def test_a_sensor_that_always_feels_something_does_not_let_it_fly():
    """Drift, or an object that follows the tip: one lift is tried."""
    flight, rows = fly(ZERO, UP, lambda tip, time: UP, goal=((0.03, 0.0), TOP))
    assert flight.arrived is False
    assert len(rows) * PERIOD < 2.5 * WANTED.lift_distance / WANTED.lift_speed


def test_a_flight_passes_over_a_post_and_is_blocked_by_a_wall_up_to_where_the_run_began():
    """The post is 6 mm high. A goal outside of the room is refused before the tip moves."""

    def post(tip, time):
        return SIDE if 0.01 < tip[0] < 0.012 and tip[2] < 0.006 else None

    over, rows = fly((0.0, 0.0, 2e-3), feels=post, goal=((0.03, 0.0), 2e-3))
    assert over.arrived
    assert max(row[1][2] for row in rows) < 2e-3 + 2 * WANTED.lift_distance
    top = (0.0, 0.0, TOP)
    blocked, rows = fly(top, feels=lambda tip, time: SIDE if tip[0] > 0.01 else None, goal=((0.03, 0.0), TOP))
    assert blocked.arrived is False
    assert blocked.velocity(TipState(0.0, ZERO, ZERO, True, SIDE, ZERO), SIDE, 0.0) == ZERO
    assert rows[-1][1][0] < 0.0102
    assert begin(top, goal=((1.5, 0.0), TOP)).arrived is False


def test_knock_after_knock_it_gives_up():
    """Touched again wherever it is, but free in between."""
    knocks = []

    def feels(tip, time):
        knocks.extend([time] if int(time / PERIOD) % 400 == 399 else [])
        return SIDE if knocks and knocks[-1] == time else None

    assert fly(ZERO, feels=feels, seconds=60.0, goal=((0.9, 0.0), 2e-3))[0].arrived is False
    assert len(knocks) <= MAX_BUMPS + 1


def test_a_surface_that_comes_after_the_tip_is_outrun():
    flight, state = begin(ZERO, DOWN), TipState(0.0, ZERO, ZERO, True, DOWN, ZERO)
    assert flight.velocity(state, DOWN, -0.03)[2] == pytest.approx(WANTED.lift_speed + 0.03)
    assert flight.velocity(state, DOWN, 0.03)[2] == pytest.approx(WANTED.lift_speed)
