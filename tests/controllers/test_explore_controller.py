"""The exploration's phases and velocities, on a made-up plane that pushes back like a spring."""

import math
from dataclasses import replace

import numpy as np
import pytest

from palpate.controllers import ExploreController, ExploreParameters, Raster, force_gain
from palpate.controllers.paths import Follow
from palpate.errors import InvalidValueError
from palpate.runtime.data import ArmSample, Phase, Sample, WrenchSample
from palpate.runtime.touch import Finger, Touch
from palpate.spatial import IDENTITY
from palpate.surfaces import Sphere

PERIOD, RADIUS, STIFFNESS, FORCE, SPEED = 1e-3, 0.01, 20e3, 2.0, 0.02
SLEWING = 3
"""Periods in which the slew limit of 10 m/s^2 takes the tip from any phase's speed here to any other's, both up to
23 mm/s."""
GAIN = force_gain(STIFFNESS, 0.0215)
WANTED = ExploreParameters(force=FORCE, speed=SPEED, gain=GAIN, lead=0.0215)
RASTER = Raster(0.006, 0.002, 0.002)
TILT = 0.3


class Plane:
    """A tip that moves as commanded over a plane through the origin, tilted about y; the plane may vanish."""

    def __init__(self, tilt=0.0, gap=0.002):
        self.out = np.array([math.sin(tilt), 0.0, math.cos(tilt)])
        self.there = True
        start = np.array([*RASTER.corners()[0], 0.0])
        start[2] = (RADIUS + gap - start[0] * self.out[0]) / self.out[2]
        self.position = start
        self.time = 0.0

    @property
    def force(self):
        depth = RADIUS - self.position @ self.out
        return STIFFNESS * max(depth, 0.0) if self.there else 0.0

    def sample(self):
        f = self.force * self.out
        # through the contact point, which lies below the centre of the sphere: no moment about the centre
        wrench = (*f.tolist(), 0.0, 0.0, 0.0)
        arm = ArmSample(self.time, tuple(self.position.tolist()), IDENTITY, (0.0, 0.0, 0.0))
        return Sample(self.time, arm, (WrenchSample(self.time, wrench, (0.0, 0.0, 0.0)),))

    def move(self, command):
        self.position = self.position + PERIOD * np.array(command.velocity_base_tip)
        self.time += PERIOD


def explore(plane, seconds=6.0, vanish=None, back=None, parameters=WANTED):
    """Rows of (time, phase, velocity, force, touching); the plane vanishes and returns at given times."""
    touch = Touch(Finger(Sphere(RADIUS)))
    controller = ExploreController(parameters, Follow(RASTER), PERIOD)
    controller.start(touch.sense(plane.sample()))
    rows = []
    while plane.time < seconds:
        plane.there = vanish is None or plane.time < vanish or (back is not None and plane.time > back)
        now = touch.sense(plane.sample())
        command = controller.step(now)
        velocity = np.array(command.velocity_base_tip)
        rows.append((plane.time, command.phase, velocity, plane.force, now.fingers[0].touching))
        if command.phase.is_final:
            break
        plane.move(command)
    return rows


def phases(rows):
    sequence = [row[1] for row in rows]
    return [p for i, p in enumerate(sequence) if i == 0 or p != sequence[i - 1]]


@pytest.mark.parametrize("tilt", [0.0, TILT, -TILT])
def test_it_lands_settles_sweeps_lifts_and_is_done(tilt):
    rows = explore(Plane(tilt))
    assert phases(rows) == [Phase.APPROACH, Phase.SETTLE, Phase.SCAN, Phase.LIFT, Phase.DONE]
    assert np.all(rows[-1][2] == 0.0)
    settle = [row[0] for row in rows if row[1] is Phase.SETTLE]
    assert settle[-1] - settle[0] == pytest.approx(WANTED.settle_time, abs=2 * PERIOD)


@pytest.mark.parametrize("tilt", [0.0, TILT])
def test_the_approach_goes_straight_down_at_landing_speed_and_settling_is_no_faster(tilt):
    for _, phase, velocity, _, _ in explore(Plane(tilt)):
        if phase is Phase.APPROACH:
            assert velocity.tolist() == pytest.approx([0.0, 0.0, -WANTED.landing_speed])
        elif phase is Phase.SETTLE:
            assert np.linalg.norm(velocity) <= WANTED.landing_speed * (1 + 1e-12)


@pytest.mark.parametrize("tilt", [0.0, TILT, -TILT])
def test_in_the_sweep_motion_is_tangential_and_force_control_normal(tilt):
    """v.n = k (F - f), and the rest runs along the plane with the wanted speed."""
    plane = Plane(tilt)
    n = -plane.out
    fastest = 0.0
    for _, phase, velocity, force, _ in explore(plane):
        if phase is not Phase.SCAN:
            continue
        assert velocity @ n == pytest.approx(GAIN.gain * (FORCE - force), abs=1e-9)
        tangential = np.linalg.norm(velocity - (velocity @ n) * n)
        assert tangential <= SPEED * (1 + 0.01)
        fastest = max(fastest, tangential)
    assert fastest == pytest.approx(SPEED, rel=0.01)


def test_the_force_settles_and_stays():
    forces = [row[3] for row in explore(Plane(TILT)) if row[1] is Phase.SCAN]
    assert forces == pytest.approx([FORCE] * len(forces), abs=0.02)


def test_it_lifts_off_along_the_normal_by_the_wanted_distance():
    plane = Plane(TILT)
    lift = [row[2] for row in explore(plane) if row[1] is Phase.LIFT]
    for velocity in lift[SLEWING:-SLEWING]:
        assert velocity == pytest.approx(WANTED.lift_speed * plane.out, abs=1e-9)
    assert PERIOD * sum(lift) @ plane.out == pytest.approx(WANTED.lift_distance, rel=0.02)


def test_a_lost_surface_is_sought_slowly_and_not_far_then_given_up():
    rows = explore(Plane(TILT), vanish=1.0)
    assert phases(rows)[-3:] == [Phase.SCAN, Phase.SEEK, Phase.LOST]
    seek = [row[2] for row in rows if row[1] is Phase.SEEK]
    into = -Plane(TILT).out
    for velocity in seek[SLEWING:]:
        assert velocity == pytest.approx(WANTED.landing_speed * into, abs=1e-9)
    assert PERIOD * sum(seek) @ into == pytest.approx(WANTED.seek_distance, rel=0.02)
    assert np.all(rows[-1][2] == 0.0)


def test_a_surface_found_again_is_swept_on():
    rows = explore(Plane(), vanish=1.0, back=1.1)
    assert phases(rows) == [
        Phase.APPROACH,
        Phase.SETTLE,
        Phase.SCAN,
        Phase.SEEK,
        Phase.SETTLE,
        Phase.SCAN,
        Phase.LIFT,
        Phase.DONE,
    ]


def test_the_surface_is_sought_once_only():
    plane = Plane()
    touch = Touch(Finger(Sphere(RADIUS)))
    controller = ExploreController(WANTED, Follow(RASTER), PERIOD)
    controller.start(touch.sense(plane.sample()))
    seen = []
    while plane.time < 5.0:
        plane.there = not (0.9 < plane.time < 1.0 or plane.time > 1.5)
        command = controller.step(touch.sense(plane.sample()))
        seen.append(command.phase)
        if command.phase.is_final:
            break
        plane.move(command)
    assert seen[-1] is Phase.LOST
    gaps = [p for i, p in enumerate(seen) if i and p != seen[i - 1]]
    assert gaps.count(Phase.SEEK) == 1


def test_without_an_object_the_approach_ends():
    rows = explore(Plane(), seconds=30.0, vanish=0.0)
    assert phases(rows) == [Phase.APPROACH, Phase.LOST]
    assert rows[-1][0] * WANTED.landing_speed == pytest.approx(WANTED.approach_distance, rel=0.01)


def test_a_single_spike_before_landing_does_not_end_the_approach():
    """One sample over the touch threshold, from noise or a knock, and nothing there."""
    plane = Plane(gap=0.005)
    touch = Touch(Finger(Sphere(RADIUS)))
    controller = ExploreController(WANTED, Follow(RASTER), PERIOD)
    controller.start(touch.sense(plane.sample()))
    seen = []
    for i in range(9000):
        s = plane.sample()
        if i in (50, 400):
            spike = WrenchSample(s.time, (0.3, 0.0, 0.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
            s = Sample(s.time, s.arm, (spike,))
        command = controller.step(touch.sense(s))
        seen.append(command.phase)
        if command.phase.is_final:
            break
        plane.move(command)
    assert seen[-1] is Phase.DONE


@pytest.mark.parametrize("tilt", [math.radians(80.0), math.radians(90.0), math.radians(100.0)])
def test_on_a_wall_the_exploration_is_given_up_without_a_crash_or_a_leap(tilt):
    """A path seen from above makes no way on a wall; at 90 degrees its tangent has no horizontal part at all."""
    out = (math.sin(tilt), 0.0, math.cos(tilt))
    wrench = (*(FORCE * c for c in out), 0.0, 0.0, 0.0)
    touch, controller = Touch(Finger(Sphere(RADIUS))), ExploreController(WANTED, Follow(RASTER), PERIOD)
    position, seen = np.array([*RASTER.corners()[0], 0.0]), []
    for i in range(2000):
        arm = ArmSample(i * PERIOD, tuple(position.tolist()), IDENTITY, (0.0, 0.0, 0.0))
        now = touch.sense(Sample(arm.time, arm, (WrenchSample(arm.time, wrench, (0.0, 0.0, 0.0)),)))
        if i == 0:
            controller.start(now)
        command = controller.step(now)
        seen.append(command.phase)
        assert np.linalg.norm(command.velocity_base_tip) < 2 * SPEED
        if command.phase.is_final:
            break
        position = position + PERIOD * np.array(command.velocity_base_tip)
    assert seen[-1] is Phase.LOST


def test_starting_again_forgets_everything():
    controller = ExploreController(WANTED, Follow(RASTER), PERIOD)
    runs = []
    for _ in range(2):
        plane, touch = Plane(TILT), Touch(Finger(Sphere(RADIUS)))
        controller.start(touch.sense(plane.sample()))
        commands = []
        for _ in range(3000):
            command = controller.step(touch.sense(plane.sample()))
            commands.append(command)
            plane.move(command)
        runs.append(commands)
    assert runs[0] == runs[1]


@pytest.mark.parametrize("tilt", [0.0, TILT])
@pytest.mark.parametrize("vanish", [None, 1.0], ids=["done", "lost"])
@pytest.mark.parametrize("slew", [2.0, 10.0])
def test_from_rest_to_rest_no_phase_begins_or_ends_with_a_leap(tilt, vanish, slew):
    """20 mm/s tangential to 5 mm/s into the surface, or 20 mm/s of lifting to rest, would be 20 m/s^2."""
    rows = explore(Plane(tilt), vanish=vanish, parameters=replace(WANTED, slew=slew))
    assert rows[-1][1] is (Phase.DONE if vanish is None else Phase.LOST)
    velocities = np.array([np.zeros(3), *[row[2] for row in rows]])
    changes = np.linalg.norm(np.diff(velocities, axis=0), axis=1)
    assert changes.max() <= slew * PERIOD * (1 + 1e-9)
    assert changes.max() >= 0.5 * slew * PERIOD  # the limit was at work
    assert np.all(velocities[-1] == 0.0)


def test_force_control_does_not_wait_for_the_slew_limit_on_landing():
    """From descending at landing speed to retreating at it in one period: a bounce is answered at once."""
    plane, touch = Plane(gap=0.001), Touch(Finger(Sphere(RADIUS)))
    controller = ExploreController(WANTED, Follow(RASTER), PERIOD)
    controller.start(touch.sense(plane.sample()))
    for _ in range(50):
        plane.move(controller.step(touch.sense(plane.sample())))
    plane.position[2] = RADIUS - 8.0 / STIFFNESS  # the object comes up: 8 N at once
    command = controller.step(touch.sense(plane.sample()))
    assert command.phase is Phase.SETTLE
    assert command.velocity_base_tip == pytest.approx((0.0, 0.0, WANTED.landing_speed))


@pytest.mark.parametrize("bad", [0.0, -1.0, math.nan, math.inf])
@pytest.mark.parametrize("name", ["force", "speed", "lead", "landing_speed", "approach_distance", "slew"])
def test_parameters_that_cannot_be_are_refused_by_name(name, bad):
    given = {"force": 2.0, "speed": 0.02, "lead": 0.02} | {name: bad}
    with pytest.raises(InvalidValueError, match=name):
        ExploreParameters(gain=GAIN, **given)


@pytest.mark.parametrize("bad", [0.0, -1.0, math.nan, math.inf])
@pytest.mark.parametrize("name", ["force_range", "speed_range"])
def test_ranges_that_cannot_be_are_refused_by_name(name, bad):
    for ends in ((bad, 1.0), (0.1, bad)):
        with pytest.raises(InvalidValueError, match=name):
            replace(WANTED, **{name: ends})
