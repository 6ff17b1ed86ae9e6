"""Every leg that a strategy may ask for, and every end that it may come to."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from palpate.controllers import ExploreController, ExploreParameters, Room, force_gain
from palpate.controllers.paths import (
    Circuit,
    Contour,
    Follow,
    Hop,
    LegEnd,
    LevelSteering,
    PathPlane,
    SingleTouch,
    Stroke,
    Taps,
    Waypoints,
)
from palpate.controllers.paths.path_follower import MIN_CORNER_SPEED
from palpate.runtime.data import Phase
from palpate.spatial import IDENTITY
from support.spring_world import PERIOD, RADIUS, STIFFNESS, Explored, Script, SpringWorld

GAIN = force_gain(STIFFNESS, 0.0215)

WANTED = ExploreParameters(
    force=2.0, speed=0.02, gain=GAIN, lead=0.002, approach_distance=0.008, settle_time=0.1, travel_speed=0.04
)

ABOVE = RADIUS + 1e-3

FLAT = PathPlane()


def floor(p):
    return p[2]


def run(strategy, distance=floor, start=(0.0, 0.0, ABOVE), seconds=20.0, wanted=WANTED, **world):
    made = SpringWorld(distance, start, **world)
    return Explored(ExploreController(wanted, strategy, PERIOD), made, seconds)


def legs(*legs, distance=floor, plane=FLAT, **options):
    """The run of legs after a landing at the origin, and ends of the legs."""
    script = Script(plane, Hop((0.0, 0.0)), *legs)
    return run(script, distance, **options), script.how


def test_a_hop_lifts_rises_travels_level_and_lands():
    """A start 8 mm up: the way back is higher than the lift. A tip above its place lands at once."""
    script = Script(FLAT, Hop((0.0, 0.0)), Hop((0.012, 0.005)))
    e = run(script, start=(0.0, 0.0, RADIUS + 7.5e-3))
    landing = [Phase.APPROACH, Phase.SETTLE]
    assert e.phases[:6] == [*landing, Phase.LIFT, Phase.TRAVEL, *landing]
    assert script.how == [LegEnd.REACHED, LegEnd.REACHED]
    travel = e.at(Phase.TRAVEL)
    across = travel & (np.hypot(*e.velocity[:, :2].T) > 1e-6)
    assert e.position[across, 2] == pytest.approx(RADIUS + 7.5e-3, abs=2e-4)
    assert np.linalg.norm(e.velocity[travel], axis=1).max() <= WANTED.travel_speed * (1 + 1e-9)
    assert e.position[e.at(Phase.SETTLE)][-1, :2] == pytest.approx([0.012, 0.005], abs=3e-4)
    assert not e.touching[across].any()
    assert run(Script(FLAT, Hop((2e-4, 0.0)))).phases[:2] == landing


def test_where_nothing_is_met_the_next_hop_first_rises_to_where_the_run_began():
    """The floor ends at x = 10 mm."""
    script = Script(FLAT, Hop((0.0, 0.0)), Stroke(((2e-3, 0.0),)), Hop((0.02, 0.0)), Hop((0.0, 0.0)))
    e = run(script, lambda p: max(p[2], p[0] - 0.01))
    over = (e.position[:, 0] > 0.006) & (e.position[:, 0] < 0.019)
    assert script.how == [LegEnd.REACHED, LegEnd.REACHED, LegEnd.MISSED, LegEnd.REACHED]
    assert script.ends[2].tip == pytest.approx((0.02, 0.0, ABOVE - WANTED.approach_distance), abs=3e-4)
    assert e.position[over, 2].min() > ABOVE - 3e-4
    assert e.phases[-1] is Phase.DONE


WALL = [Hop((0.02, 0.0)), Hop((0.0, 0.0)), Stroke(((2e-3, 0.0),))]

OUTSIDE = [Stroke(((0.01, 0.0),)), Hop((0.01, 0.0)), Hop((0.0, 0.0))]

ROOM = replace(WANTED, room=Room((-0.01, -0.01, -0.01), (0.006, 0.01, 0.05)))

OBSTACLES = {
    # a wall from x = 8 mm on, 50 mm high
    "wall": (
        WALL,
        {"distance": lambda p: min(p[2], max(0.008 - p[0], p[2] - 0.05))},
        [LegEnd.BLOCKED, LegEnd.REACHED, LegEnd.REACHED],
        0.008 - RADIUS + 1e-3,
    ),
    "end of the room": (OUTSIDE, {"wanted": ROOM}, [LegEnd.BLOCKED, LegEnd.BLOCKED, LegEnd.REACHED], 0.006),
}


@pytest.mark.parametrize("name", OBSTACLES)
def test_a_leg_ends_at_an_obstacle_and_the_next_one_follows(name):
    """The tip gets less than so far along x [m]: past neither a wall higher than the start nor the room's end."""
    asked, options, ends, most = OBSTACLES[name]
    e, how = legs(*asked, **options)
    assert how == [LegEnd.REACHED, *ends]
    assert e.position[:, 0].max() < most
    assert e.phases[-1] is Phase.DONE


def test_a_stroke_over_an_edge_ends_as_steep_and_the_next_follows():
    """Over the edge by 70 degrees, and the way in which the tip comes to rest."""
    e, how = legs(Stroke(((0.02, 0.0),)), Hop((0.0, 0.0)), Stroke(((1e-3, 0.0),)), distance=table)
    beyond = e.position[e.at(Phase.SCAN), 0].max() - 0.006
    assert how == [LegEnd.REACHED, LegEnd.STEEP, LegEnd.REACHED, LegEnd.REACHED]
    assert RADIUS * math.sin(math.radians(70.0)) - 1e-4 < beyond < RADIUS
    assert e.phases[-1] is Phase.DONE


def test_a_landing_ends_at_the_bottom_of_the_room():
    deep = replace(WANTED, room=Room((-1.0, -1.0, 0.002)))
    low, how = legs(distance=lambda p: p[2] + 0.1, wanted=deep)
    assert how == [LegEnd.MISSED]
    assert low.position[:, 2].min() > 0.002


def test_strokes_follow_each_other_without_leaving_the_surface():
    """A first stroke without a hop lands where it begins."""
    script = Script(FLAT, Stroke(((5e-3, 0.0),)), Stroke(((5e-3, 5e-3), (0.0, 5e-3))))
    e = run(script)
    assert e.phases == [Phase.APPROACH, Phase.SETTLE, Phase.SCAN, Phase.LIFT, Phase.DONE]
    assert script.ends[0].tip[:2] == pytest.approx((5e-3, 0.0), abs=2e-4)
    assert script.ends[1].tip[:2] == pytest.approx((0.0, 5e-3), abs=2e-4)
    # contacts of every period, but for those in which a leg has ended and the tip comes to rest
    resting = math.ceil(MIN_CORNER_SPEED / (WANTED.acceleration * PERIOD)) + 1
    assert 0 <= e.at(Phase.SCAN).sum() - len(script.felt) <= 2 * resting


def test_a_stroke_steers_back_to_its_line_if_the_landing_was_beside_it():
    """0.4 mm beside: the error dies out along the way, and is not spread over all of it."""
    e, _ = legs(Stroke(((0.02, 0.0),)), start=(0.0, 4e-4, ABOVE))
    assert e.phases[:3] == [Phase.APPROACH, Phase.SETTLE, Phase.SCAN]
    half = e.at(Phase.SCAN) & (e.position[:, 0] > 0.01)
    assert np.abs(e.position[half, 1]).max() < 4e-5


def test_a_tip_that_is_held_is_blocked():
    """A slow stroke to and fro, a tenth of a millimetre at 1 mm/s, comes back all the time and is not blocked."""

    def held(position, move):
        return np.array([0.0, move[1], move[2]]) if position[0] > 5e-3 else move

    e, how = legs(Stroke(((0.02, 0.0),)), hold=held)
    stalled = e.at(Phase.SCAN) & (e.position[:, 0] > 5e-3)
    assert how == [LegEnd.REACHED, LegEnd.BLOCKED]
    assert 0.5 <= stalled.sum() * PERIOD <= 1.1
    assert e.phases[-2:] == [Phase.LIFT, Phase.DONE]
    slow = Stroke(((4e-4, 0.0), (0.0, 4e-4)) * 6)
    assert legs(slow, wanted=replace(WANTED, speed=0.001))[1] == [LegEnd.REACHED, LegEnd.REACHED]


@pytest.mark.parametrize("back", [True, False])
def test_each_leg_may_seek_once(back):
    """The floor drops by 1 mm for ever, twice in the same leg or once in each of two."""
    strokes = [Stroke(((5e-3, 0.0),)), Stroke(((0.01, 0.0),))] if back else [Stroke(((0.01, 0.0),))]
    e, how = legs(*strokes, distance=lambda p: p[2] + 1e-3 * sum(p[0] > x for x in (3e-3, 6e-3)))
    assert how == [LegEnd.REACHED, *([LegEnd.REACHED] * 2 if back else [LegEnd.LOST])]
    assert e.phases.count(Phase.SEEK) == (2 if back else 1)
    assert e.phases[-1] is (Phase.DONE if back else Phase.LOST)


# touches


def test_a_touch_rests_on_the_surface_and_returns_the_way_it_came():
    script = Script(FLAT, SingleTouch((0.0, 0.0), 2e-3), SingleTouch((5e-3, 0.0), 2e-3))
    e = run(script, start=(0.0, 0.0, RADIUS + 6e-3))
    one, height = [Phase.APPROACH, Phase.SETTLE, Phase.SCAN, Phase.LIFT], script.ends[0].tip[2]
    assert e.phases == [*one, Phase.TRAVEL, *one, Phase.DONE]
    assert script.how == [LegEnd.REACHED, LegEnd.REACHED]
    assert len(script.felt) * PERIOD == pytest.approx(0.2, abs=0.02)
    assert np.abs(e.velocity[e.at(Phase.SCAN), :2]).max() < 1e-9
    assert script.ends[0].tip == pytest.approx((0.0, 0.0, RADIUS + 2e-3), abs=3e-4)
    assert np.abs(e.position[e.at(Phase.TRAVEL), 2] - height).max() < 3e-4


def test_a_touch_in_flight_to_the_next_is_got_over():
    """A block 3 mm high from x = 6 mm on; the way to the next touch is 1 mm above the floor."""

    def step_up(p):
        block = np.array([6e-3 - p[0], p[2] - 3e-3])
        return min(p[2], math.hypot(*np.maximum(block, 0.0)) + min(max(block), 0.0))

    script = Script(FLAT, SingleTouch((0.0, 0.0), 1e-3), SingleTouch((0.015, 0.0), 1e-3))
    e = run(script, step_up, start=(0.0, 0.0, RADIUS + 7e-3), wanted=replace(WANTED, lift_distance=2e-3))
    assert script.how == [LegEnd.REACHED, LegEnd.REACHED]
    assert script.ends[1].tip[2] == pytest.approx(RADIUS + 4e-3, abs=3e-4)
    assert e.force.max() < 20.0  # at 40 mm/s into 20 kN/m, with no delay of the robot
    assert e.phases[-1] is Phase.DONE


def test_taps_beside_the_object_are_marked_and_the_others_felt():
    taps = Taps(((0.02, 0.0), (0.0, 0.0), (0.003, 0.0), (-0.02, 0.0), (0.021, 0.0)), 2e-3)
    e = run(
        taps, lambda p: table((math.hypot(p[0], p[1]) + 1e-3, 0.0, p[2])), start=(0.02, 0.0, ABOVE), seconds=40.0
    )
    assert [round(1e3 * mark.position[0]) for mark in taps.marks] == [20, -20, 21]
    assert e.phases.count(Phase.SCAN) == 2
    assert e.phases[-1] is Phase.DONE
    assert e.position[-1, 2] > ABOVE - 6e-4  # not left beside the object


# circuits


def sphere(p):
    return np.linalg.norm(p) - 0.01


LEVEL = PathPlane((0.0, 0.0, 0.005))


def test_a_circuit_closes_where_the_strategy_says_so():
    contour = Contour((0.008, 0.0), LevelSteering(LEVEL), LEVEL, 0.2)
    e = run(contour, sphere, start=(0.008, 0.0, 0.014))
    heights = e.position[e.at(Phase.SCAN), 2]
    assert contour.closed
    assert contour.gone == pytest.approx(2 * math.pi * math.sqrt(0.014**2 - 0.005**2), abs=2.5e-3)
    assert e.phases == [Phase.APPROACH, Phase.SETTLE, Phase.SCAN, Phase.LIFT, Phase.DONE]
    assert np.abs(heights[len(heights) // 2 :] - 0.005).max() < 5e-5


@pytest.mark.parametrize(
    ("longest", "until", "how"),
    [(0.01, lambda felt: False, LegEnd.OVERLONG), (0.5, lambda felt: felt.tip[1] > 5e-3, LegEnd.REACHED)],
)
def test_a_circuit_ends_and_rests_before_the_next_leg(longest, until, how):
    script = Script(LEVEL, Hop((0.008, 0.0)), Circuit(LevelSteering(LEVEL), longest), until=until)
    e = run(script, sphere, start=(0.008, 0.0, 0.014))
    assert script.how == [LegEnd.REACHED, how]
    # along the surface it slows down no faster than the acceleration
    speed = np.linalg.norm(e.velocity[e.at(Phase.SCAN)], axis=1)
    assert np.abs(np.diff(speed)).max() <= 1.2 * WANTED.acceleration * PERIOD
    assert speed[-1] < 1e-3


# all of them


TOUR = (
    Hop((0.008, 0.0)),
    Circuit(LevelSteering(LEVEL), 0.01),
    SingleTouch((2e-3, 0.0), 2e-3),
    Stroke(((0.0, 2e-3),)),
)


def tour(frame):
    rows = tuple(map(tuple, frame.tolist()))
    turned = PathPlane(tuple((frame @ LEVEL.origin).tolist()), rows)
    hop, circuit, *others = TOUR
    script = Script(turned, hop, Circuit(replace(circuit.steering, plane=turned), circuit.longest), *others)
    return script, run(script, sphere, start=(0.008, 0.0, 0.0145), frame=rows)


@pytest.mark.slow
@settings(max_examples=2, deadline=None, derandomize=True)
@given(st.tuples(*[st.floats(-1.0, 1.0)] * 4).filter(lambda q: math.hypot(*q) > 0.1))
def test_world_and_plane_turned_together_nothing_changes(quaternion):
    """Nothing but the plane's axis is up."""
    straight, e = tour(np.array(IDENTITY))
    turned, f = tour(Rotation.from_quat(quaternion).as_matrix())
    assert straight.how == turned.how == [LegEnd.REACHED, LegEnd.OVERLONG, LegEnd.REACHED, LegEnd.REACHED]
    assert e.phases == f.phases
    # rounding may move the end of a phase by a period
    assert abs(len(e.names) - len(f.names)) <= 5
    assert e.position[-1] == pytest.approx(f.position[-1], abs=1e-5)


@pytest.mark.parametrize("slew", [2.0, 10.0])
def test_a_tour_of_all_legs_is_the_same_twice(slew):
    """With a slew limit that no leg's begin or end exceeds, as in every run."""
    script = Script(LEVEL, *TOUR, Hop((0.03, 0.0)), Hop((0.0, 0.0)), Stroke(((0.03, 0.0),)))
    wanted = replace(WANTED, slew=slew, landing_speed=0.01, approach_distance=0.015)
    controller = ExploreController(wanted, script, PERIOD)
    e, again = (Explored(controller, SpringWorld(sphere, (0.008, 0.0, 0.0145))) for _ in range(2))
    assert script.how[4:] == [LegEnd.MISSED, LegEnd.REACHED, LegEnd.STEEP]
    assert e.phases[-1] is Phase.DONE
    assert e.commands == again.commands
    assert controller.leg is None


LAST_LEGS = {
    LegEnd.REACHED: (floor, (0.0, 0.0, ABOVE), Script(FLAT, Hop((0.0, 0.0))), Phase.LOST),
    LegEnd.MISSED: (lambda p: p[2] + 0.1, (0.0, 0.0, ABOVE), Script(FLAT, Hop((0.0, 0.0))), Phase.LOST),
    LegEnd.STEEP: (
        sphere,
        (0.0139, 0.0, 0.0145),
        Script(FLAT, Hop((0.0139, 0.0)), Stroke(((0.03, 0.0),))),
        Phase.LOST,
    ),
    LegEnd.OVERLONG: (
        sphere,
        (5e-3, 0.0, 0.0145),
        Script(LEVEL, Circuit(LevelSteering(LEVEL), 5e-3)),
        Phase.DONE,
    ),
    LegEnd.BLOCKED: (floor, (0.0, 0.0, ABOVE), Script(FLAT, Circuit(LevelSteering(FLAT), 5e-3)), Phase.DONE),
    LegEnd.LOST: (
        lambda p: p[2] + 0.1 * (p[0] > 2e-3),
        (0.0, 0.0, ABOVE),
        Script(FLAT, Stroke(((5e-3, 0.0),))),
        Phase.LOST,
    ),
}


@pytest.mark.parametrize("how", LAST_LEGS)
def test_the_run_is_lost_if_it_ends_with_a_loss_or_nothing_was_swept(how):
    """Whatever end a strategy's last leg has."""
    solid, start, script, outcome = LAST_LEGS[how]
    e = run(script, solid, start=start, wanted=replace(WANTED, approach_distance=0.015))
    assert script.how[-1] is how
    assert e.phases[-1] is outcome


def test_a_path_over_nothing_is_given_up_after_one_approach():
    follow = Follow(Waypoints(((0.0, 0.0), (0.02, 0.0), (0.02, 0.02))))
    assert run(follow, lambda p: p[2] + 0.1).phases == [Phase.APPROACH, Phase.LOST]


def table(p):
    """A floor that ends at x = 6 mm with an edge and a wall."""
    out = np.array([p[0] - 6e-3, p[2]])
    return math.hypot(*np.maximum(out, 0.0)) + min(max(out), 0.0)
