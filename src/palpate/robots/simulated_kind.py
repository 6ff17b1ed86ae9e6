"""Robots that are simulated: a carrier in a scene, with a fingertip or a hand, as `backend` of a robot file."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import ClassVar

import msgspec

from palpate.controllers import LandingModel
from palpate.errors import InvalidValueError
from palpate.kinematics import StandingArm
from palpate.robots.device_settings import Range, RangedSettings
from palpate.robots.finger_sensor import check_age, model_of_finger
from palpate.robots.fingertip import only_finger
from palpate.robots.hand_description import HandDescription
from palpate.robots.hand_kind import HandKind
from palpate.robots.hand_task import HandTask
from palpate.robots.held_tool import HeldToolEntry
from palpate.robots.idle import plate_task
from palpate.robots.known_sensor import known_sensor
from palpate.robots.robot import Robot
from palpate.robots.robot_kind import RobotKind
from palpate.robots.simulated_finger import sensed_finger
from palpate.robots.simulated_tip import simulated_tip
from palpate.robots.task import RobotInScene, Task
from palpate.runtime import Backend, Finger
from palpate.sensing.compensation import SensorPayload
from palpate.sim import Carrier, Fidelity, MujocoBackend, SeededSensor, build_scene
from palpate.sim.carriers.carrier import CarriedMass
from palpate.sim.hand.backend import HandBackend
from palpate.spatial import Vector, subtract

SAME_RATE = 1e-9
"""Relative tolerance of times that are meant to be equal."""


@dataclass(frozen=True, slots=True, eq=False)
class TipCarrier:
    """A carrier that stands ready for a task.

    Attributes:
        carrier: What carries the tip.
        fidelity: How it is computed.
        lag: How far it runs behind a ramp [s].
        response: Delay that stands for its servos in force control [s].
        stiffness: With which it holds its tip [N/m].
        following_error_limit: By which its reference may lead the tip [m].
        arm: Its joints; None: they are alike everywhere.
    """

    carrier: Carrier
    fidelity: Fidelity
    lag: float
    response: float
    stiffness: float
    following_error_limit: float
    arm: StandingArm | None = None


class SimulatedKind(RobotKind, RangedSettings, frozen=True, kw_only=True):
    """A carrier in a scene; which, a kind says in `tip_carrier`.

    Attributes:
        time_step: Of the simulation [s]; the control period is a whole number of them.
        hand: With the fingers on it, its frame where the tip frame is; None: there is one finger.
        tool: That the hand holds: the first of `fingers`; None: it holds none.
    """

    METHODS = ("tip_carrier",)
    UNATTENDED = True
    RANGES: ClassVar[tuple[Range, ...]] = (("time_step_s", 1e-6, 0.01, "s"),)

    time_step: float = msgspec.field(name="time_step_s", default=0.0005)
    hand: HandKind | None = None
    tool: HeldToolEntry | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.tool is not None and self.hand is None:
            raise InvalidValueError("backend.tool: there is no hand that could hold it; give backend.hand")

    @property
    def holding(self) -> int:
        """See `RobotKind`: with a tool, all fingers of the hand."""
        return 0 if self.tool is None or self.hand is None else self.hand.fingers

    @property
    def measures_force(self) -> bool:
        """See `RobotKind`: with a tool, by its fingertips' sensors alone."""
        return self.tool is None

    @property
    def files(self) -> Mapping[str, str]:
        """See `RobotKind`."""
        return {} if self.hand is None else self.hand.files

    def tip_carrier(self, robot: Robot, load: CarriedMass, start: Vector) -> TipCarrier:
        """Return what carries a tip or a hand whose frame starts somewhere, base frame [m].

        Raises:
            InvalidValueError: It cannot, for the start is out of reach, or settings contradict one another.
        """
        raise NotImplementedError

    def check(self, robot: Robot) -> None:
        """See `RobotKind`."""
        if self.tool is not None:
            self.build(robot, plate_task(robot))
            return
        if self.hand is not None:
            self.described_hand(robot)
            return
        finger, sensor = only_finger(robot), robot.sensors[0]
        simulated_tip(robot, 0, finger.surface)
        steps = robot.file.period / self.time_step
        if round(steps) < 1 or abs(round(steps) / steps - 1.0) > SAME_RATE:
            raise InvalidValueError(
                f"period_s = {robot.file.period:g}: must be a whole number of backend.time_step_s, "
                f"{self.time_step:g}"
            )
        model = model_of_finger(finger)
        check_age(robot, model, robot.file.period)
        known_sensor(finger, sensor, SeededSensor(model), robot.file.period)

    def build(self, robot: Robot, task: Task) -> RobotInScene:
        """See `RobotKind`."""
        if self.tool is not None and self.hand is not None:
            only_finger(robot)
            return self.tool.build(
                robot, task, self.hand, lambda hand, start: self.tip_carrier(robot, hand, start)
            )
        if self.hand is not None:
            raise InvalidValueError(
                "backend.hand: this experiment is done with one fingertip; leave the hand out, or take a robot of "
                "kind exploring_finger, where the others hold, or give it a tool"
            )
        only_finger(robot)
        check_age(robot, task.sensor.model, task.period)
        tip = simulated_tip(robot, 0, task.tip)
        moved = self.tip_carrier(robot, tip, task.start)
        sensed = sensed_finger(robot, 0, tip, task.sensed, task)
        scene = build_scene(
            tip, task.target, task.law, task.start, moved.carrier, moved.fidelity, friction=task.rubbing
        )
        return RobotInScene(
            MujocoBackend(scene, task.period, task.sensor, robot.file.pace.pacer(task.period)),
            sensed.finger,
            moved.lag,
            moved.response,
            moved.stiffness,
            sensed.touch_force,
            following_error_limit=moved.following_error_limit,
            arm=moved.arm,
        )

    def remarks(self, robot: Robot) -> tuple[str, ...]:
        """See `RobotKind`."""
        parts = [simulated_tip(robot, i, its.surface).approximation for i, its in enumerate(robot.file.fingers)]
        return tuple(f"simulated fingertip: {each}" for each in dict.fromkeys(filter(None, parts)))

    def landing_model(self, robot: Robot) -> LandingModel | None:
        """See `RobotKind`: as on a plate."""
        if self.hand is not None and self.tool is None:
            return None
        task = plate_task(robot)
        return self.build(robot, task).landing_model(task.law.stiffness)

    def has_hand(self, robot: Robot) -> bool:
        """See `RobotKind`."""
        return self.hand is not None and self.tool is None

    def described_hand(self, robot: Robot) -> HandDescription:
        """See `RobotKind`."""
        if self.hand is None:
            return super().described_hand(robot)
        self.hand.check_fingers(robot)
        geometry = self.hand.geometry(robot)
        described = [
            Finger(finger.surface.surface(), SensorPayload(tip.mass, tip.center_of_mass))
            for finger, tip in zip(robot.file.fingers, geometry.tips, strict=True)
        ]
        return HandDescription(geometry, tuple(described), robot.file.period, robot.file.limits, robot)

    def hand_backend(self, hand: HandDescription, task: HandTask) -> Backend:
        """See `RobotKind`: its own carrier carries the hand."""
        robot = hand.robot
        assert robot is not None  # it is of this robot
        start = subtract(task.held.pose_base_object.position, task.hand.center)
        moved = self.tip_carrier(robot, task.hand, start)
        scene = replace(task, carrier=moved.carrier).scene(moved.fidelity)
        pacer = robot.file.pace.pacer(task.period)
        return HandBackend(scene, task.period, sensor=task.sensor, pacer=pacer, load=task.load)
