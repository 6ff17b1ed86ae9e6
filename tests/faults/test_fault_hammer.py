"""Random faults at random periods, combined: never a wild command, always closed, never an exception."""

import math
from dataclasses import replace
from itertools import pairwise

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from faults.fault_rig import Commands, FaultyBackend, Injection, Rig, Samples, carry_out
from faults.fault_table import ANYWHERE, RETRACT_SPEED
from faults.grip_plant import TIP_RADIUS, GripPlant
from palpate.runtime.data import Command, Phase
from palpate.runtime.result import Ending
from palpate.runtime.supervision import Limits
from palpate.runtime.touch import Finger, Touch
from palpate.spatial import ZERO, norm, subtract
from palpate.surfaces import Sphere
from runtime.puppets import PERIOD, PUSH, PuppetBackend, PuppetController, touch

SLACK = 1.0 + 1e-8
DURATION = 0.1
PERIODS = round(DURATION / PERIOD)

any_float = st.floats(allow_nan=True, allow_infinity=True)
small = st.floats(-0.3, 0.3)
three = st.tuples(*[st.one_of(any_float, small)] * 3)
six = st.tuples(*[st.one_of(any_float, st.floats(-30.0, 30.0))] * 6)
anything = st.one_of(st.none(), st.text(max_size=3), any_float, three, st.lists(any_float, max_size=4))
grips = st.one_of(st.none(), anything, st.tuples(any_float, any_float), st.just((3.0, 3.0)))


def _arm(name, value):
    return lambda now, before: replace(now, arm=replace(now.arm, **{name: value}))


def _first_wrench(**commanded):
    def change(now, before):
        if not now.wrenches:
            return now
        return replace(now, wrenches=(replace(now.wrenches[0], **commanded), *now.wrenches[1:]))

    return change


bad_samples = st.one_of(
    st.builds(_arm, st.sampled_from(("position_base_tip", "velocity_base_tip")), three),
    st.builds(_arm, st.just("rotation_base_tip"), st.tuples(three, three, three)),
    st.builds(_arm, st.just("time"), any_float),
    st.builds(_arm, st.just("joint_position"), st.lists(any_float, max_size=3).map(tuple)),
    st.builds(_first_wrench, wrench=six),
    st.builds(_first_wrench, time=any_float),
    st.builds(_first_wrench, acceleration=three),
    st.builds(lambda t: lambda now, before: replace(now, time=t), any_float),
    st.just(lambda now, before: replace(now, wrenches=())),
    st.just(lambda now, before: replace(now, hand=None)),
)


SIGNALS = tuple(fault.injection for fault in ANYWHERE if fault.ending is Ending.INTERRUPTED)


class ForAWhile:
    """A change that passes."""

    def __init__(self, change, periods):
        self._change, self._left = change, periods

    def __call__(self, now, before):
        self._left -= 1
        return self._change(now, before) if self._left >= 0 else now


PHASES = st.sampled_from([phase for phase in Phase if phase is not Phase.STOP])
"""STOP is the loop's and the supervisor's word."""
bad_commands = st.one_of(
    st.builds(lambda x: lambda command: x, anything),
    st.builds(lambda v: lambda command: replace(command, velocity_base_tip=v), st.one_of(three, anything)),
    st.builds(lambda g: lambda command: replace(command, grip_force=g), grips),
    st.builds(lambda p: lambda command: replace(command, phase=p), st.one_of(PHASES, anything)),
)
injections = st.one_of(
    st.sampled_from([fault.injection for fault in ANYWHERE]),
    st.builds(lambda change, n: Samples(ForAWhile(change, n)), bad_samples, st.integers(1, 60)),
    st.builds(Commands, bad_commands),
)
histories = st.lists(st.tuples(st.integers(1, PERIODS + 20), injections), max_size=6)
"""From the second period on: what is wrong at the start may raise, as nothing moves yet."""
limits = st.builds(
    Limits,
    force=st.sampled_from((1.0, 5.0, 20.0)),
    speed=st.sampled_from((RETRACT_SPEED, 0.25)),
    acceleration=st.sampled_from((1.0, 25.0)),
    grip_force=st.sampled_from((3.0, 40.0)),
)


class Holding:
    def start(self, first):
        pass

    def step(self, now):
        return Command((0.0, 0.0, 0.01), Phase.HOLD, (3.0, 3.0))


def pushing(bounds: Limits) -> Rig:
    return Rig(
        FaultyBackend(PuppetBackend({step: {"wrench": PUSH} for step in range(3)})),
        touch(),
        PuppetController(velocity=(0.0009, 0.0, 0.0)),
        bounds,
        DURATION,
    )


def holding(bounds: Limits) -> Rig:
    return Rig(
        FaultyBackend(GripPlant(3.0)), Touch(*[Finger(Sphere(TIP_RADIUS))] * 2), Holding(), bounds, DURATION
    )


def inject(rig: Rig, history: list[tuple[int, Injection]], bounds: Limits) -> None:
    for at, injection in history:
        injection.into(rig, at)
    rig.limits = bounds  # whatever the table's lines narrow


def check_commands(commands: list[Command], bounds: Limits) -> None:
    for command in commands:
        assert isinstance(command, Command)
        x, y, z = command.velocity_base_tip
        assert all(map(math.isfinite, (x, y, z)))
        assert math.hypot(x, y, z) <= bounds.speed * SLACK
        if command.grip_force is not None:
            assert all(0.0 <= force <= bounds.grip_force * SLACK for force in command.grip_force)
    stopped = [command.phase is Phase.STOP for command in commands]
    assert sorted(stopped) == stopped  # after the first stop command only stop commands follow
    for before, now in pairwise((Command(), *commands)):
        if now.velocity_base_tip != ZERO and norm(now.velocity_base_tip) > RETRACT_SPEED * SLACK:
            change = norm(subtract(now.velocity_base_tip, before.velocity_base_tip))
            assert change <= bounds.acceleration * PERIOD * SLACK


def hammer_pushing(history, bounds):
    rig = pushing(bounds)
    inject(rig, history, bounds)
    try:
        outcome = carry_out(rig)
    except KeyboardInterrupt:  # two signals: the second one is meant to
        assert sum(injection in SIGNALS for _, injection in history) > 1
        check_commands(rig.backend.commands, bounds)
        assert rig.backend.closed_after == len(rig.backend.commands)
        return
    check_commands(outcome.commands, bounds)
    assert rig.backend.closed_after == len(outcome.commands)
    assert outcome.commands[-1].velocity_base_tip == ZERO
    assert (outcome.result.trip is not None) or outcome.result.ending is not Ending.TRIPPED
    if outcome.result.trip is not None:
        assert str(outcome.result.trip) in outcome.errors()
    assert outcome.events[-1].text.startswith("ended: ")


@pytest.mark.slow
@settings(max_examples=80, deadline=None, derandomize=True)
@given(histories, limits)
def test_whatever_goes_wrong_no_wild_command_reaches_the_robot_and_it_is_left_stopped(history, bounds):
    hammer_pushing(history, bounds)


@pytest.mark.slow
@settings(max_examples=600, deadline=None)  # 3000 pass, in three minutes
@given(histories, limits)
def test_whatever_goes_wrong_no_wild_command_reaches_the_robot_at_length(history, bounds):
    hammer_pushing(history, bounds)


@pytest.mark.slow
@settings(max_examples=50, deadline=None, derandomize=True)
@given(histories)
def test_whatever_goes_wrong_what_is_held_is_not_dropped(history):
    """But for a controller that opens the hand: that it may."""
    bounds = Limits()
    rig = holding(bounds)
    inject(rig, history, bounds)
    try:
        outcome = carry_out(rig)
    except KeyboardInterrupt:
        return  # as above
    check_commands(outcome.commands, bounds)
    commanded = [command.grip_force for command in outcome.commands if command.grip_force is not None]
    assert rig.backend.closed_after == len(outcome.commands)
    if all(min(grip) >= 3.0 for grip in commanded):
        rig.backend.sound.coast(0.5)
        assert rig.backend.sound.fallen < 1e-6
    last = commanded[-1] if commanded else None
    after = [c.grip_force for c in outcome.commands if c.phase is Phase.STOP]
    assert set(after) <= {last}
