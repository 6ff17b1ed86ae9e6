"""Changing set points and gains under way: the force does not jump, commands keep to their slew, logs replay."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.controllers import (
    ExploreController,
    ExploreParameters,
    Raster,
    force_gain,
)
from palpate.controllers.paths import Follow
from palpate.runtime.data import Phase
from palpate.runtime.live import Change, LiveParameters
from palpate.runtime.replay import RecordedChanges
from support.spring_world import STIFFNESS, Explored, Plane

PERIOD, DELAYS = 1e-3, 21

GAIN = force_gain(STIFFNESS, (DELAYS + 0.5) * PERIOD)
"""A command acts `DELAYS` periods later, and is held for one: the model of `palpate.controllers.gains`."""

WANTED = ExploreParameters(force=2.0, speed=0.02, gain=GAIN, lead=GAIN.delay)

RASTER = Raster(0.2, 0.2, 0.1)

SETTLED = 1.0
"""By then the tip has landed and sweeps [s]."""

FORCES, SPEEDS = WANTED.force_range, WANTED.speed_range

GAINS = GAIN.live_range


def controlled(parameters=WANTED):
    return ExploreController(parameters, Follow(RASTER), PERIOD)


def sweep(changes=(), tilt=0.0, seconds=2.0, controller=None):
    """An exploration of the plane with changes on the way."""
    plane = Plane(tilt, RASTER.corners()[0], period=PERIOD, delays=DELAYS)
    return Explored(controller or controlled(), plane, seconds, changes)


def swept_forces(e, since):
    """Forces from a time [s] on, all of them swept."""
    first = round(since / PERIOD)
    assert set(e.names[first:]) == {Phase.SCAN}
    return e.force[first:]


single_changes = st.one_of(
    st.tuples(st.just("force"), st.floats(*FORCES)),
    st.tuples(st.just("speed"), st.floats(*SPEEDS)),
    st.tuples(st.just("force_gain"), st.floats(*GAINS)),
)

any_changes = st.lists(
    st.builds(lambda time, change: Change(time, *change), st.floats(0.0, 2.0), single_changes), max_size=12
)


@pytest.mark.slow
@settings(max_examples=25, deadline=None, derandomize=True)
@given(st.floats(1.0, FORCES[1]), single_changes, st.floats(-0.5, 0.5))
def test_after_a_change_the_force_goes_from_old_to_new_and_no_further(old, change, tilt):
    """5 % beyond the larger of both, and a twentieth of the least force beyond the smaller: contact is kept."""
    name, value = change
    new = value if name == "force" else old
    seconds = SETTLED + 0.3 + abs(new - old) * 3.0 * GAIN.delay / FORCES[0]
    e = sweep([Change(SETTLED, name, value)], tilt, seconds, controlled(replace(WANTED, force=old)))
    forces = swept_forces(e, SETTLED)
    assert forces[0] == pytest.approx(old, rel=1e-3)
    assert forces.max() <= 1.05 * max(old, new)
    assert forces.min() >= min(old, new) - 0.05 * FORCES[0] - 1e-3 * old
    assert forces[-1] == pytest.approx(new, rel=0.01, abs=0.005)


@pytest.mark.slow
@pytest.mark.parametrize("old", [0.3, 0.4, 0.6, 2.0])
@pytest.mark.parametrize("by", [0.02, 0.1, 0.2, 0.5, 3.0])
def test_with_the_strongest_live_gain_a_higher_force_is_overshot_by_less_than_5_percent(old, by):
    strongest = controlled(replace(WANTED, gain=replace(GAIN, gain=GAINS[1])))
    e = sweep([Change(1.0, "force", old), Change(2.5, "force", old + by)], 0.0, 4.0, strongest)
    assert swept_forces(e, 2.4).max() <= 1.05 * (old + by)


@pytest.mark.slow
@settings(max_examples=25, deadline=None, derandomize=True)
@given(any_changes, st.floats(-0.5, 0.5), st.sampled_from([2.0, 10.0]))
def test_whatever_is_changed_whenever_values_keep_to_their_bounds_and_rates(changes, tilt, slew):
    """Commands keep to the slew, as in every run; a replay gives the same commands bit for bit."""
    e = sweep(changes, tilt, controller=controlled(replace(WANTED, slew=slew)))
    for name, (low, high) in {"force": FORCES, "speed": SPEEDS, "force_gain": GAINS}.items():
        values = np.array([values[name] for values in e.values])
        assert low <= values.min() <= values.max() <= high
        rate = e.controller.live.parameters[name].rate
        assert np.abs(np.diff(values)).max() <= rate * PERIOD * (1 + 1e-6)
    again = controlled(replace(WANTED, slew=slew))
    recorded = RecordedChanges(again.live, e.changes)
    again.start(e.observations[0])
    for now, command in zip(e.observations, e.commands, strict=True):
        recorded.step(now.time)
        assert again.step(now) == command


def test_a_second_run_of_the_same_controller_begins_with_the_first_values():
    controller = controlled()
    untouched, changed, again = (
        sweep(changes, controller=controller).commands for changes in ((), [Change(0.5, "force", 5.0)], ())
    )
    assert changed != untouched == again


def test_without_ramps_a_change_would_be_a_blow():
    """From 2 to 10 N and back: the largest change of the command in a period."""
    changes, settled = [Change(1.0, "force", 10.0), Change(3.0, "force", 2.0)], round(SETTLED / PERIOD)
    unlimited = controlled(replace(WANTED, slew=1e6))
    given_ = unlimited.live.parameters.values()
    unlimited.live = LiveParameters(*(replace(parameter, rate=1e9) for parameter in given_))
    ramped, abrupt = sweep(changes, seconds=5.0), sweep(changes, seconds=5.0, controller=unlimited)
    assert abrupt.jumps[settled:].max() > 50.0 * ramped.jumps[settled:].max()
    assert 1.95 < ramped.force[settled:].min() <= ramped.force[settled:].max() < 10.2


@pytest.mark.parametrize("cruising", [0.1, 0.3], ids=["accelerating", "at speed"])
def test_a_lower_speed_is_reached_by_braking(cruising):
    """At the path's acceleration, on the way up as well as at speed."""
    # five times the default acceleration: at speed within the time of a test
    fast, begun = replace(WANTED, speed=0.1, acceleration=0.5), 0.6
    e = sweep([Change(begun + cruising, "speed", 0.005)], seconds=1.4, controller=controlled(fast))
    speeds = np.hypot(*e.velocity[:, :2].T)
    assert speeds[round((begun + cruising) / PERIOD) - 1] > 0.02
    assert speeds[-1] == pytest.approx(0.005)
    assert np.abs(np.diff(speeds)).max() <= fast.acceleration * PERIOD * (1 + 1e-6)
