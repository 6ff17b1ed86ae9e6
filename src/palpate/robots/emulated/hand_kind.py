"""The emulated hand of a robot file: the simulated one over real wires, lifted by an emulated UR controller."""

import itertools
import os
import tempfile
from contextlib import AbstractContextManager
from functools import partial
from pathlib import Path
from typing import Annotated

import msgspec
import numpy as np

from palpate.errors import InvalidValueError
from palpate.hw.ur.library import refuse_unsupported
from palpate.open_kinds import Settings
from palpate.robots.dynamixel_hand import DynamixelEntry, ServoEntry, SlideFingerEntry
from palpate.robots.emulated.devices import DEVICE_TIMEOUT, arm_entry, rig_of, running
from palpate.robots.emulated.hand import FLANGE_HAND, EmulatedHand, HandWires, emulated_hand
from palpate.robots.emulated.loopback import TIME_SCALES, loopback_address
from palpate.robots.hand_description import HandDescription, simulated_hand
from palpate.robots.hand_task import PERIOD, HandTask
from palpate.robots.idle import idle_hand_task
from palpate.robots.rig import RigEntry
from palpate.robots.robot import Robot
from palpate.robots.robot_kind import RobotKind
from palpate.robots.surface_entries import SphereEntry
from palpate.robots.task import RobotInScene, Task
from palpate.runtime import Backend
from palpate.runtime.robot_ranges import within
from palpate.sim.hand.finger import SlideFinger
from palpate.sim.hand.hand import Hand
from palpate.surfaces import Sphere

ALIKE = 1e-6
"""[m, kg] between an emulated fingertip in a file and the simulated one."""

_buses = itertools.count()


class EmulatedHandEntry(RobotKind, Settings, frozen=True, kw_only=True):
    """The simulated hand behind an emulated bus of servos, F/T boxes, and an emulated UR controller that lifts it.

    Attributes:
        address: Where the controller listens: one of the loopback net, for ports are fixed.
        sensors: Of the F/T boxes, one per finger, likewise.
        time_scale: Seconds of the hand per second of wall time: less where the computer is too busy for 1.
    """

    address: str = "127.0.0.2"
    sensors: Annotated[tuple[str, ...], msgspec.Meta(min_length=2, max_length=3)] = ("127.0.0.3", "127.0.0.4")
    time_scale: float = 0.25

    def __post_init__(self) -> None:
        """Refuse addresses that others can reach, or that are not distinct."""
        within("time_scale", self.time_scale, *TIME_SCALES)
        loopback_address("address", self.address)
        for i, address in enumerate(self.sensors):
            loopback_address(f"sensors[{i}]", address)
        if len(set(self.sensors)) < len(self.sensors):
            given = ", ".join(self.sensors)
            raise InvalidValueError(f"sensors = {given}: each box needs an address of its own")

    def check_drivers(self) -> None:
        """See `RobotKind`."""
        refuse_unsupported()

    def check(self, robot: Robot) -> None:
        """See `RobotKind`."""
        self.described_hand(robot)

    def build(self, robot: Robot, task: Task) -> RobotInScene:
        """Refuse: see `RobotKind`."""
        raise InvalidValueError(
            "backend.kind = emulated_hand: it is for `palpate grasp`; this experiment is done with one finger, "
            "take emulated-ur5e"
        )

    def has_hand(self, robot: Robot) -> bool:
        """See `RobotKind`."""
        return True

    def described_hand(self, robot: Robot) -> HandDescription:
        """See `RobotKind`."""
        simulated = simulated_hand(len(robot.file.fingers))
        if robot.file.period != PERIOD:
            raise InvalidValueError(f"period_s = {robot.file.period:g}: must be {PERIOD:g} for an emulated hand")
        tip = simulated.geometry.tips[0]
        assert isinstance(tip.surface, Sphere)
        radius, mass, center = tip.surface.radius, tip.mass, tip.center_of_mass
        for i, finger in enumerate(robot.file.fingers):
            surface, payload = finger.surface, finger.payload
            alike = (
                isinstance(surface, SphereEntry)
                and payload is not None
                and np.allclose(surface.center, center, atol=ALIKE)
                and abs(surface.radius - radius) < ALIKE
                and abs(payload.mass - mass) < ALIKE
                and np.allclose(payload.center_of_mass, center, atol=ALIKE)
            )
            if not alike:
                raise InvalidValueError(
                    f"fingers[{i}]: an emulated hand has spheres of {radius:g} m around {list(center)} m, of "
                    f"{mass:g} kg with their centre of mass there, and no sensor file; write surface, payload so"
                )
        return HandDescription(simulated.geometry, simulated.fingers, PERIOD, robot.file.limits, robot)

    def hand_backend(self, hand: HandDescription, task: HandTask) -> Backend:
        """See `RobotKind`."""
        return emulated_hand(task, self.wires())

    def devices(self, robot: Robot) -> AbstractContextManager[Robot]:
        """See `RobotKind`: in real time, for rates are to be those of real devices."""
        hand, wires = self.described_hand(robot).geometry, msgspec.structs.replace(self, time_scale=1.0).wires()
        assert isinstance(hand, Hand)  # the simulated hand
        assert isinstance(hand.finger, SlideFinger)  # of two fingers
        devices = RigEntry(
            arm=arm_entry(self.address, FLANGE_HAND),
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
        rig = rig_of(robot, devices, self.sensors)
        return running(rig, partial(EmulatedHand, idle_hand_task(hand), wires))

    def wires(self) -> HandWires:
        """Return where its devices listen; the bus where nobody else's is."""
        bus = Path(tempfile.gettempdir()) / f"palpate-hand-{os.getpid()}-{next(_buses)}"
        return HandWires(self.address, self.sensors, bus, self.time_scale)
