"""A tool that a simulated hand holds, and explores with: `backend.tool`."""

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, ClassVar

import msgspec
import numpy as np

from palpate.errors import InvalidValueError
from palpate.kinematics import Pose
from palpate.robots.device_settings import DeviceSettings, Range
from palpate.robots.finger_load import payload_of
from palpate.robots.finger_sensor import check_age, model_of_finger, noise_of
from palpate.robots.hand_kind import HandKind
from palpate.robots.robot import Robot
from palpate.robots.simulated_finger import sensed_finger
from palpate.robots.simulated_tip import simulated_tip
from palpate.robots.task import RobotInScene, Task
from palpate.runtime.held_tool_finger import HeldToolFinger
from palpate.runtime.supervision.guard import Guard
from palpate.runtime.supervision.tool_slip import ToolGrip, ToolHeld
from palpate.sim import SeededSensor
from palpate.sim.hand.contact import GraspContact
from palpate.sim.hand.held_tool import Holding
from palpate.sim.hand.jointed_hand import JointedHand
from palpate.sim.hand.scene import HeldObject
from palpate.sim.hand.tool_shape import ToolShape
from palpate.sim.hand.touched import Touched
from palpate.sim.objects.target import StaticObject, as_target
from palpate.sim.sensor.model import SensorModel
from palpate.spatial import Vector, as_vector, norm, subtract

if TYPE_CHECKING:
    from palpate.robots.simulated_kind import TipCarrier

IMPRATIO = 1e7
"""Of a tool's contacts: ten times that of grasps, as it creeps on a lever. A pin of 80 mm and 8 g between flat
pads gives way to 0.6 N across its end by 25 um, and creeps by 0.6 um/s there; with 1e6 by 6 um/s."""


MOST_LOAD = 0.6
"""Of what friction and squeeze hold across the fingers: a tool slips unseen only where friction is 0.6 times as
large as believed, or less, and nothing moves along the normal of what it touches."""

LEAST_SQUEEZE = 0.5
"""Of the grip that is commanded: what lateral forces take from one finger they give to another."""

SURE = 3.0
"""Standard deviations of the force's noise, on the lever of the tool, that lie within the tip at a touch."""

OVERSHOOT = 2.0
"""Times the set force, which the squeeze is to hold."""

LEAST_NOISE = 0.9
"""Of the noise that sensors sum up to: a number that people rounded."""

SPANNED = 0.1
"""Singular value of closing directions from which on they span one more: 6 degrees between two fingers."""

LEAST_SHARE = 0.25
"""Of the set force, from which on where the tool touches is looked at for slip."""


class HeldToolEntry(DeviceSettings, frozen=True, kw_only=True):
    """How a hand holds a tool: the first of `fingers` is its surface, in the middle of the fingertips.

    Attributes:
        grip: Normal force with which the fingers hold it [N].
        friction: Between fingertips and tool.
        spin_length: Of that friction [m].
        stiffness: Of each point of contact between them [N/m].
    """

    RANGES: ClassVar[tuple[Range, ...]] = (
        ("grip_N", 0.1, 100.0, "N"),
        ("friction_coefficient", 0.01, 5.0, ""),
        ("spin_length_m", 1e-5, 0.1, "m"),
        ("stiffness_N_per_m", 100.0, 1e6, "N/m"),
    )

    grip: float = msgspec.field(name="grip_N")
    friction: float = msgspec.field(name="friction_coefficient", default=0.8)
    spin_length: float = msgspec.field(name="spin_length_m", default=0.004)
    stiffness: float = msgspec.field(name="stiffness_N_per_m", default=20e3)

    def build(
        self,
        robot: Robot,
        task: Task,
        hand: HandKind,
        carrier: "Callable[[JointedHand, Vector], TipCarrier]",
    ) -> RobotInScene:
        """Return a robot that holds the tool over what is to be touched; see `RobotKind.build`.

        Args:
            robot: Whose tool it is.
            task: What to touch.
            hand: That holds it.
            carrier: From the hand, and where its frame starts, to what carries it.

        Raises:
            InvalidValueError: It cannot be built as its file specifies, or cannot do the task.
        """
        holding = fingers_of(robot)
        geometry = hand_of(holding, hand)
        tool = simulated_tip(robot, 0, task.tip)
        moved = carrier(geometry, subtract(task.start, geometry.center))
        if task.tip != robot.file.fingers[0].surface:
            raise InvalidValueError(
                "tip: what the hand holds is as large as the robot file says; change it there (fingers[0])"
            )
        if task.rubbing is not None:
            raise InvalidValueError(
                "a law of friction of its own is simulated for fingertips, not for held tools; take Coulomb's"
            )
        target = as_target(task.target)
        if not isinstance(target, StaticObject):
            raise InvalidValueError(
                f"object: a held tool touches a single fixed surface in simulation, not a {type(target).__name__}"
            )
        models = [model_of_finger(finger) for finger in holding.file.fingers]
        sensors = [SeededSensor(model, task.sensor.seed + i) for i, model in enumerate(models)]
        self._check(geometry, task, models)
        sensed = [
            sensed_finger(holding, i, geometry.tips[i], finger.surface.surface(), replace(task, sensor=sensors[i]))
            for i, finger in enumerate(holding.file.fingers)
        ]
        for each in sensors:
            check_age(robot, each.model, task.period)
        felt = tuple(each.finger for each in sensed)
        reach = norm(task.tip.center) + max(task.tip.half_extents)
        placed = SURE * reach * noise_of(task.sensor.model)[0] / min(task.tip.half_extents)
        touch_force = max(placed, *(each.touch_force for each in sensed))
        payload = payload_of(robot, 0)
        finger = HeldToolFinger(
            task.sensed, payload, felt, touch_force, 0.5 * touch_force, task.sensor.model.dithering
        )
        sticking = GraspContact(self.stiffness, self.friction, self.spin_length, impratio=IMPRATIO)
        backend = Holding(geometry, felt, sticking, self.grip).over(
            Touched(target.shape, task.law),
            HeldObject(ToolShape(tool), tool.mass, Pose(task.start)),
            carrier=moved.carrier,
            fidelity=moved.fidelity,
            payload=payload,
            period=task.period,
            sensor=sensors,
            end=task.tip.center,
            pacer=robot.file.pace.pacer(task.period),
        )
        grip = ToolGrip(
            self.friction,
            MOST_LOAD,
            LEAST_SQUEEZE * geometry.fingers * self.grip,
            max(task.touch_force, LEAST_SHARE * 2.0 * task.compression * task.law.stiffness),
            1.0 / task.law.stiffness + 1.0 / self.stiffness,
            _across(geometry),
        )
        return RobotInScene(
            backend,
            finger,
            moved.lag,
            moved.response,
            moved.stiffness,
            touch_force,
            following_error_limit=moved.following_error_limit,
            holding=felt,
            arm=moved.arm,
            guards=lambda: (Guard(ToolHeld(grip, task.period)),),
        )

    def _check(self, hand: JointedHand, task: Task, sensors: Sequence[SensorModel]) -> None:
        """Refuse a squeeze that is too weak for the set force, and noise that is stated to be less than it is."""
        force = OVERSHOOT * 2.0 * task.compression * task.law.stiffness
        least = force / (MOST_LOAD * self.friction * hand.fingers)
        if self.grip < least:
            raise InvalidValueError(
                f"backend.tool.grip_N = {self.grip:g}: must be at least {least:.3g} for forces of up to {force:g} "
                f"N, {100.0 * MOST_LOAD:g} % of what friction {self.friction:g} holds in {hand.fingers} fingers; "
                "grip harder, or press with less force"
            )
        summed, stated = math.hypot(*(noise_of(each)[0] for each in sensors)), noise_of(task.sensor.model)[0]
        if stated < LEAST_NOISE * summed:
            raise InvalidValueError(
                f"fingers[0].noise.force_N = {stated:g} (--force-noise): is that of the fingers' sensors "
                f"together, {summed:.3g}; write that"
            )


def _across(hand: JointedHand) -> tuple[Vector, ...]:
    """Directions that are square to all in which its fingers close: friction alone bears there."""
    closing = np.array([hand.closing_axes(i)[0] for i in range(hand.fingers)])
    _, sizes, directions = np.linalg.svd(closing)
    spanned = int(np.sum(sizes > SPANNED))
    return tuple(as_vector(each) for each in directions[spanned:])


def fingers_of(robot: Robot) -> Robot:
    """Return the robot with the fingers alone that hold the tool."""
    file = msgspec.structs.replace(robot.file, fingers=robot.file.fingers[1:])
    return replace(robot, file=file, sensors=robot.sensors[1:])


def hand_of(holding: Robot, hand: HandKind) -> JointedHand:
    """Return the hand that holds a tool.

    Raises:
        InvalidValueError: It has too few fingers, or not as many as are described, or they only close.
    """
    hand.check_fingers(holding)
    if hand.fingers < 2:
        raise InvalidValueError("backend.hand: it has one finger; at least two hold a tool")
    geometry = hand.geometry(holding)
    if not isinstance(geometry, JointedHand):
        raise InvalidValueError(
            "backend.hand: its fingers only close, and one must stand still against the others; take one whose "
            "fingers move, as of kind mjcf"
        )
    return geometry
