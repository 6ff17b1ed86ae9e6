"""A simulated hand that holds an object with all fingers but the first, which explores it: `exploring_finger`."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import ClassVar

import msgspec
import numpy as np

from palpate.controllers import LandingModel
from palpate.errors import FloatArray, InvalidValueError
from palpate.grasp import GraspContacts, GraspForceOptimizer, SolveStatus
from palpate.kinematics import Pose
from palpate.robots.device_settings import Range, RangedSettings
from palpate.robots.finger_sensor import check_age
from palpate.robots.fingertip import only_finger, start_above
from palpate.robots.hand_kind import HandKind
from palpate.robots.idle import CLEARANCE, plate_task
from palpate.robots.robot import Robot
from palpate.robots.robot_kind import RobotKind
from palpate.robots.simulated_finger import sensed_finger
from palpate.robots.simulated_tip import simulated_tip
from palpate.robots.task import RobotInScene, Task
from palpate.sim import SceneObject, SphereObject
from palpate.sim.fidelity import GRAVITY
from palpate.sim.hand.backend import HandBackend
from palpate.sim.hand.contact import GraspContact
from palpate.sim.hand.exploring_finger import EXPLORING, ExploringFinger, held_pose
from palpate.sim.hand.hand_model import opening_of
from palpate.sim.hand.jointed_hand import JointedHand
from palpate.sim.hand.scene import WORLD, HeldObject, build_grasp_scene
from palpate.sim.objects.target import Mount, as_target
from palpate.sim.objects.traced import TracedObject
from palpate.sim.presets import GRASP
from palpate.spatial import Vector

MARGIN = 1.25
"""Of the grip over the least one: friction is known to some 10 %, and forces overshoot."""


def least_grip(
    points: Sequence[Vector],
    friction: float,
    spin_length: float,
    weight: Vector,
    pushes: Sequence[tuple[Vector, Vector]],
) -> float:
    """Return the largest normal force [N] that any fingertip needs for the worst of some pushes.

    Args:
        points: Where fingertips touch the object, its frame [m]; they press towards their middle.
        friction: Coulomb coefficient.
        spin_length: Largest spin torque over friction and normal force [m].
        weight: Of the object, its frame [N].
        pushes: Forces [N], and where they act [m].

    Raises:
        InvalidValueError: No grip holds one of them.
    """
    contacts = np.array(points)
    frames = [_frame(normal) for normal in contacts.mean(axis=0) - contacts]
    optimizer = GraspForceOptimizer(GraspContacts(contacts, np.array(frames), friction, spin_length))
    worst = 0.0
    for force, at in pushes:
        load = np.array([*np.add(weight, force), *np.cross(at, force)])
        found = optimizer.solve(load)
        if found.status is not SolveStatus.SOLVED:
            raise InvalidValueError(
                f"no grip of these fingers holds a push of {np.round(force, 2).tolist()} N at "
                f"{np.round(at, 4).tolist()} m (object's frame): press less, nearer to the line of the "
                "fingers, or hold with more of them"
            )
        worst = max(worst, float(found.forces[:, 0].max()))
    return worst


def pushes_at(at: Vector, force: float, friction: float) -> list[tuple[Vector, Vector]]:
    """Return what a fingertip may exert that presses down at a point [m] with a force [N] and rubs any way."""
    rubbing = friction * force
    aside = ((0.0, 0.0), (rubbing, 0.0), (-rubbing, 0.0), (0.0, rubbing), (0.0, -rubbing))
    return [((x, y, -force), at) for x, y in aside]


def weight_of(mass: float) -> Vector:
    """Return the weight of an object that hangs below the palm, z of its frame down [N]."""
    return (0.0, 0.0, mass * GRAVITY)


def _frame(along: FloatArray) -> FloatArray:
    """Columns n, t1, t2."""
    n = along / np.linalg.norm(along)
    side = np.eye(3)[int(np.abs(n).argmin())]
    t = np.cross(n, side)
    t /= np.linalg.norm(t)
    return np.column_stack([n, t, np.cross(n, t)]).astype(np.float64)


DOWN = (0.0, 0.0, -1.0)
"""Direction in which it presses, in the object's frame."""


class ExploringFingerEntry(RobotKind, RangedSettings, frozen=True, kw_only=True):
    """A hand in simulation whose palm stands; the object hangs below it, its z away from the palm.

    The first of `fingers` explores; the others hold.

    Attributes:
        hand: With its fingers in the same order.
        grip: Normal force with which each of the others holds [N].
        mass: Of the object [kg].
        time_step: Of the simulation [s]; the control period is a whole number of them.
    """

    TURNS = False
    UNATTENDED = True
    RANGES: ClassVar[tuple[Range, ...]] = (
        ("grip_N", 0.1, 100.0, "N"),
        ("object_mass_kg", 1e-3, 10.0, "kg"),
        ("time_step_s", 1e-6, 0.01, "s"),
    )

    hand: HandKind
    grip: float = msgspec.field(name="grip_N")
    mass: float = msgspec.field(name="object_mass_kg", default=0.2)
    time_step: float = msgspec.field(name="time_step_s", default=0.0005)

    @property
    def measures_force(self) -> bool:
        """See `RobotKind`: by its fingertips' sensors alone."""
        return False

    @property
    def files(self) -> Mapping[str, str]:
        """See `RobotKind`."""
        return self.hand.files

    @property
    def holding(self) -> int:
        """See `RobotKind`."""
        return self.hand.fingers - 1

    def check(self, robot: Robot) -> None:
        """See `RobotKind`."""
        self.landing_model(robot)

    def landing_model(self, robot: Robot) -> LandingModel:
        """See `RobotKind`: on a ball between its fingers."""
        ball, tip = SphereObject(0.5 * opening_of(self._hand(robot), EXPLORING + 1)), only_finger(robot).surface
        task = replace(plate_task(robot), target=ball, start=start_above(tip, ball.top, CLEARANCE))
        return self.build(robot, task).landing_model(task.law.stiffness)

    def build(self, robot: Robot, task: Task) -> RobotInScene:
        """See `RobotKind`."""
        check_age(robot, task.sensor.model, task.period)
        shape, law = _solid(task), task.law
        hand = self._hand(robot)
        tip = simulated_tip(robot, EXPLORING, task.tip)
        pose = held_pose(hand.center_of(range(1, hand.fingers)))
        start = (pose @ Pose(task.start)).position
        hand = replace(hand, tips=(tip, *hand.tips[1:]), bus_period=self.time_step).reaching(EXPLORING, start)
        self._check_grip(hand, pose, shape, task)
        scene = build_grasp_scene(
            hand,
            HeldObject(shape, self.mass, pose),
            GraspContact(law.stiffness, law.friction, law.spin_length),
            palm=(0.0, 0.0, 0.0),
            fidelity=replace(GRASP.fidelity, time_step=self.time_step),
            friction=task.rubbing,
            exploring=law,
            fixture=WORLD,
        )
        closing_time = opening_of(hand, EXPLORING + 1) / hand.closing_speed
        pacer = robot.file.pace.pacer(task.period)
        sensed = sensed_finger(robot, EXPLORING, tip, task.sensed, task)
        holding = (
            sensed_finger(robot, i, hand.tips[i], robot.file.fingers[i].surface.surface(), task)
            for i in range(1, hand.fingers)
        )
        return RobotInScene(
            ExploringFinger(HandBackend(scene, task.period, sensor=task.sensor), self.grip, closing_time, pacer),
            sensed.finger,
            0.0,
            2.0 / hand.bandwidth,
            hand.stiffness(EXPLORING, DOWN),
            sensed.touch_force,
            following_error_limit=hand.following_error,
            holding=tuple(each.finger for each in holding),
        )

    def _hand(self, robot: Robot) -> JointedHand:
        """The hand as its file has it.

        Raises:
            InvalidValueError: It has too few fingers, or not as many as are described, or they only close.
        """
        self.hand.check_fingers(robot)
        fingers = self.hand.fingers
        if fingers < 3:
            raise InvalidValueError(f"fingers: there are {fingers}; must be 3 or more: two hold, one explores")
        hand = self.hand.geometry(robot)
        if not isinstance(hand, JointedHand):
            raise InvalidValueError(
                "backend.hand: its fingers only close; take one whose fingers move, as of kind mjcf"
            )
        return hand

    def _check_grip(self, hand: JointedHand, pose: Pose, shape: SceneObject, task: Task) -> None:
        """Refuse a grip that would let the object slip under the force that is to be felt."""
        back, force = pose.inverse(), 2.0 * task.compression * task.law.stiffness
        points = [_on(shape, (back @ Pose(hand.middle_of(i))).position) for i in range(1, hand.fingers)]
        x, y, _ = task.start
        pushes = [
            push for u, v in ((x, y), (-x, -y)) for push in pushes_at((u, v, shape.top), force, task.law.friction)
        ]
        least = MARGIN * least_grip(points, task.law.friction, task.law.spin_length, weight_of(self.mass), pushes)
        if self.grip < least:
            raise InvalidValueError(
                f"backend.grip_N = {self.grip:g}: must be at least {least:.3g} for an object of {self.mass:g} kg "
                f"pressed with {force:g} N ({MARGIN:g} times what friction {task.law.friction:g} needs); grip "
                "harder, or explore with less force"
            )


def _solid(task: Task) -> SceneObject:
    """What is to be held.

    Raises:
        InvalidValueError: It stands in a scene of its own, or is not convex.
    """
    target = as_target(task.target)
    hollow = float(target.shape.signed_distance(np.zeros((1, 3)))[0]) >= 0.0
    if hollow or target.mount is not Mount.FIXED or any(target.position) or isinstance(target.shape, TracedObject):
        raise InvalidValueError(
            "object: fingers hold a single solid; take a sphere, an ellipsoid, a box or a cylinder"
        )
    return target.shape


def _on(shape: SceneObject, point: Vector) -> Vector:
    """Where a fingertip that closes towards the origin touches a shape [m]: bisection along its line."""
    inside, outside = 0.0, 1.0
    x, y, z = point
    for _ in range(50):
        s = 0.5 * (inside + outside)
        if float(shape.signed_distance(np.array([[s * x, s * y, s * z]]))[0]) > 0.0:
            outside = s
        else:
            inside = s
    return (inside * x, inside * y, inside * z)
