"""MuJoCo scenes as plants behind emulated devices, and how their truth comes back: no sockets here."""

import os
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import msgspec
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.errors import InvalidValueError
from palpate.experiments.explore.config import ExploreConfig
from palpate.hw.emulators.server import Plant
from palpate.kinematics.pose import Pose
from palpate.robots.emulated.backend import EmulatedBackend
from palpate.robots.emulated.scene_plant import ScenePlant
from palpate.robots.emulated.truth import ROWS, WIDEST, TruthTrace, new_memory
from palpate.robots.emulated.ur5e import EmulatedUr5eEntry, simulated_twin
from palpate.robots.in_scene import build
from palpate.robots.pace_entries import SimulatedPaceEntry
from palpate.robots.robot import load_robot
from palpate.runtime.data import ArmSample, Command
from palpate.sim.contact_truth import Truth, numbers_of_truth, truth_of_numbers
from palpate.sim.friction.plant import FrictionContact
from palpate.sim.hand.backend import HandBackend
from palpate.sim.hand.hand import Hand
from palpate.sim.hand.servo_grip import ServoGrip, ShaftGoal
from palpate.sim.hand.truth import FingerTruth, HandTruth
from palpate.sim.hand.truth_numbers import hand_columns, numbers_of_hand
from palpate.spatial import ZERO
from support.explore_runs import plan_of
from support.grasp_runs import plan_of as plan_grasp

numbers = st.floats(-1e3, 1e3)
vectors = st.tuples(numbers, numbers, numbers)
fingers = st.builds(FingerTruth, st.booleans(), vectors, vectors, vectors, numbers)
poses = st.builds(Pose, vectors, st.tuples(vectors, vectors, vectors))
DOWN = (0.0, 0.0, -0.05)


@pytest.fixture
def memory():
    file = new_memory()
    yield file
    os.close(file)


@pytest.fixture
def trace(memory):
    opened = TruthTrace(memory)
    yield opened
    opened.close()


def robot_with(**changed):
    robot = load_robot("emulated-ur5e")
    entry = msgspec.structs.replace(robot.file.backend, **changed)
    return replace(robot, file=msgspec.structs.replace(robot.file, backend=entry))


def task():
    return plan_of(ExploreConfig(robot="emulated-ur5e", width=0.02, depth=0.004)).setup.task


def scene():
    return build(simulated_twin(robot_with()), task()).backend


# The truth


@settings(max_examples=30, deadline=None)
@given(st.lists(st.floats(0.0, 1.0), min_size=1, max_size=40), st.floats(-0.1, 1.1))
def test_a_sample_gets_the_newest_truth_that_is_no_later(times, asked):
    file = new_memory()
    trace = TruthTrace(file)
    times.sort()
    for i, time in enumerate(times):
        trace.write([float(i)], time)
    before = [i for i, time in enumerate(times) if time <= asked]
    assert trace.at(asked)[0] == (before[-1] if before else 0)
    trace.close()
    os.close(file)


def test_of_more_rows_than_there_is_room_the_newest_are_left(trace):
    for i in range(ROWS + 500):
        trace.write([float(i), *range(WIDEST - 1)], float(i))
    assert trace.at(ROWS + 499.5)[:3] == (ROWS + 499.0, 0.0, 1.0)
    assert trace.at(600.0)[0] > 600.0  # long gone: the oldest that is left
    assert trace.at(float(ROWS))[0] == ROWS


def test_nothing_is_known_before_the_first_message(trace):
    assert trace.at(1e9) == ()
    assert not truth_of_numbers(trace.at(1e9)).touching


def test_both_ends_see_the_same_memory(memory, trace):
    other = TruthTrace.of_process(os.getpid(), memory)
    other.write([3.0], 1.0)
    assert trace.at(2.0)[0] == 3.0
    assert not other.begun
    trace.begin()
    assert other.begun
    other.close()
    other.close()


def test_lost_memory_is_reported():
    file = new_memory()
    os.close(file)
    with pytest.raises(OSError, match="No such file"):
        TruthTrace.of_process(os.getpid(), file)


@given(st.builds(Truth, st.booleans(), vectors, vectors, vectors, poses))
def test_the_truth_of_a_contact_survives_the_way(truth):
    assert truth_of_numbers(numbers_of_truth(truth)) == truth


@given(
    numbers,
    st.lists(fingers, min_size=2, max_size=3),
    st.tuples(vectors, st.tuples(numbers, numbers, numbers, numbers), vectors, vectors),
    st.tuples(numbers, numbers, numbers, numbers, numbers, numbers),
    poses,
    st.lists(st.tuples(st.floats(0.0, 1.0), st.floats(0.0, 10.0)), min_size=3, max_size=3),
)
def test_the_truth_of_a_grasp_survives_the_way(time, touched, rest, pull, hand, slips):
    truth = HandTruth(time, tuple(touched), (0.001, -0.002, 0.003)[: len(touched)], *rest)
    rubbing = [
        FrictionContact(object(), ZERO, ZERO, 1.0, ZERO, 0.0, (speed, 0.0, 0.0), spin, False)
        for speed, spin in slips[: len(touched)]
    ]
    rubbed = SimpleNamespace(rubbing=[contact.pair for contact in rubbing])
    row = numbers_of_hand(truth, pull, ArmSample(time, hand.position, hand.rotation, ZERO), rubbing, rubbed)
    columns = hand_columns(Hand(len(touched)))
    assert len(row) == len(columns) <= WIDEST
    told = dict(zip(columns, row, strict=True))
    assert tuple(told[f"pull_{axis}_n"] for axis in "xyz") == pull[:3]
    assert tuple(told[f"hand_{axis}_m"] for axis in "xyz") == hand.position
    for i, (finger, (speed, spin)) in enumerate(zip(touched, slips, strict=False)):
        assert told[f"finger_{i}_touching"] == finger.touching
        assert tuple(told[f"finger_{i}_torque_{axis}_nm"] for axis in "xyz") == finger.torque
        assert (told[f"finger_{i}_slip_speed_m_per_s"], told[f"finger_{i}_slip_spin_rad_per_s"]) == (speed, spin)


# The scene behind the devices


@pytest.mark.slow
def test_a_scene_is_a_plant_that_moves_as_it_does_by_itself():
    directly, behind = scene(), scene()
    plant: Plant = ScenePlant(behind)
    first, start = directly.start(), plant.start()
    assert (start.arm, start.wrenches) == (first.arm, first.wrenches)
    for _ in range(30):
        sample = directly.step(Command(velocity_base_tip=DOWN))
        state = plant.step(DOWN, ZERO, ())
        assert (state.arm, state.wrenches) == (sample.arm, sample.wrenches)
    assert state.time == pytest.approx(sample.time, abs=1e-3)


def test_a_scene_stands_until_it_may_begin_and_its_clock_runs_on(trace):
    plant = ScenePlant(scene(), trace)
    start = plant.start()
    for _ in range(20):
        waiting = plant.step(DOWN, ZERO, ())
        assert waiting.arm.position_base_tip == start.arm.position_base_tip
        assert waiting.wrenches[0].wrench == start.wrenches[0].wrench
    assert waiting.time == pytest.approx(20 * plant.period)
    assert waiting.arm.time == pytest.approx(waiting.time)
    trace.begin()
    times = [waiting.arm.time]
    for _ in range(20):
        moving = plant.step(DOWN, ZERO, ())
        times.append(moving.arm.time)
    assert moving.arm.position_base_tip[2] < start.arm.position_base_tip[2] - 5e-4
    steps = np.diff(times)
    assert steps == pytest.approx(np.full(20, plant.period), rel=0.3)
    # the scene itself knows nothing of the wait
    directly: Any = scene()
    directly.start()
    for _ in range(20):
        directly.step(Command(DOWN))
    assert trace.at(1e12)[: len(directly.truth_columns)] == directly.truth_row()


def held(**grip):
    return HandBackend(plan_grasp().task().scene(), 1e-3, **grip)


def test_servos_that_get_the_goals_of_a_grip_force_press_with_that_force():
    forced, driven = held(), held(grip=ServoGrip)
    forced.start()
    driven.start()
    hand, force = plan_grasp().task().hand, 2.0
    assert isinstance(hand, Hand)
    finger = hand.finger
    goal = ShaftGoal(
        torque_on=True,
        position=finger.closed(hand.opening, hand.tip_along) / finger.ratio,
        current=finger.servo.driving_current(force * finger.lever(0.0, hand.tip_along)),
        speed=hand.closing_speed / finger.lever(0.0, hand.tip_along),
    )
    assert isinstance(driven.grip, ServoGrip)
    driven.grip.take((goal, goal))
    for _ in range(3000):
        forced.step(Command(grip_force=(force, force)))
        driven.step(Command())
    for one, other in zip(forced.truth().fingers, driven.truth().fingers, strict=True):
        assert one.touching
        assert other.touching
        assert np.linalg.norm(other.force) == pytest.approx(np.linalg.norm(one.force), rel=0.02)
        assert np.linalg.norm(other.force) == pytest.approx(force, rel=0.1)


def test_a_servo_whose_torque_is_off_does_not_move_and_one_that_is_on_goes_to_its_goal():
    hand = held(grip=ServoGrip)
    hand.start()
    assert isinstance(hand.grip, ServoGrip)
    hand.grip.take((ShaftGoal(False, 0.05, 0.5, 1.0), ShaftGoal(True, 0.05, 0.5, 1.0)))
    for _ in range(1000):
        hand.step(Command())
    off, on = hand.grip.states()
    assert abs(off.position) < 1e-3
    assert off.current == 0.0
    assert on.position == pytest.approx(0.05, abs=0.01)
    hand.start()
    assert [its.position for its in hand.grip.states()] == pytest.approx([0.0, 0.0], abs=1e-3)
    for _ in range(100):
        hand.step(Command())
    assert [its.position for its in hand.grip.states()] == pytest.approx([0.0, 0.0], abs=1e-3)


# The robot file


@pytest.mark.parametrize("address", ["192.168.0.5", "0.0.0.0", "nonsense", "::1", "128.0.0.1"])
def test_an_emulated_robot_listens_on_this_computer_alone(address):
    with pytest.raises(InvalidValueError, match="this computer"):
        EmulatedUr5eEntry(address=address)


def test_what_keeps_its_own_time_cannot_be_simulated_time():
    robot = robot_with()
    robot = replace(robot, file=msgspec.structs.replace(robot.file, pace=SimulatedPaceEntry()))
    with pytest.raises(InvalidValueError, match="real_time"):
        build(robot, task())


def test_building_starts_nothing_and_closing_what_was_not_started_is_fine():
    backend = build(robot_with(address="127.0.9.41", time_scale=0.5), task()).backend
    assert backend.period == pytest.approx(0.002)
    assert isinstance(backend, EmulatedBackend)
    with pytest.raises(OSError, match="not started"):
        backend.step(Command())
    backend.close()
    backend.close()
    assert backend.scene.model.nq > 0
    assert not backend.truth().touching


def test_its_wires_are_reckoned_with_in_force_control():
    twin, wired = build(simulated_twin(robot_with()), task()), build(robot_with(), task())
    assert 0.002 < wired.response - twin.response < 0.01
    assert wired.stiffness == twin.stiffness
