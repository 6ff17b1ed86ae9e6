"""The phases and velocities of an exploration on a plane like a spring: sweep, losses, walls, a drifted sensor."""

import functools
import math
from dataclasses import replace

import numpy as np
import pytest

from palpate.controllers import ExploreController, ExploreParameters, Raster, force_gain
from palpate.controllers.explore import MIN_TOUCH_IN_FLIGHT
from palpate.controllers.paths import Follow, Hop, LegEnd, PathPlane, Stroke
from palpate.runtime.data import Phase, WrenchSample
from palpate.runtime.touch import Finger, Touch
from palpate.spatial import ZERO
from palpate.surfaces import Sphere
from support.spring_world import PERIOD, RADIUS, STIFFNESS, Explored, Script, SpringWorld

FORCE, SPEED, TILT = 2.0, 0.02, 0.3
SLEWING = 3
"""Periods in which the slew limit of 10 m/s^2 takes the tip from any phase's speed here to any other's."""
GAIN = force_gain(STIFFNESS, 0.0215)
WANTED = ExploreParameters(force=FORCE, speed=SPEED, gain=GAIN, lead=0.0215)
RASTER = Raster(0.006, 0.002, 0.002)
LANDED = [Phase.APPROACH, Phase.SETTLE, Phase.SCAN]


class Plane(SpringWorld):
    """A plane through the origin, tilted about y, that vanishes at the times `gone`; samples may be changed."""

    def __init__(self, tilt=0.0, gap=0.002, gone=lambda time: False, change=lambda time, wrench: wrench):
        self.out, self.change = np.array([math.sin(tilt), 0.0, math.cos(tilt)]), change
        x, y = RASTER.corners()[0]
        start = (x, y, (RADIUS + gap - x * self.out[0]) / self.out[2])
        super().__init__(lambda p: p @ self.out + 1.0 * gone(self.time), start)

    def sample(self):
        given = super().sample()
        force = np.array(given.wrenches[0].wrench[:3])
        changed = tuple(np.array(self.change(self.time, force)).tolist())
        return replace(given, wrenches=(WrenchSample(self.time, (*changed, 0.0, 0.0, 0.0), ZERO),))


def controller(parameters=WANTED, strategy=None):
    return ExploreController(parameters, strategy or Follow(RASTER), PERIOD)


@functools.cache
def swept(tilt):
    return Explored(controller(), Plane(tilt)), Plane(tilt).out


@pytest.mark.parametrize("tilt", [0.0, TILT, -TILT])
def test_it_lands_settles_sweeps_lifts_and_is_done(tilt):
    """The approach goes straight down at landing speed, settling is no faster, the lift goes along the normal."""
    e, out = swept(tilt)
    assert e.phases == [*LANDED, Phase.LIFT, Phase.DONE]
    assert np.all(e.velocity[-1] == 0.0)
    approach, settle, lift = (e.velocity[e.at(phase)] for phase in (Phase.APPROACH, Phase.SETTLE, Phase.LIFT))
    assert np.abs(approach - [0.0, 0.0, -WANTED.landing_speed]).max() < 1e-9
    assert np.linalg.norm(settle, axis=1).max() <= WANTED.landing_speed * (1 + 1e-12)
    assert len(settle) * PERIOD == pytest.approx(WANTED.settle_time, abs=3 * PERIOD)
    assert np.abs(lift[SLEWING:-SLEWING] - WANTED.lift_speed * out).max() < 1e-9
    assert PERIOD * lift.sum(axis=0) @ out == pytest.approx(WANTED.lift_distance, rel=0.02)


@pytest.mark.parametrize("tilt", [0.0, TILT, -TILT])
def test_in_the_sweep_motion_is_tangential_and_force_control_normal(tilt):
    """v.n = k (F - f), and the rest runs along the plane with the wanted speed; the force stays."""
    e, out = swept(tilt)
    velocity, force = e.velocity[e.at(Phase.SCAN)], e.force[e.at(Phase.SCAN)]
    assert velocity @ -out == pytest.approx(GAIN.gain * (FORCE - force), abs=1e-9)
    tangential = np.linalg.norm(velocity - np.outer(velocity @ out, out), axis=1)
    assert tangential.max() == pytest.approx(SPEED, rel=0.01)
    assert force == pytest.approx(FORCE, abs=0.02)


def test_a_lost_surface_is_sought_slowly_and_not_far_then_given_up():
    plane = Plane(TILT, gone=lambda time: time >= 1.0)
    e = Explored(controller(), plane)
    assert e.phases == [*LANDED, Phase.SEEK, Phase.LOST]
    seek = e.velocity[e.at(Phase.SEEK)]
    assert np.abs(seek[SLEWING:] + WANTED.landing_speed * plane.out).max() < 1e-9
    assert PERIOD * seek.sum(axis=0) @ -plane.out == pytest.approx(WANTED.seek_distance, rel=0.02)
    assert np.all(e.velocity[-1] == 0.0)


def test_the_surface_is_sought_once_only():
    """Swept on where it is found again; without an object the approach ends after its distance."""
    again = [*LANDED, Phase.SEEK, Phase.SETTLE, Phase.SCAN]
    once = Explored(controller(), Plane(gone=lambda time: 1.0 <= time <= 1.1))
    assert once.phases == [*again, Phase.LIFT, Phase.DONE]
    twice = Explored(controller(), Plane(gone=lambda time: 1.0 <= time <= 1.1 or time > 1.6))
    assert twice.phases == [*again, Phase.LOST]
    nothing = Explored(controller(), Plane(gone=lambda time: True), seconds=30.0)
    assert nothing.phases == [Phase.APPROACH, Phase.LOST]
    way = len(nothing.names) * PERIOD * WANTED.landing_speed
    assert way == pytest.approx(WANTED.approach_distance, rel=0.01)


def test_a_single_spike_before_landing_does_not_end_the_approach():
    """One sample over the touch threshold, from noise or a knock, in free air."""

    def spiked(time, force):
        return (0.3, 0.0, 0.0) if round(time / PERIOD) in (25, 200) else force

    assert Explored(controller(), Plane(gap=0.005, change=spiked)).names[-1] is Phase.DONE


@pytest.mark.parametrize("tilt", [math.radians(80.0), math.radians(90.0), math.radians(100.0)])
def test_on_a_wall_the_exploration_is_given_up_without_a_crash_or_a_leap(tilt):
    """A path seen from above makes no way on a wall; at 90 degrees its tangent has no horizontal part at all."""
    push = (FORCE * math.sin(tilt), 0.0, FORCE * math.cos(tilt))
    e = Explored(controller(), Plane(gone=lambda time: True, change=lambda time, force: push), seconds=4.0)
    assert e.names[-1] is Phase.LOST
    assert np.linalg.norm(e.velocity, axis=1).max() < 2 * SPEED


@pytest.mark.parametrize("lost", [False, True])
@pytest.mark.parametrize(("tilt", "slew"), [(0.0, 2.0), (0.0, 10.0), (TILT, 2.0), (TILT, 10.0)])
def test_from_rest_to_rest_no_phase_begins_or_ends_with_a_leap(tilt, lost, slew):
    """20 mm/s tangential to 5 mm/s into the surface, or 20 mm/s of lifting to rest, would be 10 m/s^2."""
    e = Explored(controller(replace(WANTED, slew=slew)), Plane(tilt, gone=lambda time: lost and time >= 1.0))
    changes = np.linalg.norm(np.diff(e.velocity, axis=0, prepend=np.zeros((1, 3))), axis=1)
    assert e.names[-1] is (Phase.LOST if lost else Phase.DONE)
    assert 0.5 * slew * PERIOD <= changes.max() <= slew * PERIOD * (1 + 1e-9)  # the limit was at work
    assert np.all(e.velocity[-1] == 0.0)


def test_the_default_slew_lets_force_control_answer_a_bounce_at_once():
    """From descending at landing speed to the full retreat k (f - F) in one period."""
    plane, touch, explorer = Plane(gap=0.001), Touch(Finger(Sphere(RADIUS))), controller()
    explorer.start(touch.sense(plane.sample()))
    for _ in range(25):
        plane.move(explorer.step(touch.sense(plane.sample())).velocity_base_tip)
    plane.position[2] = RADIUS - 8.0 / STIFFNESS  # the object comes up: 8 N at once
    command = explorer.step(touch.sense(plane.sample()))
    assert command.phase is Phase.SETTLE
    assert command.velocity_base_tip == pytest.approx((0.0, 0.0, GAIN.gain * (8.0 - FORCE)))


@pytest.mark.parametrize("zero", [(0.0, 0.0, -0.15), (0.0, 0.0, 0.15), (0.1, -0.1, -0.05)])
def test_a_lift_leads_up_whatever_the_zero_of_the_sensor_shows(zero):
    """0.15 N are 45 s of 0.2 N/min, more than a touch of this finger is, and no touch at 2 N."""
    assert np.linalg.norm(zero) < MIN_TOUCH_IN_FLIGHT * FORCE
    wanted = replace(WANTED, lead=0.002, approach_distance=0.008, settle_time=0.1)
    world = Plane(gap=0.001, change=lambda time, force: force + np.array(zero) * (time >= 0.4))  # landed by then
    world.position, true, force = np.array([0.0, 0.0, RADIUS + 1e-3]), [], world.force
    world.force = lambda: true.append(force()) or true[-1]
    script = Script(PathPlane(), Hop((0.0, 0.0)), Stroke(((0.004, 0.0),)), Hop((0.008, 0.0)))
    e = Explored(controller(wanted, script), world, 6.0)
    off = e.at(Phase.LIFT) | e.at(Phase.TRAVEL)
    assert e.velocity[off, 2].min() > -1e-9 - wanted.slew * PERIOD
    assert e.position[off, 2].max() > RADIUS + 1e-3 - 2e-4  # it arrives above, and comes down only to land
    assert np.linalg.norm(true, axis=1).max() < FORCE + 1.0
    assert script.how[0] is LegEnd.REACHED
    assert LegEnd.BLOCKED not in script.how
