"""Changing set points and gains under way: the force does not jump, commands keep to their slew, logs replay."""

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.controllers import (
    ExploreController,
    ExploreParameters,
    Raster,
    force_gain,
    series_stiffness,
    tracking_delay,
)
from palpate.controllers.paths import Follow
from palpate.runtime import Ending, Limits, Supervisor, run
from palpate.runtime.data import Phase
from palpate.runtime.live import Change, LiveParameters, ScheduledChanges
from palpate.runtime.replay import RecordedChanges
from palpate.runtime.touch import Finger, Touch
from palpate.sensing.compensation import SensorPayload
from palpate.sim import ContactLaw, MujocoBackend, SphereObject, Stage, Tip, build_scene
from palpate.spatial import ZERO, norm, subtract
from palpate.surfaces import Sphere
from support.spring_world import RADIUS, STIFFNESS, SpringWorld

PERIOD, DELAYS = 1e-3, 21

GAIN = force_gain(STIFFNESS, (DELAYS + 0.5) * PERIOD)
"""A command acts `DELAYS` periods later, and is held for one: the model of `palpate.controllers.gains`."""

WANTED = ExploreParameters(force=2.0, speed=0.02, gain=GAIN, lead=GAIN.delay)

RASTER = Raster(0.2, 0.2, 0.1)

SETTLED = 1.0
"""By then the tip has landed and sweeps [s]."""

FORCES, SPEEDS = WANTED.force_range, WANTED.speed_range

GAINS = GAIN.live_range


class DelayedPlane(SpringWorld):
    """A tilted plane like a spring, and a tip that moves as commanded `DELAYS` periods ago."""

    def __init__(self, tilt):
        out = (math.sin(tilt), 0.0, math.cos(tilt))
        x, y = RASTER.corners()[0]
        super().__init__(
            lambda p: p[0] * out[0] + p[2] * out[2], (x, y, (RADIUS + 0.001 - x * out[0]) / out[2]), period=PERIOD
        )
        self.underway = [ZERO] * DELAYS

    def move(self, velocity):
        self.underway.append(velocity)
        super().move(self.underway.pop(0))


class Sweep:
    """An exploration of the plane with changes on the way."""

    def __init__(self, changes=(), tilt=0.0, seconds=2.0, parameters=WANTED, controller=None):
        plane, touch = DelayedPlane(tilt), Touch(Finger(Sphere(RADIUS)))
        self.controller = controller or ExploreController(parameters, Follow(RASTER), PERIOD)
        scheduled = ScheduledChanges(self.controller.live, changes)
        self.observations, self.commands, self.changes, self.forces, self.values = [], [], [], [], []
        self.controller.start(touch.sense(plane.sample()))
        for _ in range(round(seconds / PERIOD)):
            now = touch.sense(plane.sample())
            self.changes += scheduled.step(now.time)
            self.observations.append(now)
            self.commands.append(self.controller.step(now))
            self.forces.append(norm(now.fingers[0].wrench[:3]))
            self.values.append(self.controller.live.values)
            plane.move(self.commands[-1].velocity_base_tip)

    @property
    def jumps(self):
        """How far the commanded velocity moved from period to period, from rest on [m/s]."""
        velocities = [ZERO, *(command.velocity_base_tip for command in self.commands)]
        return [norm(subtract(b, a)) for a, b in pairwise(velocities)]

    def after(self, time):
        """Forces from then on [N], all of them swept."""
        first = round(time / PERIOD)
        assert all(command.phase is Phase.SCAN for command in self.commands[first:])
        return np.array(self.forces[first:])


single_changes = st.one_of(
    st.tuples(st.just("force"), st.floats(*FORCES)),
    st.tuples(st.just("speed"), st.floats(*SPEEDS)),
    st.tuples(st.just("force_gain"), st.floats(*GAINS)),
)


@pytest.mark.slow
@settings(max_examples=25, deadline=None, derandomize=True)
@given(st.floats(1.0, FORCES[1]), single_changes, st.floats(-0.5, 0.5))
def test_after_a_change_the_force_goes_from_old_to_new_and_no_further(old, change, tilt):
    """5 % beyond the larger of both, and a twentieth of the least force beyond the smaller: contact is kept."""
    name, value = change
    new = value if name == "force" else old
    needed = abs(new - old) * 3.0 * GAIN.delay / FORCES[0]
    parameters = replace(WANTED, force=old)
    sweep = Sweep([Change(SETTLED, name, value)], tilt, SETTLED + needed + 0.3, parameters)
    forces = sweep.after(SETTLED)
    assert forces[0] == pytest.approx(old, rel=1e-3)
    assert forces.max() <= 1.05 * max(old, new)
    assert forces.min() >= min(old, new) - 0.05 * FORCES[0] - 1e-3 * old
    assert forces[-1] == pytest.approx(new, rel=0.01, abs=0.005)


@pytest.mark.slow
@pytest.mark.parametrize("old", [0.3, 0.4, 0.6, 2.0])
@pytest.mark.parametrize("by", [0.02, 0.1, 0.2, 0.5, 3.0])
def test_with_the_strongest_live_gain_a_higher_force_is_overshot_by_less_than_5_percent(old, by):
    strongest = replace(WANTED, gain=replace(GAIN, gain=GAINS[1]))
    changes = [Change(1.0, "force", old), Change(2.5, "force", old + by)]
    assert Sweep(changes, 0.0, 4.0, strongest).after(2.4).max() <= 1.05 * (old + by)


any_changes = st.lists(
    st.builds(lambda time, change: Change(time, *change), st.floats(0.0, 2.0), single_changes), max_size=12
)


@pytest.mark.slow
@settings(max_examples=25, deadline=None, derandomize=True)
@given(any_changes, st.floats(-0.5, 0.5), st.sampled_from([2.0, 10.0]))
def test_whatever_is_changed_whenever_commands_keep_to_the_slew_and_values_to_their_bounds(changes, tilt, slew):
    sweep = Sweep(changes, tilt, 2.0, replace(WANTED, slew=slew))
    assert max(sweep.jumps) <= slew * PERIOD * (1 + 1e-9)
    for name, (low, high) in {"force": FORCES, "speed": SPEEDS, "force_gain": GAINS}.items():
        values = np.array([values[name] for values in sweep.values])
        assert values.min() >= low
        assert values.max() <= high
        rate = sweep.controller.live.parameters[name].rate
        assert np.abs(np.diff(values)).max() <= rate * PERIOD * (1 + 1e-6)


@pytest.mark.slow
@settings(max_examples=10, deadline=None, derandomize=True)
@given(any_changes, st.floats(-0.5, 0.5))
def test_a_replay_of_observations_and_changes_gives_the_same_commands_bit_for_bit(changes, tilt):
    original = Sweep(changes, tilt)
    controller = ExploreController(WANTED, Follow(RASTER), PERIOD)
    recorded = RecordedChanges(controller.live, original.changes)
    controller.start(original.observations[0])
    for now, command in zip(original.observations, original.commands, strict=True):
        recorded.step(now.time)
        assert controller.step(now) == command


def test_a_second_run_of_the_same_controller_begins_with_the_first_values():
    controller = ExploreController(WANTED, Follow(RASTER), PERIOD)
    untouched = Sweep(controller=controller).commands
    changed = Sweep([Change(0.5, "force", 5.0)], controller=controller).commands
    assert changed != untouched
    assert Sweep(controller=controller).commands == untouched


STEPS = [Change(1.0, "force", 10.0), Change(3.0, "force", 2.0)]


def without_ramps():
    """The same controller, whose changes take effect at once."""
    controller = ExploreController(replace(WANTED, slew=1e6), Follow(RASTER), PERIOD)
    given_ = controller.live.parameters.values()
    controller.live = LiveParameters(*(replace(parameter, rate=1e9) for parameter in given_))
    return controller


def test_without_ramps_a_change_would_be_a_blow():
    """The figure of the note: from 2 to 10 N and back, largest change of the command in a period."""
    ramped = Sweep(STEPS, seconds=5.0)
    abrupt = Sweep(STEPS, seconds=5.0, controller=without_ramps())
    settled = round(SETTLED / PERIOD)
    smooth, jump = max(ramped.jumps[settled:]), max(abrupt.jumps[settled:])
    assert jump > 50.0 * smooth
    assert min(ramped.forces[settled:]) > 1.95
    assert max(ramped.forces[settled:]) < 10.2


@pytest.mark.parametrize("cruising", [0.1, 0.3], ids=["accelerating", "at speed"])
def test_a_lower_speed_is_reached_by_braking(cruising):
    """At the path's acceleration, on the way up as well as at speed."""
    # five times the default acceleration: at speed within the time of a test
    fast = replace(WANTED, speed=0.1, acceleration=0.5)
    begun = 0.6
    sweep = Sweep([Change(begun + cruising, "speed", 0.005)], seconds=1.4, parameters=fast)
    speeds = np.array([math.hypot(*command.velocity_base_tip[:2]) for command in sweep.commands])
    assert speeds[round((begun + cruising) / PERIOD) - 1] > 0.02
    assert speeds[-1] == pytest.approx(0.005)
    assert np.abs(np.diff(speeds)).max() <= fast.acceleration * PERIOD * (1 + 1e-6)


def test_in_simulation_force_and_speed_change_on_a_sphere_without_leaving_it_or_pressing_harder():
    law, tip, stage, target = ContactLaw(), Tip(Sphere(0.008)), Stage(), SphereObject()
    raster, rows = Raster(0.02, 0.016, 0.004), []
    start = (*raster.corners()[0], target.top + 0.009)
    backend = MujocoBackend(build_scene(tip, target, law, start, stage), 1e-3)
    lag = tracking_delay(1e-3, stage.lag)
    gain = force_gain(series_stiffness(law.stiffness, stage.stiffness(tip.mass)), lag)
    controller = ExploreController(
        ExploreParameters(force=2.0, speed=0.02, gain=gain, lead=lag), Follow(raster), 1e-3
    )
    changes = [
        Change(1.5, "force", 4.0),
        Change(2.5, "speed", 0.03),
        Change(3.0, "force_gain", gain.live_range[1]),
        Change(3.5, "force", 1.0),
    ]
    ending = run(
        backend,
        Touch(Finger(Sphere(0.008), SensorPayload(tip.mass))),
        controller,
        Supervisor(Limits(force=60.0)),
        duration=20.0,
        live=ScheduledChanges(controller.live, changes),
        observers=(lambda _, now, command: rows.append((now, command, backend.truth().touching)),),
    ).ending
    assert ending is Ending.DONE
    scanned = [row for row in rows if row[1].phase is Phase.SCAN]
    time, force = np.array([(now.time, now.fingers[0].contact.normal_force) for now, _, _ in scanned]).T
    velocity = np.array([command.velocity_base_tip for _, command, _ in rows])
    assert all(touching for _, _, touching in scanned)
    for begin, end, low, high in ((0.8, 1.5, 2, 2), (1.5, 3.5, 2, 4), (3.5, 4.2, 1, 4), (4.2, 9.0, 1, 1)):
        held = force[(time > begin) & (time <= end)]
        assert 0.9 * low <= held.min() <= held.max() <= 1.05 * high
    assert np.linalg.norm(np.diff(velocity, axis=0), axis=1).max() <= 10.0 * 1e-3 * (1 + 1e-9)
