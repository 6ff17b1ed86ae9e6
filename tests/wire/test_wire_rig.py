"""A rig of made-up devices: what it does in which order, when, and whatever fails."""

import math
from itertools import combinations, count

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.errors import InvalidValueError, OverrunError
from palpate.hw.devices import DeviceError
from palpate.hw.rig import FingerSensor, FramedArm, FreshlyTared, PolledHand, Rig, RigSettings
from palpate.hw.rig.placed_arm import ArmAtPlace, ArmFromHere, Beginning
from palpate.hw.rig.rig import GRAVITY
from palpate.kinematics.pose import Pose, rotation_from_rotvec
from palpate.runtime.data import Command
from palpate.runtime.pacing import SimulatedTime
from palpate.sensing.compensation import SensorPayload, contact_wrench
from palpate.sim.hand.hand import Hand
from palpate.spatial import ZERO
from support.rig_devices import MadeUpArm, MadeUpHand, MadeUpSensor
from support.waiting import until

OLDEST = 5.0
"""[s]: the machine may stall."""
SETTINGS = RigSettings(0.002, OLDEST)
DOWN = (0.0, 0.0, -0.01)
vectors = st.tuples(*[st.floats(-3.0, 3.0)] * 3)


@pytest.fixture(scope="module", autouse=True)
def made_up_time():
    """Devices and rig share a clock that goes on whenever somebody looks, and only then."""
    clock = count(100.0, 1e-6).__next__
    with pytest.MonkeyPatch.context() as patch:
        for module in ("support.rig_devices", "palpate.hw.rig.rig"):
            patch.setattr(f"{module}.monotonic", clock)
        yield


class World:
    def __init__(self, *, arm=True, hand=True, pacer=None, payload=None, pose=None, **sensor):
        self.diary = []
        self.arm = MadeUpArm(self.diary, pose) if arm else None
        self.hand = MadeUpHand(self.diary) if hand else None
        self.sensor = MadeUpSensor(self.diary, self.arm, payload, **sensor)
        self.finger = FingerSensor(self.sensor, payload or SensorPayload())
        self.rig = Rig(pacer or SimulatedTime(), SETTINGS, arm=self.arm, hand=self.hand, fingers=[self.finger])

    def calls(self, *kinds):
        return [entry[:2] for entry in self.diary if entry[1] in kinds]


def moving(grip=None):
    return Command(DOWN, grip_force=grip)


def test_what_only_tells_starts_first_and_what_moves_stops_first():
    world = World()
    with world.rig as rig:
        rig.start()
        assert not world.calls("move", "press", "tare")
    names = [name for name, _ in world.calls("start")]
    assert names == ["sensor", "hand", "arm"]
    assert [name for name, _ in world.calls("close")] == ["arm", "hand", "sensor"]


def test_a_sensor_inside_the_arm_starts_after_it():
    diary = []
    sensor = FingerSensor(MadeUpSensor(diary), in_arm=True)
    Rig(SimulatedTime(), SETTINGS, arm=MadeUpArm(diary), fingers=[sensor]).start()
    assert [name for name, what in diary if what == "start"] == ["arm", "sensor"]


@pytest.mark.parametrize(
    ("unfit", "call"),
    [("sensor", "start"), ("hand", "start"), ("arm", "start"), ("hand", "read"), ("sensor", "tare")],
)
def test_when_one_does_not_start_none_is_left_open(unfit, call):
    world = World()
    getattr(world, unfit).lose(call)
    with pytest.raises(DeviceError, match=unfit):
        (FreshlyTared(world.rig) if call == "tare" else world.rig).start()
    started = {name for name, _ in world.calls("start")}
    assert started == {"arm", "hand", "sensor"} or call == "start"
    assert started <= {name for name, _ in world.calls("close")}
    moves = [entry[2:] for entry in world.diary if entry[1] == "move"]
    assert moves == ([(ZERO, ZERO)] if call == "tare" else [])
    assert not world.calls("press")
    with pytest.raises(DeviceError, match="not started"):
        world.rig.step(Command())


def test_time_begins_at_zero_and_each_sample_keeps_its_own():
    world = World()
    devices = (world.arm, world.sensor, world.hand)
    world.arm.age, world.sensor.age, world.hand.age = 0.5, 0.25, 0.125
    first = world.rig.start()
    assert first.time == 0.0
    assert first.arm.time < -0.4
    samples = [world.rig.step(Command()) for _ in range(20)]
    assert all(np.diff([0.0, *(sample.time for sample in samples)]) > 0.0)
    # by how much the rig's clock is behind the devices'
    origin = devices[0].reported[-1] - samples[-1].arm.time
    for device, part in zip(devices, (lambda s: s.arm, lambda s: s.wrenches[0], lambda s: s.hand), strict=True):
        kept = [part(sample).time for sample in samples]
        assert kept == pytest.approx([time - origin for time in device.reported[-20:]], abs=1e-9)
        assert all(time + device.age <= sample.time for time, sample in zip(kept, samples, strict=True))


def test_a_device_that_is_ahead_of_the_clock_is_not_from_the_future():
    world = World()
    world.arm.age = -0.005
    world.rig.start()
    sample = world.rig.step(Command())
    assert sample.arm.time <= sample.time


@pytest.mark.parametrize("slow", ["sensor", "hand", "arm"])
def test_too_old_a_sample_names_device_age_limit_and_remedy_and_stops_the_arm(slow):
    world = World()
    world.rig.start()
    world.rig.step(moving())
    getattr(world, slow).age = 2.0 * OLDEST
    with pytest.raises(
        DeviceError, match=rf"{slow}: its newest sample is 1\d\d\d\d ms old, the limit is 5000 ms; check"
    ):
        world.rig.step(moving())
    assert world.arm.twist == (ZERO, ZERO)


LOSSES = [("arm", "read"), ("arm", "move"), ("hand", "read"), ("hand", "press"), ("sensor", "read")]


@pytest.mark.parametrize("losses", [*combinations(LOSSES, 1), *combinations(LOSSES, 2)])
def test_whatever_fails_the_arm_stands_still_and_the_hand_goes_on_pressing(losses):
    world = World()
    world.rig.start()
    world.rig.step(moving((2.0, 2.0)))
    for device, call in losses:
        getattr(world, device).lose(call)
    world.diary.clear()
    with pytest.raises(DeviceError):
        world.rig.step(moving())
    moves = [entry for entry in world.diary if entry[1] == "move"]
    assert moves[-1][2:] == (ZERO, ZERO)
    pressed = [entry[2] for entry in world.diary if entry[1] == "press"]
    assert pressed
    assert set(pressed) == {(2.0, 2.0)}


@pytest.mark.parametrize("error", [OverrunError("late"), KeyboardInterrupt()], ids=["overrun", "Ctrl-C"])
def test_a_wait_that_is_broken_off_stops_the_arm_and_the_hand_presses_on(error):
    class BrokenOff(SimulatedTime):
        def wait(self):
            raise error

    world = World(pacer=BrokenOff())
    world.rig.start()
    with world.rig as rig:
        with pytest.raises(type(error)):
            rig.step(moving((1.0, 1.0)))
        assert world.arm.twist == (ZERO, ZERO)
    assert [name for name, _ in world.calls("close")] == ["arm", "hand", "sensor"]
    assert {entry[2] for entry in world.diary if entry[1] == "press"} == {(1.0, 1.0)}


def test_one_that_cannot_be_closed_does_not_keep_the_others_open():
    world = World()
    world.rig.start()
    world.arm.lose("close")
    with pytest.raises(DeviceError):
        world.rig.close()
    assert {name for name, _ in world.calls("close")} == {"arm", "hand", "sensor"}


def test_a_sensor_that_says_it_is_unwell_stops_it():
    world = World()
    world.rig.start()
    world.sensor.healthy = False
    with pytest.raises(DeviceError, match="sensor"):
        world.rig.step(moving())
    assert world.arm.twist == (ZERO, ZERO)


def test_the_grip_stays_until_commanded_otherwise():
    world = World()
    world.rig.start()
    for grip in [None, (1.0, 1.0), None, None, (3.0, 2.0), None]:
        world.rig.step(Command(grip_force=grip))
    pressed = [entry[2] for entry in world.diary if entry[1] == "press"]
    assert pressed == [(1.0, 1.0)] * 3 + [(3.0, 2.0)] * 2  # nothing before the first command


@pytest.mark.parametrize(
    ("arm", "hand", "command"),
    [
        (False, True, Command(DOWN)),
        (False, True, Command(angular_velocity_base_tip=DOWN)),
        (True, False, Command(grip_force=(1.0,))),
        (True, True, Command(finger_velocity=((0.0, 0.0, 0.0),) * 2)),
    ],
)
def test_refuses_what_its_devices_cannot_do(arm, hand, command):
    world = World(arm=arm, hand=hand)
    world.rig.start()
    with pytest.raises(InvalidValueError):
        world.rig.step(command)
    if arm:
        assert world.arm.twist == (ZERO, ZERO)


def test_several_sensors_without_kinematics_are_refused():
    fingers = [FingerSensor(MadeUpSensor([], name=f"sensor {i}")) for i in range(2)]
    with pytest.raises(InvalidValueError, match="kinematics"):
        Rig(SimulatedTime(), SETTINGS, fingers=fingers)


@settings(deadline=None, max_examples=30)
@given(vectors)
def test_specific_force_is_gravity_upwards_in_the_sensor_frame(rotvec):
    pose = Pose((0.1, 0.2, 0.3), rotation_from_rotvec(rotvec))
    sample = World(pose=pose).rig.start()
    felt = np.array(pose.rotation) @ sample.wrenches[0].acceleration
    assert felt == pytest.approx([0.0, 0.0, GRAVITY], abs=1e-12)


def test_an_arm_that_tells_its_acceleration_is_believed():
    class Accelerating(MadeUpArm):
        def acceleration_base_tip(self):
            return (1.0, -2.0, 3.0)

    arm = Accelerating([])
    sample = Rig(SimulatedTime(), SETTINGS, arm=arm, fingers=[FingerSensor(MadeUpSensor([], arm))]).start()
    assert sample.wrenches[0].acceleration == pytest.approx((1.0, -2.0, 3.0 + GRAVITY))


@settings(deadline=None, max_examples=20)
@given(vectors, st.tuples(st.floats(0.0, 0.03), st.floats(0.0, 0.03)))
def test_sensors_of_a_hand_feel_gravity_as_its_kinematics_turns_them(rotvec, joints):
    geometry, diary = Hand(), []
    arm, hand = MadeUpArm(diary, Pose(ZERO, rotation_from_rotvec(rotvec))), MadeUpHand(diary, joints)
    fingers = [FingerSensor(MadeUpSensor(diary, name=f"sensor {i}")) for i in range(2)]
    known = RigSettings(0.002, OLDEST, kinematics=geometry)
    sample = Rig(SimulatedTime(), known, arm=arm, hand=hand, fingers=fingers).start()
    for i, felt in enumerate(sample.wrenches):
        turned = np.array(arm.pose.rotation) @ np.array(geometry.pose_hand_sensor(i, joints[i]).rotation)
        assert turned @ felt.acceleration == pytest.approx([0.0, 0.0, GRAVITY], abs=1e-12)


@settings(deadline=None, max_examples=30)
@given(vectors, vectors, st.tuples(*[st.floats(-5.0, 5.0)] * 6))
def test_after_a_tare_only_the_touch_is_felt_however_it_is_turned(rotvec, later, offset):
    payload = SensorPayload(0.3, (0.01, -0.02, 0.04))
    world = World(payload=payload, offset=offset, pose=Pose(ZERO, rotation_from_rotvec(rotvec)))
    first = FreshlyTared(world.rig).start()
    assert first.time == 0.0
    world.arm.pose = Pose(ZERO, rotation_from_rotvec(later))
    world.sensor.load = load = (0.5, -0.25, 1.0, 0.01, 0.02, -0.03)
    sample = world.rig.step(Command()).wrenches[0]
    assert contact_wrench(sample.wrench, sample.acceleration, payload) == pytest.approx(load, abs=1e-9)


def test_raw_channels_are_not_tared():
    finger = FingerSensor(MadeUpSensor([]), gives_wrenches=False)
    rig = Rig(SimulatedTime(), SETTINGS, fingers=[finger])
    rig.start()
    with pytest.raises(DeviceError, match="raw channels"):
        rig.tare()


def test_starting_again_begins_anew_without_connecting_again():
    world = World()
    world.rig.start()
    world.rig.tare()
    zeroed = world.sensor.zero
    assert world.rig.start().time == 0.0
    assert world.calls("start") == [("sensor", "start"), ("hand", "start"), ("arm", "start")]
    assert world.sensor.zero == zeroed


def test_a_polled_hand_moves_its_fingers_if_the_hand_can():
    class Moving(MadeUpHand):
        moved = ()

        def move(self, finger_velocity):
            self.moved = finger_velocity

    hand = Moving([])
    polled = PolledHand(hand, 0.001)
    polled.start()
    polled.move(((0.0, 0.0, 0.01), None))
    until(lambda: hand.moved == ((0.0, 0.0, 0.01), None))
    polled.close()
    with pytest.raises(InvalidValueError, match="only close"):
        PolledHand(MadeUpHand([]), 0.001).move((None, None))


@settings(deadline=None, max_examples=50)
@given(vectors, vectors, vectors, vectors)
def test_an_arm_in_another_frame_moves_there_as_commanded(position, rotvec, tip, velocity):
    pose = Pose(position, rotation_from_rotvec(rotvec))
    own = MadeUpArm([], Pose(tip, rotation_from_rotvec(velocity)))
    framed = FramedArm(own, pose)
    framed.move(velocity, tip)
    reported = framed.read()
    assert reported.velocity_base_tip == pytest.approx(velocity, abs=1e-12)
    assert reported.angular_velocity_base_tip == pytest.approx(tip, abs=1e-12)
    there = pose @ own.pose
    assert reported.position_base_tip == pytest.approx(there.position, abs=1e-12)
    assert np.array(reported.rotation_base_tip) == pytest.approx(np.array(there.rotation), abs=1e-12)
    assert math.hypot(*own.twist[0]) == pytest.approx(math.hypot(*velocity), abs=1e-12)


def test_a_polled_hand_goes_on_pressing_tells_what_fails_and_recovers():
    hand = MadeUpHand([])
    polled = PolledHand(hand, 0.001)
    with pytest.raises(DeviceError, match="not started"):
        polled.read()
    polled.start()
    polled.press((1.5, 1.5))
    until(lambda: sum(entry[1] == "press" for entry in hand.diary) > 3)
    hand.lose("read")

    def fails():
        try:
            polled.read()
        except DeviceError:
            return True
        return False

    until(fails)
    hand.faults.clear()
    until(lambda: not fails())
    polled.close()
    before = len(hand.diary)
    polled.close()
    assert hand.diary[before:] == [("hand", "close")]
    assert {entry[2] for entry in hand.diary if entry[1] == "press"} == {(1.5, 1.5)}


@given(vectors, vectors)
def test_an_arm_from_here_begins_where_it_is(start, tip):
    own = MadeUpArm([], Pose(tip))
    arm = ArmFromHere(own, Beginning(start, 0.005, 0.1))
    arm.start()
    assert arm.read().position_base_tip == pytest.approx(start, abs=1e-12)
    own.pose = Pose((tip[0] + 1.0, tip[1], tip[2]))
    assert arm.read().position_base_tip == pytest.approx((start[0] + 1.0, start[1], start[2]), abs=1e-12)


@pytest.mark.parametrize(
    ("pose", "message"),
    [
        (Pose((0.0, 0.0, 0.006)), "within 5 mm"),
        (Pose(rotation=rotation_from_rotvec((0.0, 0.2, 0.0))), "turned by 11 degrees"),
    ],
)
def test_an_arm_that_is_elsewhere_does_not_start_and_is_let_go(pose, message):
    diary = []
    arm = ArmAtPlace(MadeUpArm(diary, pose), Pose(), Beginning(ZERO, 0.005, 0.1))
    with pytest.raises(DeviceError, match=message):
        arm.start()
    assert [what for _, what in diary] == ["start", "close"]
    near = ArmAtPlace(MadeUpArm([], Pose((0.0, 0.0, 0.004))), Pose(), Beginning(ZERO, 0.005, 0.1))
    near.start()
