"""A cell on the wire: a UR arm over an elastic plane and an F/T box, in one emulator."""

from dataclasses import dataclass

from palpate.hw.dynamixel.registers import XL330
from palpate.hw.emulators.dynamixel.bus import DynamixelBus
from palpate.hw.emulators.dynamixel.servo import EmulatedServo
from palpate.hw.emulators.host import Host
from palpate.hw.emulators.netft import BoxSettings, NetFtServer
from palpate.hw.emulators.simple_plant import ElasticPlane, SimplePlant, SimpleServo, SimpleTip
from palpate.hw.emulators.ur import UrServer
from palpate.hw.emulators.ur.arm import ArmMounting
from palpate.kinematics.pose import Pose

PLACE = (-0.1333, 0.4919, 0.4879)
"""[m] Where the emulated tip starts, the arm's own base frame."""

FLANGE_TIP = ((0.0, -1.0, 0.0), (-1.0, 0.0, 0.0), (0.0, 0.0, -1.0))
"""Turns the flange of an arm that reaches down so that the tip's axes are the base's."""

ROTVEC = (2.221441469079183, -2.221441469079183, 0.0)
"""The same as axis times angle [rad]."""


NOISE = (0.003, 0.003, 0.003, 1.6e-5, 1.6e-5, 1.6e-5)
"""[N, N m] Of each sensor, as the robot files below declare it: one that has none stands still."""


@dataclass(frozen=True, slots=True)
class Cell:
    """What `EmulatorProcess` takes.

    Attributes:
        address: Of both.
        above: From the plane to the tip's middle at the start [m].
        stiffness: Of the plane [N/m].
        unlock_delay: See `UrServer`.
    """

    address: str
    above: float = 0.003
    stiffness: float = 2000.0
    unlock_delay: float = 5.0

    def __call__(self) -> Host:
        """Return a host that listens."""
        plane = ElasticPlane(PLACE[2] - self.above, self.stiffness)
        plant = SimplePlant(SimpleTip(Pose(PLACE), plane), noise=(NOISE,))
        arm = UrServer(
            self.address,
            mounting=ArmMounting(pose_flange_tip=Pose(rotation=FLANGE_TIP)),
            unlock_delay=self.unlock_delay,
        )
        return Host(plant, [arm, NetFtServer(BoxSettings(self.address))])


@dataclass(frozen=True, slots=True)
class HandCell:
    """What `EmulatorProcess` takes: two servos, and a box for each finger on ports of its own.

    Attributes:
        address: Of the boxes.
    """

    address: str

    def __call__(self) -> Host:
        """Return a host that listens."""
        bus = DynamixelBus([EmulatedServo(XL330, i + 1) for i in range(2)])
        boxes = [
            NetFtServer(BoxSettings(self.address, rdt_port=49152 + 2 * i, calibration_port=49151 + 2 * i), i)
            for i in range(2)
        ]
        return Host(SimplePlant(servos=(SimpleServo(), SimpleServo()), noise=(NOISE, NOISE)), [bus, *boxes])


ROBOT = """
palpate_robot: 1
name: a rig in a test
backend:
  kind: rig
  arm:
    kind: ur
    address: ADDRESS
    tcp: {rotvec_rad: [2.221441469079183, -2.221441469079183, 0.0]}
    watchdog_s: 1.0
    response_s: 0.02
    lag_s: 0.02
period_s: 0.002
pace: {kind: real_time}
fingers:
  - surface: {kind: sphere, radius_m: 0.008}
    payload: {mass_kg: 0.0}
    noise: {force_N: 0.003, moment_Nm: 0.000016}
    sensor_device: {kind: netft, address: ADDRESS, silent_after_s: 2.0}
limits: {force_N: 20, speed_m_per_s: 0.1, sample_age_s: 1.0}
"""


HAND = """
palpate_robot: 1
name: a hand in a test
backend:
  kind: rig
  hand:
    kind: dynamixel
    port: TERMINAL
    servos: [{id: 1, model: XL330-M288}, {id: 2, model: XM430-W210}]
    finger: {kind: slide, pinion_m: 0.02}
    watchdog_s: 2.0
    silent_after_s: 1.0
    reply_timeout_s: 0.125
period_s: 0.004
pace: {kind: real_time}
fingers:
  - surface: {kind: sphere, radius_m: 0.008, center_m: [0.0, 0.0, 0.012]}
    payload: {mass_kg: 0.0}
    noise: {force_N: 0.003, moment_Nm: 0.000016}
    sensor_device: {kind: netft, address: ADDRESS, silent_after_s: 2.0}
  - surface: {kind: sphere, radius_m: 0.008, center_m: [0.0, 0.0, 0.012]}
    payload: {mass_kg: 0.0}
    noise: {force_N: 0.003, moment_Nm: 0.000016}
    sensor_device: {kind: netft, address: ADDRESS, silent_after_s: 2.0, port: 49154, calibration_port: 49153}
limits: {force_N: 20, sample_age_s: 1.0}
"""


def robot_file(folder, address, text=ROBOT):
    """Write a robot file and return its path."""
    path = folder / "rig.yaml"
    path.write_text(text.replace("ADDRESS", address))
    return path
