"""Strategies carried out on the simulated stage: what they meet, what they mark, what the map is made of."""

import math

import numpy as np
import pytest
import trimesh

from palpate.controllers import Raster, Room
from palpate.controllers.paths import (
    Contour,
    Follow,
    LegEnd,
    LevelSteering,
    PathEvent,
    PathPlane,
    Taps,
    Waypoints,
)
from palpate.runtime import Ending, Limits, Phase
from palpate.sim import Box, ContactLaw
from palpate.sim.objects.heights import bumps
from palpate.sim.objects.mesh import TracedMesh
from palpate.sim.objects.motion import DrivenJoint, JointKind, MovingTarget, Ramp
from palpate.sim.objects.torus import Torus
from support.explored_stage import PERIOD, RADIUS, explored
from support.meshes import joined

ABOVE = RADIUS + 1e-3
LIMIT = Limits().force
LINE = Waypoints(((-0.008, 0.0), (0.008, 0.0)))


class Sharp(TracedMesh):
    """A mesh that is touched although it is too hollow for the tip: where that touches is where it is deepest."""

    def check_tip(self, radius):
        pass


def blocks(*bounds):
    return Sharp(joined(*(trimesh.creation.box(bounds=each) for each in bounds)))


def two_floors(height, gap=1e-5):
    """One up to x = 0, another from x = gap on, which is so much higher."""
    return blocks(((-0.02, -0.01, -0.02), (0.0, 0.01, 0.0)), ((gap, -0.01, -0.02), (0.02, 0.01, height)))


def events(e):
    return [mark.event for mark in e.strategy.marks]


def check_on_surface(e, target, rms=2e-6):
    off = target.signed_distance(e.points)
    assert np.sqrt(np.mean(off**2)) < rms
    e.check_ended()


@pytest.mark.slow
def test_round_a_box_with_round_edges_at_constant_height():
    """Below its top, on walls: there is no limit of steepness there, and the tip touches beside, not below."""
    solid = trimesh.convex.convex_hull(
        np.concatenate(
            [
                trimesh.creation.icosphere(subdivisions=4, radius=3e-3).vertices + corner
                for corner in trimesh.creation.box(extents=(0.018, 0.012, 0.014)).vertices
            ]
        )
    )
    target = TracedMesh(joined(solid))
    plane = PathPlane((0.0, 0.0, 3e-3))
    at = (0.0115, 0.0)  # on the rounding: the flat top has no way around it
    contour = Contour(at, LevelSteering(plane), plane, 0.3)
    e = explored(target, contour, (*at, target.top + ABOVE), seconds=60.0)
    assert contour.closed
    check_on_surface(e, target, 20e-6)
    # at the tip's level the way is a rectangle whose corners are rounded by 3 mm and the tip
    assert contour.gone == pytest.approx(2 * (0.018 + 0.012) + 2 * math.pi * (3e-3 + RADIUS), abs=3e-3)
    on_walls = np.abs(e.record.normal[e.scan][:, 2]) < 0.05
    assert on_walls.mean() > 0.5


# steps, holes, walls


def along_line(target, **given):
    e = explored(target, Follow(LINE), (-0.008, 0.0, target.top + ABOVE), seconds=30.0, **given)
    e.check_ended()
    return e


def test_a_step_down_is_passed_and_marked():
    e = along_line(two_floors(-1.5e-3))
    assert e.ends == [LegEnd.REACHED, LegEnd.REACHED]
    (mark,) = e.strategy.marks
    assert mark.event is PathEvent.STEP
    assert "1.50 mm lower" in mark.reason
    assert mark.position == pytest.approx((0.0, 0.0, 0.0), abs=1e-4)


def test_at_a_wall_the_stroke_ends_and_the_path_goes_on_above():
    e = along_line(two_floors(6e-3), approach_distance=0.012)
    assert e.ends == [LegEnd.REACHED, LegEnd.STEEP, LegEnd.REACHED, LegEnd.REACHED]
    assert [event for event in events(e) if event is not PathEvent.EDGE] == [PathEvent.TIGHT, PathEvent.STEEP]
    behind = e.points[:, 0] > 1e-3
    assert e.points[behind, 2] == pytest.approx(np.full(behind.sum(), 6e-3), abs=1e-4)
    assert behind.sum() * PERIOD > 0.15


@pytest.mark.slow
@pytest.mark.parametrize("gap", [2.5e-3, 4e-3])
def test_a_hole_narrower_than_the_tip_is_passed_and_marked(gap):
    e = along_line(two_floors(0.0, gap))
    assert e.ends == [LegEnd.REACHED, LegEnd.REACHED]
    assert events(e) == [PathEvent.HOLE]


@pytest.mark.slow
@pytest.mark.parametrize("height", [1e-3, 2e-3])
def test_a_step_up_is_marked_and_what_lies_behind_it_swept(height):
    e = along_line(two_floors(height))
    assert PathEvent.TIGHT in events(e)
    behind = e.points[:, 0] > 3e-3
    assert np.median(e.points[behind, 2]) == pytest.approx(height, abs=2e-5)


# beside the object, out of reach, lost


@pytest.mark.slow
def test_a_raster_over_the_rim_sweeps_what_there_is():
    target = Box((0.016, 0.016, 0.01))
    raster = Raster(0.024, 0.008, 0.004, (0.006, 0.0))
    start = (*raster.corners()[0], target.top + ABOVE)
    e = explored(target, Follow(raster), start, seconds=120.0, approach_distance=0.012)
    check_on_surface(e, target, 5e-6)
    for row in (-4e-3, 0.0, 4e-3):
        swept = np.abs(e.tip[:, 1] - row) < 2e-4
        assert np.ptp(e.tip[swept, 0]) > 4e-3  # the gap doubles from miss to miss
    assert {PathEvent.STEEP, PathEvent.UNREACHABLE} <= set(events(e))


def test_what_the_robot_cannot_reach_is_marked_and_the_rest_swept():
    target = Box((0.06, 0.06, 0.01))
    raster = Raster(0.012, 0.004, 0.004)
    start = (*raster.corners()[0], target.top + ABOVE)
    room = Room((-0.02, -0.02, -1.0), (0.003, 0.02, 1.0))
    tight = Limits(workspace_lower=(-0.021, -0.021, -1.0), workspace_upper=(0.004, 0.021, 1.0))  # to stop in
    e = explored(target, Follow(raster), start, seconds=30.0, room=room, limits=tight)
    check_on_surface(e, target)
    assert e.tip[:, 0].max() < 0.003
    assert PathEvent.BLOCKED in events(e)
    assert {event for event in events(e) if event is not PathEvent.BLOCKED} <= {PathEvent.UNREACHABLE}


@pytest.mark.parametrize("axis", [(0.0, 0.0, -1.0), (1.0, 0.0, 0.0)], ids=["down", "aside"])
def test_an_object_that_is_taken_away_is_sought_once_and_given_up(axis):
    speed = 0.2 if axis[2] else 0.05
    target = MovingTarget(Box((0.04, 0.04, 0.01)), [DrivenJoint(JointKind.SLIDE, axis, Ramp(speed, 0.8))])
    raster = Raster(0.012, 0.004, 0.004)
    e = explored(target, Follow(raster), (*raster.corners()[0], 0.005 + ABOVE), seconds=20.0)
    e.check_ended(Ending.LOST)
    assert e.phases[-4:] == [Phase.SCAN, Phase.SEEK, Phase.LOST, Phase.STOP]
    assert events(e)[-1] is PathEvent.LOST


@pytest.mark.slow
@pytest.mark.parametrize("hardness", [1.0, 5.0])
def test_what_is_hit_while_travelling_stays_below_the_limit(hardness):
    """Touch by touch along a floor that becomes a block, with the way between them below its top."""
    target = two_floors(6e-3)
    law = ContactLaw(stiffness=hardness * 20e3)
    taps = Taps(((-0.008, 0.0), (0.008, 0.0)), 1e-3)
    start = (-0.008, 0.0, target.top + ABOVE)
    e = explored(target, taps, start, law=law, seconds=30.0, approach_distance=0.012)
    assert e.most_force < LIMIT
    assert e.ends == [LegEnd.REACHED, LegEnd.REACHED]
    assert np.median(e.points[-50:, 2]) == pytest.approx(6e-3, abs=1e-4)  # compressed less than a map allows for


@pytest.mark.slow
@pytest.mark.parametrize(
    ("target", "raster", "error"),
    [
        (bumps(), Raster(0.04, 0.008, 0.008), 0.20),
        (Torus(0.03, 0.012), Raster(0.004, 0.02, 0.02, (0.03, 0.0)), 0.15),
    ],
    ids=["bumps", "torus"],
)
def test_the_force_is_held_on_surfaces_that_are_not_convex(target, raster, error):
    e = explored(target, Follow(raster), (*raster.corners()[0], target.top + ABOVE), seconds=30.0)
    assert e.record.touching[e.scan].all()
    assert e.force_rms() < error
    check_on_surface(e, target, 0.02e-3)
