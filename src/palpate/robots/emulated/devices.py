"""Emulated devices that run while they are examined, as the rig that they are."""

import os
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import replace

import msgspec

from palpate.hw.emulators.process import EmulatorProcess
from palpate.kinematics.pose import Pose, rotvec_from_rotation
from palpate.robots.device_settings import PoseEntry
from palpate.robots.emulated.backend import Emulation
from palpate.robots.emulated.truth import TruthTrace, new_memory
from palpate.robots.finger_sensor import model_of_finger, noise_of
from palpate.robots.idle import FORCE_NOISE, MOMENT_NOISE
from palpate.robots.rig import RigEntry
from palpate.robots.robot import Robot
from palpate.robots.robot_file import FingerEntry
from palpate.robots.sensor_devices import NetFtEntry
from palpate.robots.simulated_sensor_entry import NoiseEntry
from palpate.robots.ur_arm import UrEntry

DEVICE_TIMEOUT = 0.5
"""[s] Without a word after which a device counts as lost: this is one computer that does everything, and its own
stalls are no faults of a robot. The supervisor's limit on the age of samples comes first."""


@contextmanager
def running(rig: Robot, emulation: Emulation) -> Iterator[Robot]:
    """Run emulators, and give the rig that connects to them.

    Raises:
        DeviceError: They do not come up.
    """
    with ExitStack() as stack:
        memory = new_memory()
        stack.callback(os.close, memory)
        trace = TruthTrace(memory)
        stack.callback(trace.close)
        stack.enter_context(EmulatorProcess(emulation(os.getpid(), memory)))
        trace.begin()  # sensors of a scene that stands have no noise
        yield rig


def arm_entry(address: str, pose_flange_tip: Pose) -> UrEntry:
    """Return the arm of an emulated controller."""
    tcp = PoseEntry(position=pose_flange_tip.position, rotvec=rotvec_from_rotation(pose_flange_tip.rotation))
    return UrEntry(address=address, tcp=tcp, watchdog=DEVICE_TIMEOUT)


def rig_of(robot: Robot, devices: RigEntry, boxes: tuple[str, ...]) -> Robot:
    """Return the rig of these devices, and of the F/T boxes at these addresses behind a robot's fingers."""
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
