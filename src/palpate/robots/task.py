"""What a robot with one fingertip is to touch, and the robot that stands ready to do so."""

import math
from collections.abc import Callable
from dataclasses import dataclass

from palpate.controllers import LandingModel, series_stiffness, tracking_delay
from palpate.controllers.landing import moved_mass
from palpate.kinematics import StandingArm
from palpate.robots.surface_entries import SurfaceKind
from palpate.runtime import Backend, FingerDescription
from palpate.runtime.servo_following import PositionServo
from palpate.runtime.supervision.guard import Guard
from palpate.sensing.solver import Surface
from palpate.sim import ContactLaw, SceneObject, SeededSensor, Target
from palpate.sim.friction.law import FrictionLaw
from palpate.spatial import Vector
from palpate.surfaces.parallel import yielding


@dataclass(frozen=True, slots=True, eq=False)
class Task:
    """What a robot is to touch, and how it is sensed.

    Attributes:
        tip: The fingertip, in the sensor frame.
        compression: How far the tip yields at the set force [m].
        target: What is touched.
        law: Contact between the two.
        start: Where the tip frame starts, base frame [m].
        period: Control period [s].
        sensor: Behind the tip.
        touch_force: Force that counts as a touch on a sensor of which nothing is known [N].
        rubbing: How the friction plant rubs; None: MuJoCo rubs.
        believed: What touch takes the fingertip for; None: for what it is.
    """

    tip: SurfaceKind
    compression: float
    target: SceneObject | Target
    law: ContactLaw
    start: Vector
    period: float
    sensor: SeededSensor
    touch_force: float
    rubbing: FrictionLaw | None = None
    believed: SurfaceKind | None = None

    @property
    def sensed(self) -> Surface:
        """The fingertip that contacts are sensed on: it takes half of the contact's compression."""
        tip = self.tip if self.believed is None else self.believed
        return yielding(tip.surface(), self.compression, 2.0 * self.law.stiffness)


@dataclass(frozen=True, slots=True, eq=False)
class RobotInScene:
    """A robot that stands ready.

    Attributes:
        backend: The robot.
        finger: For touch.
        lag: How far it runs behind a ramp [s].
        response: Delay that stands for its servos in force control [s].
        stiffness: With which it holds its tip [N/m].
        touch_force: Force that counts as a touch [N].
        angular_acceleration: With which it can begin to turn [rad/s^2].
        following_error_limit: By which its reference may lead the tip [m]; inf: its own controller bounds that.
        holding: Fingers that hold what the finger explores, or the tool that it is, for touch.
        arm: Its joints; None: it has none that palpate moves.
        guards: Returns fresh ones for a supervisor, besides those that every run has.
    """

    backend: Backend
    finger: FingerDescription
    lag: float
    response: float
    stiffness: float
    touch_force: float
    angular_acceleration: float = math.inf
    following_error_limit: float = math.inf
    holding: tuple[FingerDescription, ...] = ()
    arm: StandingArm | None = None
    guards: Callable[[], tuple[Guard, ...]] = tuple

    @property
    def fingers(self) -> tuple[FingerDescription, ...]:
        """For touch: the one that explores, then those that hold."""
        return (self.finger, *self.holding)

    def landing_model(self, contact_stiffness: float) -> LandingModel:
        """Return how hard it presses on a contact of this stiffness [N/m]."""
        return LandingModel(
            series_stiffness(contact_stiffness, self.stiffness),
            tracking_delay(self.backend.period, self.response, self.finger.pipeline().delay),
            contact_stiffness,
            moved_mass(self.stiffness, self.response),
        )

    @property
    def servo(self) -> PositionServo:
        """How it follows commands and gives way."""
        return PositionServo(self.stiffness, self.response, self.lag)
