"""A robot's devices, to be examined: those of a rig, or of an emulated robot, which run meanwhile."""

import os
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import replace

import msgspec

from palpate.errors import InvalidValueError
from palpate.hw.emulators.host import Host
from palpate.hw.emulators.process import EmulatorProcess
from palpate.kinematics.pose import Pose, rotvec_from_rotation
from palpate.robots.backend_entries import EmulatedHandEntry, EmulatedUr5eEntry
from palpate.robots.emulated.hand import FLANGE_HAND, EmulatedHand
from palpate.robots.emulated.scene import EmulatedUr5e, pose_flange_tip
from palpate.robots.emulated.truth import TruthTrace, new_memory
from palpate.robots.emulated.ur5e import DEVICE_TIMEOUT
from palpate.robots.finger_sensor import model_of_finger, noise_of
from palpate.robots.hands import described_hand, hand_wires
from palpate.robots.idle import FORCE_NOISE, MOMENT_NOISE, idle_hand_task, idle_task
from palpate.robots.rig_entries import (
    DynamixelEntry,
    PoseEntry,
    RigEntry,
    ServoEntry,
    SlideFingerEntry,
    UrEntry,
)
from palpate.robots.robot import Robot
from palpate.robots.robot_file import FingerEntry
from palpate.robots.sensor_devices import NetFtEntry
from palpate.robots.simulated_sensor_entry import NoiseEntry
from palpate.sim.hand.finger import SlideFinger

REAL_TIME = 1.0
"""Seconds of the robot per second of wall time: rates are to be those of real devices."""

Making = Callable[[int, int], Callable[[], Host]]


@contextmanager
def with_devices(robot: Robot, name: str) -> Iterator[Robot]:
    """Give a robot of kind `rig`: itself, or the rig that an emulated one is, its emulators running meanwhile.

    Raises:
        InvalidValueError: It has no devices.
        DeviceError: Emulators do not come up.
    """
    entry = robot.file.backend
    if isinstance(entry, RigEntry):
        yield robot
    elif isinstance(entry, EmulatedUr5eEntry | EmulatedHandEntry):
        with _emulated_rig(robot, entry) as rig:
            yield rig
    else:
        raise InvalidValueError(
            f"robot = {name}: backend.kind = {entry.__struct_config__.tag} has no devices to connect to; give a "
            "robot file of kind rig, emulated-ur5e or emulated-hand; `palpate robot check` is for all of them"
        )


@contextmanager
def _emulated_rig(robot: Robot, entry: EmulatedUr5eEntry | EmulatedHandEntry) -> Iterator[Robot]:
    """Run the emulators of a robot while it is examined."""
    at_once = replace(
        robot,
        file=msgspec.structs.replace(robot.file, backend=msgspec.structs.replace(entry, time_scale=REAL_TIME)),
    )
    rig, making = _ur5e(at_once, entry) if isinstance(entry, EmulatedUr5eEntry) else _hand(at_once, entry)
    with ExitStack() as running:
        memory = new_memory()
        running.callback(os.close, memory)
        trace = TruthTrace(memory)
        running.callback(trace.close)
        running.enter_context(EmulatorProcess(making(os.getpid(), memory)))
        trace.begin()  # sensors of a scene that stands have no noise
        yield rig


def _ur5e(robot: Robot, entry: EmulatedUr5eEntry) -> tuple[Robot, Making]:
    task = idle_task(robot)
    devices = RigEntry(arm=_arm(entry.address, pose_flange_tip(entry)))
    return (
        _rig(robot, devices, (entry.address,)),
        lambda process, memory: EmulatedUr5e(robot, task, process, memory),
    )


def _hand(robot: Robot, entry: EmulatedHandEntry) -> tuple[Robot, Making]:
    hand, wires = described_hand(robot).geometry, hand_wires(msgspec.structs.replace(entry, time_scale=REAL_TIME))
    task = idle_hand_task(hand)
    assert isinstance(hand.finger, SlideFinger)  # of two fingers
    devices = RigEntry(
        arm=_arm(entry.address, FLANGE_HAND),
        hand=DynamixelEntry(
            port=str(wires.bus),
            servos=tuple(ServoEntry(servo_id=i + 1) for i in range(hand.fingers)),
            finger=SlideFingerEntry(pinion=hand.finger.pinion),
            opening=hand.opening,
            depth=hand.depth,
            closing_speed=hand.closing_speed,
            watchdog=DEVICE_TIMEOUT,
            silent_after=0.8 * DEVICE_TIMEOUT,
            reply_timeout=0.1 * DEVICE_TIMEOUT,
        ),
    )
    return (
        _rig(robot, devices, entry.sensors),
        lambda process, memory: EmulatedHand(task, wires, process, memory),
    )


def _arm(address: str, pose: Pose) -> UrEntry:
    tcp = PoseEntry(position=pose.position, rotvec=rotvec_from_rotation(pose.rotation))
    return UrEntry(address=address, tcp=tcp, watchdog=DEVICE_TIMEOUT)


def _rig(robot: Robot, devices: RigEntry, boxes: tuple[str, ...]) -> Robot:
    fingers = tuple(
        msgspec.structs.replace(
            finger,
            noise=_noise(finger),
            simulated_sensor=None,
            sensor_device=NetFtEntry(address=box, silent_after=DEVICE_TIMEOUT),
        )
        for finger, box in zip(robot.file.fingers, boxes, strict=True)
    )
    return replace(robot, file=msgspec.structs.replace(robot.file, backend=devices, fingers=fingers))


def _noise(finger: FingerEntry) -> NoiseEntry:
    """What its simulated sensor has; that of a usual one where the file has none."""
    force, moment = noise_of(model_of_finger(finger))
    return NoiseEntry(force=force or FORCE_NOISE, moment=moment or MOMENT_NOISE)
