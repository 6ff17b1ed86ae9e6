"""Motion of the emulated controller's arm: properties, without sockets or clients."""

import math
from collections.abc import Iterable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.errors import InvalidValueError
from palpate.hw.emulators.simple_plant import ElasticPlane, SimplePlant, SimpleTip
from palpate.hw.emulators.ur.arm import HOME, ArmMounting, numbers_of, pose_of
from palpate.hw.emulators.ur.commands import control_script
from palpate.hw.emulators.ur.controller import ControllerVersion, EmulatedController
from palpate.hw.emulators.ur.motion import ZERO_LENGTH, Profile
from palpate.hw.emulators.ur.script import DONE, READY, Registers, Script
from palpate.kinematics import UR5E, ArmKinematics, Pose
from palpate.kinematics.pose import rotation_from_rotvec

MOVE_L, FORCE_MODE, FORCE_STOP, ZERO, SPEED_J, SPEED_L, SERVO_J, SPEED_STOP = 3, 6, 7, 8, 9, 10, 11, 15
SET_PAYLOAD, SET_TCP, STOP_L, WATCHDOG, STEADY = 17, 29, 33, 35, 47
UNTIL_CONTACT, DETECT, END_DETECT, DETECTED, STOP_SCRIPT = 51, 62, 63, 64, 255
TABLE = ArmKinematics(UR5E).pose(HOME).position[2]
"""Height of the tip at the beginning [m]."""


class Bench:
    """A robot with a running control script, and access to its registers."""

    def __init__(self, mounting: ArmMounting | None = None, plane: ElasticPlane | None = None) -> None:
        mounting = mounting or ArmMounting()
        flange = ArmKinematics(UR5E).pose(HOME)
        self.plant = SimplePlant(SimpleTip(mounting.pose_base_robot @ flange @ mounting.pose_flange_tip, plane))
        self.robot = EmulatedController(ControllerVersion(), mounting, unlock_delay=5.0)
        self.robot.measure(self.plant.start())
        self.path: list[tuple[float, ...]] = []
        self.start()
        self.run(0.004)

    def start(self) -> bool:
        script = Script(self.robot, Registers(self.robot))
        return self.robot.start_program(control_script(script), "control")

    def run(self, seconds: float) -> Any:
        """Run for a time; return the displacement of the TCP [m], shape (3,)."""
        before = self.tcp
        for _ in range(round(seconds / self.plant.period)):
            self.robot.cycle()
            velocity, turning = self.robot.arm.tip_velocity(self.robot.twist)
            self.robot.measure(self.plant.step(velocity, turning, ()))
            self.path.append(self.tcp)
        return np.subtract(self.tcp, before)[:3]

    def write(
        self, command: int, doubles: Iterable[float] = (), integers: Iterable[int] = (), seconds: float = 0.0
    ) -> Any:
        """Write a command to the registers and run for a time; return the displacement of the TCP [m]."""
        values = {f"input_double_register_{i}": (value,) for i, value in enumerate(doubles)}
        values |= {f"input_int_register_{i + 1}": (value,) for i, value in enumerate(integers)}
        self.robot.write({**values, "input_int_register_0": (command,)})
        return self.run(seconds)

    def wait(
        self, command: int, doubles: Iterable[float] = (), integers: Iterable[int] = (0,), then: float = 0.0
    ) -> float:
        """Do a blocking command as the client does, and run on; return how long the command took [s]."""
        self.write(0, seconds=0.002)
        assert self.state == READY
        self.write(command, doubles, integers)
        begun = self.robot.time
        while self.state != DONE:
            self.run(0.002)
            assert self.robot.time - begun < 60.0
        took = self.robot.time - begun
        self.write(0, seconds=then)
        return took

    def ask(self, command: int) -> float:
        """Return the reply to a blocking command."""
        self.wait(command)
        return self.out("output_int_register_1")

    def slide(self, fraction: float, seconds: float) -> None:
        """Set the speed slider and run for a time."""
        self.robot.write({"speed_slider_mask": (1,), "speed_slider_fraction": (fraction,)})
        self.run(seconds)

    def out(self, name: str) -> float:
        return self.robot.outputs[name][0]

    @property
    def state(self) -> float:
        return self.out("output_int_register_0")

    @property
    def playing(self) -> bool:
        return self.robot.runtime.name == "PLAYING"

    @property
    def tcp(self) -> tuple[float, ...]:
        return self.robot.outputs["actual_TCP_pose"]

    @property
    def force(self) -> tuple[float, ...]:
        return self.robot.outputs["actual_TCP_force"]


def at_rest(within: float = 1e-6) -> Any:
    """Displacement of an arm that does not move, to a tolerance [m]."""
    return pytest.approx((0.0, 0.0, 0.0), abs=within)


def test_a_blocking_command_is_done_once_until_it_is_withdrawn() -> None:
    bench = Bench()
    bench.wait(SET_TCP, (0.0, 0.0, 0.1, 0.0, 0.0, 0.0), then=0.01)
    assert bench.state == READY
    for height in (0.2, 0.3):
        bench.write(SET_TCP, (0.0, 0.0, height, 0.0, 0.0, 0.0), seconds=0.1)
        assert bench.state == DONE
    assert bench.robot.arm.pose_flange_tcp.position == (0.0, 0.0, 0.2)


def test_the_script_ends_without_done_and_with_an_error_at_a_command_that_is_not_emulated() -> None:
    bench = Bench()
    bench.write(STOP_SCRIPT, seconds=0.01)
    assert not bench.playing
    assert bench.state == READY
    assert bench.start()
    bench.write(24, seconds=0.01)
    assert not bench.playing
    assert any("command 24 is not emulated" in line for line in bench.robot.lines())


@given(
    length=st.floats(1e-4, 3.0),
    speed=st.floats(1e-3, 2.0),
    acceleration=st.floats(0.01, 20.0),
    fraction=st.floats(0.1, 1.0),
    share=st.floats(1e-3, 0.05),
)
@settings(max_examples=50)
def test_a_profile_keeps_its_limits_and_never_overshoots(
    length: float, speed: float, acceleration: float, fraction: float, share: float
) -> None:
    profile = Profile(length, speed, acceleration)
    previous, covered = 0.0, 0.0
    ideal = length / speed + speed / acceleration if length > speed**2 / acceleration else 0.0
    ideal = ideal or 2.0 * math.sqrt(length / acceleration)
    dt = share * ideal
    steps = 0
    while not profile.over:
        profile.advance(dt, fraction)
        # the last step may be what rounding leaves
        if not profile.over:
            assert abs(profile.speed - previous) <= acceleration * dt * fraction * (1.0 + 1e-6) + 1e-12
        assert 0.0 <= profile.speed <= speed + 1e-12
        assert covered <= profile.at <= length + 1e-12
        previous, covered = profile.speed, profile.at
        steps += 1
        # a cycle is lost at each corner of the profile, and the end is approached in ever smaller steps
        assert steps * dt * fraction < ideal + 60.0 * dt
    assert profile.at == pytest.approx(length, rel=1e-9)
    # and comes to rest there: in one more cycle, or from where nothing is left to go
    assert previous <= 1.01 * acceleration * dt * fraction + math.sqrt(2.0 * acceleration * ZERO_LENGTH)


@pytest.mark.slow
def test_a_linear_move_is_straight_keeps_its_speed_and_takes_its_time_which_the_slider_stretches() -> None:
    took = []
    for fraction in (1.0, 0.5):
        bench = Bench()
        bench.slide(fraction, 0.0)
        start, way = np.array(bench.tcp), np.array((0.06, -0.02, -0.08))
        target = (*(start[:3] + way), *start[3:])
        bench.path.clear()
        took.append(bench.wait(MOVE_L, (*target, 0.1, 0.5)))
        assert np.allclose(bench.tcp[:3], target[:3], atol=1e-4)
        length = np.linalg.norm(way)
        points = np.array(bench.path)[:, :3] - start[:3]
        assert np.linalg.norm(np.cross(points, way / length), axis=1).max() < 1e-9
        speeds = np.linalg.norm(np.diff(points, axis=0), axis=1) / bench.plant.period
        assert speeds.max() < fraction * 0.1 * 1.05
        # another TCP does not move the arm that has arrived
        flange = bench.robot.arm.flange.position
        bench.wait(SET_TCP, (0.0, 0.0, 0.1, 0.0, 0.0, 0.0), then=0.5)
        assert bench.robot.arm.flange.position == pytest.approx(flange, abs=1e-4)
    # ramps of v^2 / 2a each, and the arm's lag; half the speed takes twice as long, but for the settling
    assert took[0] == pytest.approx(length / 0.1 + 0.1 / 0.5, abs=0.25)
    assert took[1] == pytest.approx(2.0 * took[0], abs=0.3)


def test_a_speed_accelerates_as_commanded_goes_on_until_stopped_and_follows_the_slider() -> None:
    bench = Bench()
    # v t - v^2 / 2a, and v times the lag of 10 ms
    ramp = bench.write(SPEED_L, (0.02, 0.0, 0.0, 0.0, 0.0, 0.0, 0.1, 0.0), seconds=1.0)
    assert ramp[0] == pytest.approx(0.02 * 1.0 - 0.02**2 / 0.2 - 0.02 * 0.01, abs=2e-4)
    assert bench.write(0, seconds=0.5)[0] == pytest.approx(0.01, abs=1e-4)
    bench.slide(0.25, 0.5)
    assert bench.robot.arm.twist[0][0] == pytest.approx(0.005, rel=0.01)
    assert bench.robot.outputs["target_speed_fraction"] == (0.25,)
    bench.wait(SPEED_STOP, (1.0,), then=0.1)
    assert bench.run(0.5) == at_rest()
    assert bench.ask(STEADY) == 1


@pytest.mark.slow
@given(joint=st.integers(0, 5), speed=st.floats(-0.3, 0.3))
@settings(max_examples=10, deadline=None)
def test_joint_speeds_turn_the_commanded_joints_and_follow_the_slider(joint: int, speed: float) -> None:
    bench = Bench()
    before = bench.robot.arm.joints
    bench.write(SPEED_J, (*(speed if i == joint else 0.0 for i in range(6)), 10.0, 0.0), seconds=0.4)
    change = np.subtract(bench.robot.arm.joints, before)
    ramp = abs(speed) / 10.0 * 0.5 + 0.01
    assert change[joint] == pytest.approx(speed * (0.4 - ramp), abs=abs(speed) * 0.01 + 1e-6)
    # turning in place of the tip's lag: second order in the way
    assert np.abs(np.delete(change, joint)).max() < 0.02 * abs(speed) + 1e-9
    assert bench.robot.arm.joint_speeds[joint] == pytest.approx(speed, abs=0.02 * abs(speed) + 1e-9)
    bench.slide(0.25, 0.2)
    assert bench.robot.arm.joint_speeds[joint] == pytest.approx(0.25 * speed, abs=0.02 * abs(speed) + 1e-9)


def test_servoed_joints_reach_their_goal_as_its_lag_says() -> None:
    bench = Bench()
    goal = np.add(bench.robot.arm.joints, (0.05, -0.05, 0.05, 0.0, 0.0, 0.05))
    bench.write(SERVO_J, (*goal, 0.0, 0.0, 0.002, 0.1, 300.0), seconds=0.1)
    # x'' lag + x' + x / lookahead = 0 of the error, with a lag of 10 ms and a lookahead of 0.1 s
    slow, fast = (50.0 * (-1.0 + sign * math.sqrt(0.6)) for sign in (1.0, -1.0))
    left = (fast * math.exp(0.1 * slow) - slow * math.exp(0.1 * fast)) / (fast - slow)
    assert goal[0] - bench.robot.arm.joints[0] == pytest.approx(0.05 * left, rel=0.03)
    bench.run(2.0)
    assert bench.robot.arm.joints == pytest.approx(goal, abs=1e-6)


@pytest.mark.slow
@given(
    robot_base=st.tuples(*[st.floats(-1.0, 1.0)] * 6),
    tip=st.tuples(*[st.floats(-0.1, 0.1)] * 6),
    twist=st.tuples(*[st.floats(-0.05, 0.05)] * 6),
)
@settings(max_examples=15, deadline=None)
def test_clients_see_the_robot_base_and_the_tcp_wherever_the_plants_frames_are(
    robot_base: tuple[float, ...], tip: tuple[float, ...], twist: tuple[float, ...]
) -> None:
    plain = Bench(ArmMounting(pose_flange_tip=pose_of(tip)))
    moved = Bench(ArmMounting(pose_base_robot=pose_of(robot_base), pose_flange_tip=pose_of(tip)))
    for bench in (plain, moved):
        bench.wait(SET_TCP, (0.01, 0.02, 0.1, 0.3, 0.0, 0.1), then=0.002)
        bench.write(SPEED_L, (*twist, 1.0, 0.0), seconds=0.2)
    assert moved.tcp[:3] == pytest.approx(plain.tcp[:3], abs=1e-9)
    # near half a turn the sign of a rotation vector is free
    assert np.allclose(pose_of(moved.tcp).rotation, pose_of(plain.tcp).rotation, atol=1e-9)
    assert moved.robot.arm.joints == pytest.approx(plain.robot.arm.joints, abs=1e-6)
    # pose of the plant's tip in its own base agrees with the joints
    state = moved.plant.step((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), ()).arm
    through = ArmKinematics(UR5E, pose_of(robot_base), pose_of(tip)).pose(moved.robot.arm.joints)
    assert through.position == pytest.approx(state.position_base_tip, abs=1e-3)
    assert moved.robot.twist[1] == pytest.approx(twist[3:], abs=1e-12)


def test_turning_about_the_tcp_leaves_it_in_place() -> None:
    bench = Bench()
    bench.wait(SET_TCP, (0.0, 0.0, 0.15, 0.0, 0.0, 0.0), then=0.01)
    before = bench.tcp
    # linear and turning velocity have one lag; the rest is second order in the step
    assert bench.write(SPEED_L, (0.0, 0.0, 0.0, 0.2, 0.0, 0.0, 1.0, 0.0), seconds=1.0) == at_rest(5e-4)
    assert np.linalg.norm(np.subtract(bench.tcp, before)[3:]) > 0.1


@pytest.mark.parametrize(("force", "stiffness"), [(2.0, 2e3), (10.0, 2e4)])
def test_force_mode_ends_in_the_balance_of_forces(force: float, stiffness: float) -> None:
    height = TABLE - 0.001
    bench = Bench(plane=ElasticPlane(height, stiffness))
    doubles = (*[0.0] * 8, -force, 0.0, 0.0, 0.0, *[0.1] * 6)
    bench.write(FORCE_MODE, doubles, (2, 0, 0, 1, 0, 0, 0), seconds=3.0)
    assert bench.force[2] == pytest.approx(force, rel=0.01)
    assert bench.tcp[2] == pytest.approx(height - force / stiffness, abs=1e-5)
    # axes that are not compliant stay
    assert bench.tcp[:2] == pytest.approx(bench.path[0][:2], abs=1e-9)
    bench.wait(FORCE_STOP)
    assert bench.robot.compliance is None


def test_a_move_until_contact_stops_where_something_pushes_back_and_detection_reports_it() -> None:
    plane = ElasticPlane(TABLE - 0.005)
    bench = Bench(plane=plane)
    bench.wait(DETECT, (0.0, 0.0, -1.0, 0.0, 0.0, 0.0))
    assert bench.ask(DETECTED) == 0
    bench.wait(UNTIL_CONTACT, (0.0, 0.0, -0.01, *[0.0] * 9, 0.5), then=0.1)
    # at 5 N, and the way of braking and lag at 10 mm/s
    assert 5.0 <= bench.force[2] < 5.0 + plane.stiffness * 0.01 * 0.02
    assert bench.ask(DETECTED) == 1
    bench.wait(END_DETECT)
    assert bench.ask(DETECTED) == 0


def test_force_is_that_of_the_object_about_the_tcp_without_the_payload() -> None:
    bench = Bench(plane=ElasticPlane(TABLE + 0.001, 2e3))
    assert bench.force == pytest.approx((0.0, 0.0, 2.0, 0.0, 0.0, 0.0), abs=1e-9)
    # a TCP beside the contact: moment of the force about it, lever -0.1 m along the tool's x
    bench.wait(SET_TCP, (0.1, 0.0, 0.0, 0.0, 0.0, 0.0), then=0.01)
    lever = np.subtract(ArmKinematics(UR5E).pose(HOME).position, bench.tcp[:3])
    assert np.linalg.norm(lever) == pytest.approx(0.1)
    assert bench.force[3:] == pytest.approx(np.cross(lever, (0.0, 0.0, 2.0)), abs=1e-9)
    bench.wait(ZERO, then=0.01)
    assert bench.force == pytest.approx((0.0,) * 6, abs=1e-9)
    assert bench.robot.outputs["ft_raw_wrench"][2] == pytest.approx(-2.0)
    # nothing hangs on the sensor: its weight is taken off although it is not there
    bench.wait(SET_PAYLOAD, (1.2, 0.0, 0.0, 0.05), then=0.01)
    assert bench.out("payload") == pytest.approx(1.2)
    assert bench.force[:3] == pytest.approx((0.0, 0.0, 1.2 * 9.82), abs=1e-9)


@pytest.mark.slow
@given(st.floats(5.0, 50.0))
@settings(max_examples=10, deadline=None)
def test_the_watchdog_waits_for_its_set_time(frequency: float) -> None:
    bench = Bench()
    bench.wait(WATCHDOG, (frequency,))
    bench.write(SPEED_L, (0.05, 0.0, 0.0, 0.0, 0.0, 0.0, 10.0, 0.0))
    for _ in range(10):
        # the same values again are a sign of life, too
        bench.run(0.5 / frequency)
        assert bench.playing
        bench.write(SPEED_L)
    since = bench.robot.time
    while bench.playing:
        bench.run(0.002)
        assert bench.robot.time - since < 1.0
    assert bench.robot.time - since == pytest.approx(1.0 / frequency, abs=0.0041)
    # braking at 10 m/s^2 takes 5 ms, the lag another 10
    assert 0.0 <= bench.run(0.5)[0] < 0.05 * 0.02
    assert bench.robot.twist == ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    # the next program begins without a watchdog
    bench.write(0)
    bench.start()
    bench.run(0.5)
    assert bench.playing


def test_an_asynchronous_move_is_reported_and_stopped() -> None:
    bench = Bench()

    def progress() -> tuple[int, int]:
        """Return the flag and the count of asynchronous moves."""
        word = int(bench.out("output_int_register_2"))
        return word >> 15 & 1, word >> 24

    flag, before = progress()
    assert not flag
    target = np.add(bench.tcp, (0.1, 0.0, 0.0, 0.0, 0.0, 0.0))
    assert bench.wait(MOVE_L, (*target, 0.05, 1.0), (1,)) < 0.02
    assert progress() == (1, before + 1)
    bench.run(0.5)
    bench.wait(STOP_L, (10.0,), (0,))
    assert not progress()[0]
    bench.run(0.1)
    assert bench.run(0.3) == at_rest()
    assert bench.tcp[0] < target[0] - 0.05


@pytest.mark.slow
def test_a_protective_stop_holds_still_and_cannot_be_unlocked_at_once() -> None:
    bench = Bench()
    bench.write(SPEED_L, (0.05, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0), seconds=0.5)
    bench.robot.protective_stop("test")
    bench.run(0.1)
    assert bench.out("safety_status_bits") == 1 << 2 | 1 << 10
    assert (bench.out("safety_mode"), bench.out("runtime_state")) == (3, 4)
    at = bench.tcp[:3]
    assert bench.run(1.0) == at_rest()
    assert not bench.robot.unlock()
    bench.run(5.0)
    assert bench.robot.unlock()
    bench.run(0.5)
    # the program stays paused: an arm never goes on by itself
    assert bench.tcp[:3] == pytest.approx(at, abs=1e-6)
    assert (bench.out("runtime_state"), bench.out("safety_status_bits")) == (4, 1)


def test_an_emergency_stop_needs_power_and_brakes_again() -> None:
    bench = Bench()
    bench.robot.press_emergency_stop(True)
    bench.run(0.01)
    assert bench.out("safety_status_bits") == 1 << 6 | 1 << 7 | 1 << 10
    assert (bench.out("runtime_state"), bench.out("robot_mode"), bench.out("robot_status_bits")) == (1, 3, 0)
    assert not bench.start()
    bench.robot.press_emergency_stop(False)
    assert not bench.start()


@pytest.mark.parametrize(
    ("command", "doubles", "ending"),
    [
        (MOVE_L, (3.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.1, 1.0), "protective stop why=cannot move there"),
        (SPEED_L, (6.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1e4, 0.0), "protective stop why=tool faster than"),
        (SPEED_L, (0.0, 0.5, 0.0, 0.0, 0.0, 0.0, 10.0, 0.0), "protective stop why=the arm does not reach"),
        (SPEED_L, (math.nan, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0), "ended why=error: double registers from 0"),
        (SET_PAYLOAD, (-1.0, 0.0, 0.0, 0.0), "ended why=error: payload of -1.0 kg"),
    ],
)
def test_impossible_commands_stop_the_arm(command: int, doubles: tuple[float, ...], ending: str) -> None:
    bench = Bench()
    before = bench.tcp
    bench.write(command, doubles, seconds=3.0)
    assert not bench.playing
    assert any(ending in line for line in bench.robot.lines())
    # less than the length of the arm and of its tool
    assert np.linalg.norm(bench.tcp[:3]) < 1.2
    assert "ended" not in ending or bench.tcp == before


def test_the_plant_must_begin_where_the_arm_holds_its_tip() -> None:
    start = SimplePlant(SimpleTip(ArmKinematics(UR5E).pose(HOME))).start()
    turned = replace(start, arm=replace(start.arm, joint_position=HOME))
    robot = EmulatedController(ControllerVersion(), ArmMounting(), 5.0)
    robot.measure(turned)
    assert robot.outputs["actual_q"] == HOME
    far = SimplePlant(SimpleTip(Pose((2.0, 0.0, 0.0)))).start()
    beside = ArmMounting(pose_flange_tip=Pose((0.0, 0.0, 0.1)))
    for mounting, state, message in (
        (ArmMounting(), far, "reach"),
        (beside, turned, r"0\.1000 m.*pose_flange_tip"),
    ):
        with pytest.raises(InvalidValueError, match=message):
            EmulatedController(ControllerVersion(), mounting, 5.0).measure(state)


@given(st.tuples(*[st.floats(-1.0, 1.0)] * 3))
def test_poses_as_numbers_and_back(rotvec: tuple[float, ...]) -> None:
    x, y, z = rotvec
    pose = Pose((0.1, 0.2, 0.3), rotation_from_rotvec((x, y, z)))
    back = pose_of(numbers_of(pose))
    assert np.allclose(back.rotation, pose.rotation, atol=1e-12)
    assert back.position == pose.position
