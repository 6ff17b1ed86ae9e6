"""The phases and velocities of an exploration on a plane like a spring: sweep, losses, walls, a drifted sensor."""

import functools
import math
from dataclasses import replace

import numpy as np
import pytest

from palpate.controllers import ExploreController, ExploreParameters, Raster, force_gain
from palpate.controllers.explore import MIN_TOUCH_IN_FLIGHT
from palpate.controllers.paths import Follow, Hop, LegEnd, PathPlane, Stroke
from palpate.runtime.data import Phase
from support.spring_world import PERIOD, RADIUS, STIFFNESS, Explored, Plane, Script

FORCE, SPEED, TILT = 2.0, 0.02, 0.3
SLEWING = 3
"""Periods in which the slew limit of 10 m/s^2 takes the tip from any phase's speed here to any other's."""
GAIN = force_gain(STIFFNESS, 0.0215)
WANTED = ExploreParameters(force=FORCE, speed=SPEED, gain=GAIN, lead=0.0215)
RASTER = Raster(0.006, 0.002, 0.002)
LANDED = [Phase.APPROACH, Phase.SETTLE, Phase.SCAN]


def explored(plane, parameters=WANTED, strategy=None, seconds=20.0):
    return Explored(ExploreController(parameters, strategy or Follow(RASTER), PERIOD), plane, seconds)


def plane(tilt=0.0, gap=0.002, **more):
    return Plane(tilt, RASTER.corners()[0], gap, **more)


@functools.cache
def swept(tilt):
    return explored(plane(tilt)), plane(tilt).out


@pytest.mark.parametrize("tilt", [0.0, TILT, -TILT])
def test_it_lands_settles_sweeps_lifts_and_is_done(tilt):
    """The approach leads straight down at landing speed, settling is no faster, the lift is along the normal."""
    e, out = swept(tilt)
    assert e.phases == [*LANDED, Phase.LIFT, Phase.DONE]
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
    world = plane(TILT, gone=lambda time: time >= 1.0)
    e = explored(world)
    assert e.phases == [*LANDED, Phase.SEEK, Phase.LOST]
    seek = e.velocity[e.at(Phase.SEEK)]
    assert np.abs(seek[SLEWING:] + WANTED.landing_speed * world.out).max() < 1e-9
    assert PERIOD * seek.sum(axis=0) @ -world.out == pytest.approx(WANTED.seek_distance, rel=0.02)


@pytest.mark.slow
def test_the_surface_is_sought_once_only():
    """The sweep continues where it is found again; without an object the approach ends after its distance."""
    again = [*LANDED, Phase.SEEK, Phase.SETTLE, Phase.SCAN]
    assert explored(plane(gone=lambda time: 1.0 <= time <= 1.1)).phases == [*again, Phase.LIFT, Phase.DONE]
    assert explored(plane(gone=lambda time: 1.0 <= time <= 1.1 or time > 1.6)).phases == [*again, Phase.LOST]
    nothing = explored(plane(gone=lambda time: True), seconds=30.0)
    assert nothing.phases == [Phase.APPROACH, Phase.LOST]
    way = len(nothing.names) * PERIOD * WANTED.landing_speed
    assert way == pytest.approx(WANTED.approach_distance, rel=0.01)


@pytest.mark.parametrize("tilt", [math.radians(80.0), math.radians(90.0), math.radians(100.0)])
def test_on_a_wall_the_exploration_is_given_up_without_a_crash_or_a_leap(tilt):
    """A path seen from above makes no way on a wall; at 90 degrees its tangent has no horizontal part at all."""
    push = (FORCE * math.sin(tilt), 0.0, FORCE * math.cos(tilt))
    e = explored(plane(gone=lambda time: True, change=lambda time, force: push), seconds=4.0)
    assert e.names[-1] is Phase.LOST
    assert np.linalg.norm(e.velocity, axis=1).max() < 2 * SPEED


@pytest.mark.parametrize(
    ("tilt", "slew", "lost"), [(0.0, 2.0, False), (0.0, 10.0, True), (TILT, 2.0, True), (TILT, 10.0, False)]
)
def test_no_phase_begins_or_ends_with_a_leap(tilt, slew, lost):
    """20 mm/s tangential to 5 mm/s into the surface, or 20 mm/s of lifting to rest, would be 10 m/s^2."""
    e = explored(plane(tilt, gone=lambda time: lost and time >= 1.0), replace(WANTED, slew=slew))
    assert e.names[-1] is (Phase.LOST if lost else Phase.DONE)
    assert e.jumps.max() >= 0.5 * slew * PERIOD  # the limit was at work


def test_the_default_slew_lets_force_control_answer_a_bounce_at_once():
    """From landing speed to the full retreat k (f - F) in one period.

    A spike of one sample, from noise or a knock in free air, does not end the approach.
    """
    bounce = plane(gap=0.005, change=lambda t, f: np.add(f, (0.0, 0.0, 8.0 * (t > 25.5 * PERIOD))))
    e = explored(bounce, seconds=27.5 * PERIOD)
    assert e.names[-1] is Phase.SETTLE
    assert e.velocity[25:27, 2] == pytest.approx([-WANTED.landing_speed, GAIN.gain * (8.0 - FORCE)])
    spiked = plane(gap=0.005, change=lambda t, f: np.add(f, (0.3 * (round(t / PERIOD) in (25, 200)), 0.0, 0.0)))
    assert explored(spiked).names[-1] is Phase.DONE


@pytest.mark.parametrize("zero", [(0.0, 0.0, -0.15), (0.0, 0.0, 0.15), (0.1, -0.1, -0.05)])
def test_a_lift_leads_up_whatever_the_zero_of_the_sensor_shows(zero):
    """0.15 N are 45 s of 0.2 N/min, more than a touch of this finger is, and no touch at 2 N."""
    assert np.linalg.norm(zero) < MIN_TOUCH_IN_FLIGHT * FORCE
    wanted = replace(WANTED, lead=0.002, approach_distance=0.008, settle_time=0.1)
    true, drift = [], np.array(zero)

    def change(time, force):
        true.append(force)
        return force + drift * (time >= 0.4)  # landed by then

    script = Script(PathPlane(), Hop((0.0, 0.0)), Stroke(((0.004, 0.0),)), Hop((0.008, 0.0)))
    e = explored(Plane(0.0, (0.0, 0.0), change=change), wanted, script, 6.0)
    off = e.at(Phase.LIFT) | e.at(Phase.TRAVEL)
    assert e.velocity[off, 2].min() > -1e-9 - wanted.slew * PERIOD
    assert e.position[off, 2].max() > RADIUS + 1e-3 - 2e-4  # it arrives above, and comes down only to land
    assert np.linalg.norm(true, axis=1).max() < FORCE + 1.0
    assert script.how[0] is LegEnd.REACHED
    assert LegEnd.BLOCKED not in script.how
