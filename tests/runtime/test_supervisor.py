"""Limits that no controller can pass."""

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.errors import LatchedError
from palpate.runtime.data import Command, HandSample, Phase
from palpate.runtime.loop import run
from palpate.runtime.result import Ending
from palpate.runtime.supervision import (
    CONTACT_FORCE,
    AtMost,
    Guard,
    Hold,
    Limits,
    Stop,
    Supervisor,
)
from palpate.sensing.ft.health import HealthCheck, SampleHealth
from runtime.puppets import PERIOD, PUSH, REST, PuppetBackend, PuppetController, sample, touch

any_float = st.floats(allow_nan=True, allow_infinity=True)
GOOD = Command((0.01, 0.0, 0.0), Phase.SCAN)
STOP = Command(REST, Phase.STOP)


def observation(fingers=1, joints=None, hand=None, rate=None, arm_age=0.0, finger_age=0.0, **changes):
    """What touch makes of a sample; `joints` of the arm, of a `hand`, `rate` of turning, ages of the devices."""
    now = touch(fingers).sense(sample(**changes))
    arm = replace(now.arm, time=now.time - arm_age)
    arm = arm if joints is None else replace(arm, joint_position=joints)
    arm = arm if rate is None else replace(arm, angular_velocity_base_tip=rate)
    felt = tuple(replace(finger, time=now.time - finger_age) for finger in now.fingers)
    return replace(now, arm=arm, fingers=felt, hand=None if hand is None else HandSample(now.time, hand))


def started(limits=None, guards=()):
    supervisor = Supervisor(limits, guards)
    supervisor.start(PERIOD)
    return supervisor


def step(supervisor, now, command=GOOD):
    """One period as the loop does it."""
    return supervisor.check(now, command) if supervisor.admits(now) else supervisor.react(now)


@settings(max_examples=300, deadline=None, derandomize=True)
@given(st.tuples(any_float, any_float, any_float), st.booleans())
def test_whatever_is_commanded_what_passes_is_finite_and_within_the_limits(given_, turns):
    """Sliding and turning, each within its speed [m/s, rad/s] and acceleration, from rest."""
    supervisor = started()
    passed = step(supervisor, observation(), turning(given_) if turns else Command(given_, Phase.SCAN))
    rate = passed.angular_velocity_base_tip if turns else passed.velocity_base_tip
    speed, acceleration = (2.5, 250.0) if turns else (0.25, 25.0)
    assert math.hypot(*rate) <= min(speed, acceleration * PERIOD) * (1 + 1e-8)
    # sliding faster than this is allowed only away from what is touched
    slow = min(acceleration * PERIOD, math.inf if turns else Limits().commanded_speed)
    if all(map(math.isfinite, given_)) and math.hypot(*given_) <= slow * (1 - 1e-12):
        assert rate == given_
    assert (supervisor.trip is None) == (rate == given_)


@settings(max_examples=120, deadline=None, derandomize=True)
@given(st.tuples(*[any_float] * 6), st.tuples(*[any_float] * 3), st.tuples(*[any_float] * 3))
def test_whatever_is_sensed_the_controller_goes_on_only_within_the_limits(wrench, position, velocity):
    supervisor = started()
    now = observation(wrench=wrench, position=position, velocity=velocity)
    admitted = supervisor.admits(now)
    within = (
        all(map(math.isfinite, (*wrench, *position, *velocity)))
        and math.hypot(*wrench[:3]) <= 20.0
        and math.hypot(*wrench[3:]) <= 2.0
        and math.hypot(*velocity) <= 1.1 * 0.25
        and all(-1.0 <= x <= 1.0 for x in position)
    )
    if not within:
        assert not admitted
        assert supervisor.trip is not None
        assert math.hypot(*supervisor.react(now).velocity_base_tip) <= 0.02 * (1 + 1e-12)
    elif max(map(abs, (*wrench, *velocity))) < 1e300 and abs(wrench[5]) < 1e-3:
        assert admitted or supervisor.trip.measure == "spin torque"


def test_it_latches_and_keeps_the_first_reason_over_runs_until_reset():
    supervisor = started()
    step(supervisor, observation(time=0.5, wrench=(0.0, 0.0, 25.0, 0.0, 0.0, 0.0)))
    first = supervisor.trip
    assert str(first) == "contact force was 25 N at t = 0.500 s; the limit is 20 N"
    for i in range(3):
        assert step(supervisor, observation(time=1.0 + i)) == STOP
    step(supervisor, observation(position=(9.0, 0.0, 0.0), time=9.0))
    assert supervisor.trip == first
    with pytest.raises(LatchedError, match="contact force was 25 N"):
        supervisor.start(PERIOD)
    supervisor.reset()
    supervisor.start(PERIOD)
    assert step(supervisor, observation()) is GOOD


def test_a_device_slower_than_the_loop_repeats_itself_unpunished_until_it_is_too_old():
    """125 Hz read at 1 kHz: eight periods with the same stamp; a sensor that froze trips after the limit."""
    supervisor = started()
    for i in range(100):
        last = 8 * (i // 8) * PERIOD
        now = observation(time=i * PERIOD)
        assert supervisor.admits(replace(now, arm=replace(now.arm, time=last)))
    for i in range(100, 200):
        now = observation(time=i * PERIOD)
        admitted = supervisor.admits(replace(now, arm=replace(now.arm, time=96 * PERIOD)))
        assert admitted == (i - 96 <= 20)
        if not admitted:
            break
    assert i == 117


class Shapeless:
    def __repr__(self):
        raise RuntimeError("not even that")


def turning(rate, velocity=REST, grip=None):
    return Command(velocity, Phase.SCAN, grip, rate)


def along(axis, *speeds):
    """Periods in which the tip turns about an axis [rad/s]."""
    return [
        (observation(time=(i + 1) * PERIOD), turning(tuple(s * a for a in axis))) for i, s in enumerate(speeds)
    ]


def sensed(*observations):
    return [(now, Command()) for now in observations]


NAN, INF = math.nan, math.inf
SLOW = Limits(angular_speed=0.5, angular_acceleration=100.0)
JOINTS = Limits(joint_lower=(-1.0, -2.0), joint_upper=(1.0, 2.0))
TURNED = ((1.0, 0.0, 0.0), (0.0, 0.0, -1.0), (0.0, 1.0, 0.0))
PASSES = "None"
SQUEEZE = (0.0, 0.0, 6.0, 0.0, 0.0, 0.0)
RAMP = [(observation(time=i * PERIOD), Command((0.02 * i, 0.0, 0.0), Phase.SCAN)) for i in range(1, 11)]
"""0.02 m/s in a millisecond is 20 m/s^2."""
TRIPS = {
    "good": (None, [(observation(), GOOD)], PASSES),
    "force": (
        Limits(force=5.0),
        sensed(observation(wrench=(0.0, 0.0, 5.1, 0.0, 0.0, 0.0))),
        "contact force was 5.1 N at t = 0.000 s; the limit is 5 N",
    ),
    "force within": (Limits(force=5.0), sensed(observation(wrench=(0.0, 0.0, 4.99, 0.0, 0.0, 0.0))), PASSES),
    "force of the second finger": (
        None,
        sensed(observation(2, wrenches=(PUSH, (0.0, 15.0, 15.0, 0.0, 0.0, 0.0)))),
        "contact force was",
    ),
    "moment": (
        Limits(moment=0.5),
        sensed(observation(wrench=(0.0, 0.0, 0.0, 0.6, 0.0, 0.0))),
        "contact moment was 0.6",
    ),
    "moment in N mm": (
        None,
        sensed(observation(wrench=(0.0, 0.0, 2.0, 16.0, 0.0, 0.0))),
        "2 N m; 8 m is no arm of 2 N on a finger: does the sensor give N m?",
    ),
    "spin": (
        Limits(spin_torque=0.01),
        sensed(observation(wrench=(0.0, 0.0, 2.0, 0.0, 0.0, 0.02))),
        "spin torque was 0.02 N m",
    ),
    "spin within": (
        Limits(spin_torque=0.01),
        sensed(observation(wrench=(0.0, 0.0, 2.0, 0.0, 0.0, 0.0099))),
        PASSES,
    ),
    "speed": (
        Limits(speed=0.01),
        sensed(observation(velocity=(0.0, 0.012, 0.0))),
        "measured speed of the tip was 0.012",
    ),
    "speed within": (Limits(speed=0.01), sensed(observation(velocity=(0.0, 0.0109, 0.0))), PASSES),
    "workspace": (None, sensed(observation(position=(0.0, 0.0, -1.1))), "tip position"),
    "joints within": (JOINTS, sensed(observation(joints=(0.5, 0.0))), PASSES),
    "joint above": (JOINTS, sensed(observation(joints=(1.1, 0.0))), "joint 1"),
    "joint below": (JOINTS, sensed(observation(joints=(0.0, -2.1))), "joint 2"),
    "joint is NaN": (JOINTS, sensed(observation(joints=(0.0, NAN))), "joint"),
    "joints missing": (JOINTS, sensed(observation(joints=())), "number"),
    "arm presses, no hand": (Limits(grip_force=5.0), sensed(observation(wrench=SQUEEZE)), PASSES),
    "hand crushes": (Limits(grip_force=5.0), sensed(observation(wrench=SQUEEZE, hand=(0.1,))), "grip force was"),
    "hand is told to crush": (
        Limits(grip_force=5.0),
        [(observation(), Command(REST, Phase.HOLD, (5.1,)))],
        "commanded grip force was",
    ),
    **{
        f"{device}'s sample is {age} s old": (
            None,
            sensed(observation(time=0.1, **{f"{device}_age": age})),
            f"age of the sample of the {name}" if device == "arm" else name,
        )
        for device, name in (("arm", "arm"), ("finger", "sensor 1"))
        for age in (0.021, 5.0, -0.001, NAN, INF, -INF)
    },
    **{
        f"time goes on by {-back} s": (
            None,
            sensed(observation(time=10.0), observation(time=10.0 - back)),
            "time of the sample was",
        )
        for back in (0.0, 1e-3, 5.0)
    },
    **{
        f"periods apart, samples of {age} s": (
            Limits(sample_age=age),
            sensed(*(observation(time=1.0 + k * max(0.1, age)) for k in (0, 1, 2.001 + 0.001 / max(0.1, age)))),
            f"the limit is {max(0.1, age):g} s",
        )
        for age in (0.02, 0.1, 0.3)
    },
    "time stamp goes back": (
        None,
        sensed(observation(time=0.1, finger_age=0.001), observation(time=0.101, finger_age=0.003)),
        "time stamp of force/torque sensor 1",
    ),
    "proper rotation": (None, sensed(observation(rotation=TURNED)), PASSES),
    **{
        f"improper rotation {i}": (None, sensed(observation(rotation=rotation)), "rotation of the tip")
        for i, rotation in enumerate(
            (
                ((3.0, 0.0, 0.0), (0.0, 3.0, 0.0), (0.0, 0.0, 3.0)),
                ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, -1.0)),
                ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)),
                ((1.0, 1e-3, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)),
            )
        )
    },
    **{
        f"joint of the hand at {q:g}": (
            None,
            sensed(observation(hand=(0.01, q))),
            f"position of joint 2 of the hand was {q:g} at",
        )
        for q in (-51471.0, 1001.0, NAN)
    },
    "ramp of the velocity": (Limits(contact_speed=0.25), RAMP, PASSES),
    "jump of the velocity": (
        Limits(contact_speed=0.25),
        [*RAMP, (observation(time=0.02), Command((0.17, 0.0, 0.0), Phase.SCAN))],
        "commanded acceleration was 30 m/s^2",
    ),
    "robot turns, servos overshoot": (None, sensed(observation(rate=(0.0, 0.0, 2.74))), PASSES),
    "robot turns too fast": (None, sensed(observation(rate=(0.0, 0.0, 2.76))), "the limit is 2.75 rad/s"),
    "robot turns too fast, aslant": (
        None,
        sensed(observation(rate=(2.0, 2.0, 0.0))),
        "measured angular speed of the tip",
    ),
    **{
        f"robot turns by {bad}": (None, sensed(observation(rate=(0.0, bad, 0.0))), "arm state")
        for bad in (NAN, INF, -INF)
    },
    "turn as fast as allowed": (SLOW, along((0.0, -0.6, 0.8), 0.1, 0.2, 0.3, 0.4, 0.499), PASSES),
    "turn too fast": (
        SLOW,
        along((1.0, 0.0, 0.0), 0.1, 0.2, 0.3, 0.4, 0.5, 0.51),
        "commanded angular speed was 0.51 rad/s at t = 0.006 s; the limit is 0.5 rad/s",
    ),
    "jump of the turn": (SLOW, along((0.0, 0.0, 1.0), 0.1, 0.2, 0.3, 0.401), "the limit is 100 rad/s^2"),
    "stop of the turn": (SLOW, along((0.0, 0.0, 1.0), 0.1, 0.2, 0.3, 0.0), "commanded angular acceleration"),
    "turn remembered with and without a grip": (
        SLOW,
        [
            (observation(), turning((0.05, 0.0, 0.0), (0.02, 0.0, 0.0), (3.0,))),
            (observation(time=PERIOD), turning((0.1, 0.0, 0.0), (0.02, 0.0, 0.0))),
            (observation(time=2 * PERIOD), turning((0.0, 0.15, 0.0))),
        ],
        "commanded angular acceleration",
    ),
}
"""Limits, periods as (observation, command), and what the last of them trips; those before it pass unchanged."""


@pytest.mark.parametrize(("limits", "periods", "text"), TRIPS.values(), ids=TRIPS)
def test_a_guard_trips_beyond_its_bound_and_not_below_it(limits, periods, text):
    supervisor = started(limits)
    passed = [step(supervisor, now, command) is command for now, command in periods]
    assert text in str(supervisor.trip)
    assert passed == [True] * (len(periods) - 1) + [text == PASSES]


NO_COMMANDS = [
    None,
    (0.0, 0.0, 0.0),
    Shapeless(),
    Command((0.0, 0.0)),
    Command((0.0, 0.0, 0.0, 0.0)),
    Command(None),
    Command(("a", "b", "c")),
    Command((0.0, NAN, 0.0)),
    Command((INF, -INF, 0.0)),
    Command((1e308, 1e308, 1e308)),
    Command((Shapeless(),) * 3),
    Command(REST, "fast"),
    Command(REST, Phase.HOLD, 3.0),
    Command(REST, Phase.HOLD, ()),
    Command(REST, Phase.HOLD, (-1.0,)),
    Command(REST, Phase.HOLD, (NAN, 1.0)),
    Command(REST, Phase.HOLD, ("tight",)),
]
NO_TURNS = [
    None,
    0.0,
    (),
    (0.0, 0.0),
    (0.0, 0.0, 0.0, 0.0),
    ("a", "b", "c"),
    (0.0, NAN, 0.0),
    (INF, -INF, 0.0),
    (1e308, 1e308, 1e308),
    (None, 0.0, 0.0),
    ((0.0,), (0.0,), (0.0,)),
    {},
]


@pytest.mark.parametrize("command", [*NO_COMMANDS, *map(turning, NO_TURNS)])
def test_malformed_commands_never_reach_the_robot(command):
    supervisor = started()
    assert step(supervisor, observation(), command) == STOP
    assert "commanded angular velocity" in str(supervisor.trip) or command in NO_COMMANDS
    assert supervisor.finished


def test_a_guard_of_ones_own_waits_for_its_duration_and_forgets_interruptions():
    """A guarded motion: go on until more than 1 N is felt for 5 ms."""
    guard = Guard(AtMost(CONTACT_FORCE, 1.0), duration=0.005, reaction=(Hold(0.01), Stop()))
    supervisor = started(guards=(guard,))
    forces = [2.0] * 4 + [0.5] + [2.0] * 35
    periods = [observation(time=i * PERIOD, wrench=(0.0, 0.0, f, 0.0, 0.0, 0.0)) for i, f in enumerate(forces)]
    assert [supervisor.admits(now) for now in periods[:11]] == [True] * 10 + [False]
    for i, now in enumerate(periods[11:], 11):
        assert (supervisor.react(now), supervisor.finished) == ((STOP, True) if i >= 21 else (Command(), False))


@settings(max_examples=100, deadline=None, derandomize=True)
@given(st.floats(0.0, math.pi), st.floats(-math.pi, math.pi), st.floats(0.0, 0.9))
def test_the_way_out_is_along_the_contact_normal_out_of_the_object(tilt, turn, friction):
    """On a sphere about the origin, whatever tangential force comes with it."""
    n = (math.sin(tilt) * math.cos(turn), math.sin(tilt) * math.sin(turn), math.cos(tilt))
    t = (math.cos(tilt) * math.cos(turn), math.cos(tilt) * math.sin(turn), -math.sin(tilt))
    f = tuple(-30.0 * a + 30.0 * friction * b for a, b in zip(n, t, strict=True))
    c = tuple(0.01 * a for a in n)
    m = (c[1] * f[2] - c[2] * f[1], c[2] * f[0] - c[0] * f[2], c[0] * f[1] - c[1] * f[0])
    supervisor = started()
    now = observation(wrench=(*f, *m))
    assert not supervisor.admits(now)
    away = supervisor.react(now).velocity_base_tip
    assert away == pytest.approx([-0.02 * a for a in n], abs=1e-12)
    assert not supervisor.finished


HARD = (0.0, 0.0, 30.0, 0.0, 0.0, 0.0)
FREE = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


def retracting(limits=None):
    supervisor = started(limits)
    assert step(supervisor, observation(wrench=HARD)).velocity_base_tip == (0.0, 0.0, 0.02)
    return supervisor


@pytest.mark.parametrize(
    ("goes_on", "changes"),
    [
        (True, {}),
        (True, {"wrench": (0.0, 0.0, 2.1, 0.0, 0.0, 0.0)}),
        (True, {"wrench": (0.0, 0.0, 50.0, 2.5, 0.0, 0.0)}),  # over the limit on moments, too
        (True, {"position": (0.0, 0.0, 0.05)}),
        (False, {"position": (0.0, 0.0, 0.11)}),
        (False, {"time": 10.1}),
        (False, {"time": 0.0}),  # time stands still
        (False, {"position": (0.0, 0.0, NAN)}),
        (False, {"wrench": (0.0, 0.0, NAN, 0.0, 0.0, 0.0)}),
        (False, {"velocity": (0.0, 0.0, 0.3)}),
    ],
)
def test_retracting_is_broken_off_by_anything_new_but_not_by_a_contact_that_presses_harder(goes_on, changes):
    supervisor = retracting()
    moving = supervisor.react(observation(**({"time": PERIOD, "wrench": HARD} | changes))) != STOP
    assert (moving, supervisor.finished) == (goes_on, not goes_on)


def play(supervisor, wrench_of, periods):
    """The heights of a tip that moves as commanded, and the commands."""
    height, heights, commands = 0.0, [], []
    for i in range(1, periods):
        now = observation(time=i * PERIOD, wrench=wrench_of(i * PERIOD, height), position=(0.0, 0.0, height))
        commands.append(supervisor.react(now))
        height += PERIOD * commands[-1].velocity_base_tip[2]
        heights.append(height)
        if supervisor.finished:
            break
    return heights, commands


def test_a_tip_that_is_pressed_no_more_gets_clear_and_watches_before_the_run_ends():
    supervisor = retracting()
    heights, commands = play(supervisor, lambda t, z: HARD if z < 0.001 else FREE, 5000)
    assert heights[-1] == pytest.approx(0.001 + 0.005, abs=1e-4)  # 5 mm from where it was pressed last
    watching = sum(command == Command(REST, Phase.HOLD) for command in commands)
    assert watching == pytest.approx(1.0 / PERIOD, abs=2)
    assert commands[-1] == STOP
    assert supervisor.trip.aftermath.startswith("backed off 6.0 mm within 1.3")
    assert "felt at most 30 N and 0 N at the end" in supervisor.trip.aftermath


@pytest.mark.slow
@settings(max_examples=4, deadline=None, derandomize=True)
@given(st.floats(0.03, 0.09), st.floats(1e3, 1e5))
def test_a_surface_that_keeps_coming_never_presses_harder_than_when_it_tripped_but_for_the_first_moments(u, K):
    """The tip follows commands at once: only what the surface does before force shows it is beyond control."""
    supervisor, forces = retracting(), []

    def pressed(t, z):
        forces.append(max(0.0, 30.0 + K * (u * t - z)))
        return (0.0, 0.0, forces[-1], 0.0, 0.0, 0.0)

    heights, commands = play(supervisor, pressed, 20000)
    # until PURSUIT_RATIO of it, and while it gains speed at 25 m/s^2
    assert max(forces) <= 1.1 * 30.0 + K * u * 2.0 * PERIOD + K * u * u / (2.0 * 25.0) + 1e-9
    assert heights[-1] <= 0.1 + 0.1 * 2.0 * PERIOD
    assert supervisor.finished
    assert "ended after 10" in supervisor.trip.aftermath  # 100 mm or 10 s
    assert {command.phase for command in commands[:-1]} == {Phase.HOLD}


def test_a_reaction_gains_speed_no_faster_than_commands_may():
    supervisor = retracting(Limits(acceleration=20.0))
    _, commands = play(supervisor, lambda t, z: (0.0, 0.0, 30.0 + 1000.0 * t, 0.0, 0.0, 0.0), 400)
    speeds = [0.0, *(command.velocity_base_tip[2] for command in commands)]
    assert max(b - a for a, b in pairwise(speeds)) <= 20.0 * PERIOD * (1 + 1e-9)
    assert max(speeds) == pytest.approx(0.1)


@pytest.mark.parametrize(
    ("measure", "moves"),
    [(HealthCheck.SATURATED, True), (HealthCheck.OVERLOAD_AXIS, True), (HealthCheck.FROZEN, False)],
)
def test_a_saturated_sensor_is_drawn_out_of_it_a_frozen_one_stands_still(measure, moves):
    now = observation(wrench=(0.0, 0.0, 15.0, 0.0, 0.0, 0.0))
    now = replace(now, fingers=(replace(now.fingers[0], health=SampleHealth(measure, "Fz", 1.0, 0.5)),))
    supervisor = started()
    assert (step(supervisor, now) != STOP) is moves
    assert measure.value in str(supervisor.trip)


def test_a_hand_that_holds_something_does_not_retract():
    supervisor = started()
    grip = Command(REST, Phase.HOLD, (3.0, 3.0))
    assert step(supervisor, observation(2, wrenches=(PUSH, PUSH)), grip) is grip
    hard = observation(2, time=PERIOD, wrenches=(PUSH, (0.0, 0.0, 30.0, 0.0, 0.0, 0.0)))
    assert (step(supervisor, hard), supervisor.finished) == (Command(REST, Phase.STOP, (3.0, 3.0)), True)


@pytest.mark.parametrize("hidden", [0.0, 0.007, 0.05])
def test_motion_that_the_arm_does_not_report_is_found_and_noise_is_not(hidden):
    """`hidden` [m/s] beside what it reports; found when a first-order filter of 0.5 s reaches 3 mm."""
    supervisor, wave = started(), 0.2
    for k in range(2000):
        t = k * PERIOD
        x = wave / 10.0 * math.sin(10.0 * t) + hidden * t + 2e-5 * math.sin(1e4 * k)
        supervisor.admits(
            observation(time=t, position=(x, 0.0, 0.0), velocity=(wave * math.cos(10.0 * t), 0.0, 0.0))
        )
        if supervisor.trip is not None:
            assert "reported velocity does not explain" in str(supervisor.trip)
            assert t == pytest.approx(-0.5 * math.log(1.0 - 3e-3 / (0.5 * hidden)), rel=0.05)
            return
    assert hidden == 0.0


def test_states_that_are_dated_too_early_are_no_unexplained_motion():
    """Up to 20 ms, as jitter leaves of what round trips prove: at 0.2 m/s the tip goes 4 mm meanwhile."""
    supervisor = started()
    for k in range(2000):
        t = k * PERIOD
        now = observation(time=t, position=(0.2 * t, 0.0, 0.0), velocity=(0.2, 0.0, 0.0))
        age = min(0.0199, max(0.0, 0.5 * (t - 1.0)))
        assert supervisor.admits(replace(now, arm=replace(now.arm, time=t - age)))


AWAY = (0.0, 0.0, 0.025)


@pytest.mark.parametrize(
    ("velocity", "wrench", "passes"),
    [(AWAY, PUSH, True), ((0.025, 0.0, 0.0), PUSH, False), ((0.0, 0.0, -0.025), PUSH, False), (AWAY, FREE, False)],
    ids=["away", "aside", "into", "away from nothing"],
)
def test_backing_off_from_what_is_touched_may_be_fast_and_nothing_else(velocity, wrench, passes):
    supervisor = started()
    step(supervisor, observation(wrench=wrench), Command(velocity, Phase.SCAN))
    assert ("commanded speed where something may be touched" in str(supervisor.trip)) is not passes
    assert (supervisor.trip is None) is passes


def test_backing_off_fast_ends_a_tenth_of_a_second_after_the_touch():
    supervisor = started()
    for k in range(200):
        step(supervisor, observation(time=k * PERIOD, wrench=FREE if k else PUSH), Command(AWAY, Phase.SCAN))
    assert supervisor.trip.time == pytest.approx(0.1, abs=2 * PERIOD)


@pytest.mark.parametrize(("turn", "backs_off"), [(0.0, True), (80.0, True), (100.0, False), (180.0, False)])
def test_a_reading_that_comes_from_another_side_than_the_contact_moves_nothing_inwards(turn, backs_off):
    """A spike of a sensor: before, the tip followed it into the object, with 100 N at a limit of 20."""
    supervisor = started()
    for k in range(100):
        assert supervisor.admits(observation(time=k * PERIOD, wrench=PUSH))
        supervisor.check(observation(time=k * PERIOD, wrench=PUSH), Command())
    angle = math.radians(turn)
    spike = observation(time=0.1, wrench=(30.0 * math.sin(angle), 0.0, 30.0 * math.cos(angle), 0.0, 0.0, 0.0))
    assert not supervisor.admits(spike)
    moved = [supervisor.react(spike).velocity_base_tip != REST for _ in range(5)]
    assert any(moved) is backs_off


def test_an_array_that_its_owner_fills_again_is_passed_as_it_was():
    supervisor, own = started(), np.array([0.01, 0.02, 0.03])
    passed = step(supervisor, observation(), turning(own))
    own[:] = -0.2  # within all limits by itself, but a jump of 0.3 rad/s
    assert passed.angular_velocity_base_tip == (0.01, 0.02, 0.03)
    assert step(supervisor, observation(time=PERIOD), turning(own)) == STOP


class Fling:
    """A reaction that is faster than it may be. A `Reaction`."""

    def step(self, now, since, grip):
        return turning((0.0, 2.0, 0.0), (0.01, 0.0, 0.0), grip)


def test_a_reaction_that_turns_too_fast_is_slowed_down_and_keeps_its_way():
    """Sliding and turning by the same share: what it would have done, later."""
    supervisor = started(SLOW, guards=(Guard(AtMost(CONTACT_FORCE, -1.0), reaction=(Fling(), Stop())),))
    passed = step(supervisor, observation())
    assert passed.angular_velocity_base_tip == pytest.approx((0.0, 0.5, 0.0))
    assert passed.velocity_base_tip == pytest.approx((0.0025, 0.0, 0.0))


@pytest.mark.parametrize("change", [turning((0.0, 3.0, 0.0)), turning((NAN, 0.0, 0.0)), turning("round")])
def test_a_forbidden_turn_brings_the_robot_to_rest_in_the_loop(change):
    backend = PuppetBackend()
    result = run(backend, touch(), PuppetController({20: change}), duration=0.05)
    assert (result.ending, result.at_rest, backend.at_rest) == (Ending.TRIPPED, True, True)
    assert "angular" in result.trip.measure
    assert not any(any(command.angular_velocity_base_tip) for command in backend.commands)
