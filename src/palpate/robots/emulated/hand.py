"""A hand over real wires: fingers, sensors and what lifts them emulated, the simulated hand of a task behind them.

Dynamixel servos on a terminal, an F/T box for each fingertip, and a UR controller for the lift; the makers' client
libraries talk to them as to real ones.
"""

from dataclasses import dataclass
from pathlib import Path

from palpate.errors import InvalidValueError
from palpate.hw.dynamixel.hand import DynamixelHand
from palpate.hw.dynamixel.registers import XL330
from palpate.hw.dynamixel.settings import HandSettings, ServoCalibration
from palpate.hw.emulators.dynamixel.bus import DynamixelBus
from palpate.hw.emulators.dynamixel.servo import EmulatedServo
from palpate.hw.emulators.host import Host
from palpate.hw.emulators.netft import BoxSettings, NetFtServer
from palpate.hw.emulators.server import PlantState, ServoGoal, ServoState
from palpate.hw.emulators.ur import UrServer
from palpate.hw.emulators.ur.arm import ArmMounting
from palpate.hw.ft_stream.streamed_sensor import StreamSettings
from palpate.hw.netft import NetFt, NetFtSettings
from palpate.hw.rig import FingerSensor, FramedArm, PolledHand, Rig, RigSettings
from palpate.hw.ur import UrArm, UrSettings
from palpate.kinematics.pose import Pose
from palpate.robots.emulated.backend import Emulation, OnTheWire
from palpate.robots.emulated.devices import DEVICE_TIMEOUT
from palpate.robots.emulated.scene_plant import ScenePlant
from palpate.robots.emulated.truth import TruthTrace
from palpate.robots.hand_task import HandTask
from palpate.runtime.protocols import Backend
from palpate.runtime.real_time import USUAL_PRIORITY, RealTime
from palpate.runtime.urgency import be_real_time
from palpate.sensing.compensation import SensorPayload
from palpate.sim.carriers.arm_carrier import LOOKING_DOWN
from palpate.sim.hand.backend import HandBackend
from palpate.sim.hand.hand import Hand
from palpate.sim.hand.scene import GraspScene
from palpate.sim.hand.servo_grip import ServoGrip, ShaftGoal
from palpate.sim.hand.truth_numbers import hand_columns
from palpate.spatial import Vector, Wrench

ARM_BASE = Pose((-0.45, 0.0, 0.0))
"""Where the emulated arm stands in the scene: half of its reach behind the object."""

FLANGE_HAND = Pose((0.0, 0.0, 0.05), LOOKING_DOWN)
"""Where the hand is on its flange."""

OLDEST = 0.2
"""[s] Of a sample, in the hand's time, where one computer plays all of the devices."""

SENSOR_RATE = 1000.0
"""[1/s] Records of an F/T box per second of the hand's time."""

RANGES: Wrench = (40.0, 40.0, 40.0, 0.5, 0.5, 0.5)
"""Of the F/T boxes [N, N m]: beyond those of the sensors behind them, which end by themselves."""

QUIET = (1e-3, 1e-3, 1e-3, 1e-5, 1e-5, 1e-5)
"""Least noise of a tare [N, N m]; nothing is tared here."""


@dataclass(frozen=True, slots=True)
class HandWires:
    """Where a hand's devices listen, and how fast time goes for them.

    Attributes:
        arm: Address of the controller that lifts.
        sensors: Of each fingertip's F/T box.
        bus: Where a link to the servos' terminal shall stand.
        time_scale: Seconds of the hand per second of wall time.
    """

    arm: str
    sensors: tuple[str, ...]
    bus: Path
    time_scale: float


class _BusServos:
    """A scene's servos as the emulated bus knows them."""

    def __init__(self, grip: ServoGrip) -> None:
        self._grip = grip

    def take(self, goals: tuple[ServoGoal, ...]) -> None:
        self._grip.take([ShaftGoal(its.torque_on, its.position, its.current, its.speed) for its in goals])

    def states(self) -> tuple[ServoState, ...]:
        return tuple(ServoState(its.position, its.velocity, its.current) for its in self._grip.states())


class _Lifting(ScenePlant):
    """A plant whose carrier goes up and down only, and never hears of what rounding makes of other directions."""

    def step(
        self, velocity_base_tip: Vector, angular_velocity_base_tip: Vector, servos: tuple[ServoGoal, ...]
    ) -> PlantState:
        return super().step((0.0, 0.0, velocity_base_tip[2]), (0.0, 0.0, 0.0), servos)


@dataclass(frozen=True, slots=True, eq=False)
class EmulatedHand:
    """What `EmulatorProcess` takes: the devices of a hand, and the scene of its task behind them.

    Attributes:
        task: What it is to hold.
        wires: Where they listen.
        process: That has made the memory for the truth.
        memory: Its descriptor there.
    """

    task: HandTask
    wires: HandWires
    process: int
    memory: int

    def __call__(self) -> Host:
        """Return a host that listens and is ready to run.

        Raises:
            InvalidValueError: The scene cannot be, or an address is not free.
            OSError: A port of an F/T box is not free.
        """
        be_real_time()
        task, wires = self.task, self.wires
        scene = HandBackend(task.scene(), task.period, task.sensor, load=task.load, grip=ServoGrip)
        grip = scene.grip
        assert isinstance(grip, ServoGrip)
        trace = TruthTrace.of_process(self.process, self.memory)
        plant = _Lifting(scene, trace, _BusServos(grip))
        arm = UrServer(wires.arm, mounting=ArmMounting(pose_base_robot=ARM_BASE, pose_flange_tip=FLANGE_HAND))
        boxes = [
            NetFtServer(BoxSettings(address, rate=SENSOR_RATE * wires.time_scale, ranges=RANGES), i)
            for i, address in enumerate(wires.sensors)
        ]
        bus = DynamixelBus([EmulatedServo(XL330, i + 1) for i in range(task.hand.fingers)], link=wires.bus)
        return Host(plant, [arm, *boxes, bus], scale=wires.time_scale)


class HandOnTheWire(OnTheWire):
    """A hand's `Backend`, with the scene behind it, and its truth."""

    def __init__(self, scene: GraspScene, emulation: Emulation, rig: Backend, time_scale: float) -> None:
        """Start nothing yet; see `OnTheWire`."""
        super().__init__(hand_columns(scene.hand), emulation, rig, time_scale)
        self.scene = scene


def emulated_hand(task: HandTask, wires: HandWires) -> HandOnTheWire:
    """Return a hand over real wires; nothing runs before it is started.

    Raises:
        InvalidValueError: Another number of F/T boxes than of fingers, or a scene that cannot be.
    """
    hand, scene = task.hand, task.scene()
    if len(wires.sensors) != hand.fingers:
        raise InvalidValueError(
            f"sensors = {', '.join(wires.sensors)}: must be {hand.fingers} addresses, one per finger"
        )
    scale = wires.time_scale
    period = task.period / scale
    assert isinstance(hand, Hand)  # what is emulated is made of Dynamixels
    tip = hand.tip
    settings = HandSettings(
        tuple(ServoCalibration(i + 1) for i in range(hand.fingers)),
        hand.finger,
        hand.opening,
        hand.tip_along,
        hand.closing_speed,
        watchdog=DEVICE_TIMEOUT,
        silence=0.8 * DEVICE_TIMEOUT,
    )
    arm = UrArm(
        wires.arm,
        UrSettings(pose_flange_tip=FLANGE_HAND, watchdog=DEVICE_TIMEOUT, stale_after=DEVICE_TIMEOUT),
    )
    stream = NetFtSettings(StreamSettings(QUIET, silent_after=DEVICE_TIMEOUT))
    payload = SensorPayload(tip.mass, tip.center_of_mass)
    rig = Rig(
        RealTime(period, priority=USUAL_PRIORITY),
        RigSettings(period, oldest=DEVICE_TIMEOUT, kinematics=hand),
        arm=FramedArm(arm, ARM_BASE),
        hand=PolledHand(DynamixelHand(str(wires.bus), settings), hand.bus_period / scale),
        fingers=[FingerSensor(NetFt(address, stream), payload) for address in wires.sensors],
    )

    def emulation(process: int, memory: int) -> EmulatedHand:
        return EmulatedHand(task, wires, process, memory)

    return HandOnTheWire(scene, emulation, rig, scale)
