"""A stage that also turns: three slides and a ball joint about the origin of what it carries.

Why a ball, and not three hinges: hinges in series lock where the first and the last are in line, whatever their
order, and near that they wind up; a ball has every orientation alike, with the same stiffness and damping about
every axis, and no end. Its servo goes by the turn between the ball and a reference frame, a body without mass
that follows the wanted orientation: not by coordinates of the joint, which would wind up too (at half a turn).
"""

from dataclasses import dataclass, field

import mujoco
import numpy as np

from palpate.errors import InvalidValueError, check_positive
from palpate.kinematics import FollowingErrorLimit
from palpate.sim.carriers.carriage import add_position_servo, add_turning_sensors, lift_load
from palpate.sim.carriers.carrier import CarriedMass
from palpate.sim.carriers.stage import Stage
from palpate.sim.carriers.turning_stage_drive import HEAD, REFERENCE, TurningStageDrive
from palpate.spatial import Vector

_HEAD_SHARE = 0.1
"""Of the moving mass, which turns; its centre is the ball's, so that the slides feel no difference."""


@dataclass(frozen=True, slots=True)
class TurningStage:
    """Three slides and a ball, critically damped position servos on all, weight balanced. A `Carrier`.

    Velocity and angular velocity are integrated into the servos' references: position, and orientation as a unit
    quaternion. Following a steady motion, both lag by `lag`, whatever the load.

    The servos, w the bandwidth: (mass + load) (w^2 (reference - x) - 2 w x'), and about the ball's centre
    inertia (w^2 turn - 2 w omega), turn being axis times angle from head to reference. In a time step h, stiffness
    taken at its beginning and damping at its end (implicitfast), w h < 2 + 2 sqrt(2) = 4.8 is stable (Jury); 0.05
    to 0.1 as usual leaves a factor of 50 to 100. The load's inertia about the ball makes the head slower and less
    damped, both by sqrt(inertia / (inertia + load)), 0.7 at worst: more than `inertia` is refused.

    Attributes:
        mass: Moving mass without load [kg].
        bandwidth: Natural frequency of the servos [rad/s].
        following_error_limit: Largest distances of the references from where it is (anti-windup): bound the force
        with which it
            pushes to (mass + load) w^2 following-error limit.distance, and its torque to inertia w^2
            following-error limit.angle; speeds to following-error limit * bandwidth / 2.
        inertia: Of what turns, without load, about every axis [kg m^2].
    """

    mass: float = 5.0
    bandwidth: float = 100.0
    following_error_limit: FollowingErrorLimit = field(default_factory=lambda: FollowingErrorLimit(0.0025, 0.06))
    inertia: float = 0.01

    def __post_init__(self) -> None:
        check_positive(self, mass="kg", bandwidth="rad/s", inertia="kg m^2")

    @property
    def lag(self) -> float:
        """2 / bandwidth [s]: how far it runs behind a steady motion, in position and in angle."""
        return self._slides.lag

    def stiffness(self, load_mass: float) -> float:
        """Stiffness of the slides' servos [N/m]."""
        return self._slides.stiffness(load_mass)

    @property
    def turning_stiffness(self) -> float:
        """Stiffness of the ball's servo [N m/rad]."""
        return self.inertia * self.bandwidth**2

    @property
    def _slides(self) -> Stage:
        return Stage(self.mass, self.bandwidth, self.following_error_limit.distance)

    def mount(self, spec: mujoco.MjSpec, load: CarriedMass, start: Vector) -> mujoco.MjsBody:
        """See `Carrier`."""
        carriage = self._slides.add_to(spec, start, load.mass)
        own = (1.0 - _HEAD_SHARE) * self.mass
        carriage.mass = own
        carriage.gravcomp = self.mass / own  # the head, too, at whose centre nothing turns; not the load
        head = carriage.add_body(name=HEAD)
        head.explicitinertial = True
        head.mass = _HEAD_SHARE * self.mass
        head.inertia = [self.inertia] * 3
        head.add_joint(name=HEAD, type=mujoco.mjtJoint.mjJNT_BALL)
        head.add_site(name=HEAD)
        reference = spec.worldbody.add_body(name=REFERENCE, pos=start, mocap=True)
        reference.add_site(name=REFERENCE)
        for i, axis in enumerate("xyz"):
            _add_turning_servo(
                spec, f"turn_{axis}", i, self.turning_stiffness, 2.0 * self.inertia * self.bandwidth
            )
        flange = head.add_body(name="flange")
        lift_load(flange, load)
        return flange

    def add_sensors(self, spec: mujoco.MjSpec) -> None:
        """Add the head's axes and its turning, as its drive reads them."""
        add_turning_sensors(spec, HEAD)

    def drive(self, model: mujoco.MjModel, data: mujoco.MjData, period: float) -> TurningStageDrive:
        """See `Carrier`.

        Raises:
            InvalidValueError: The load has too much inertia for this head.
        """
        load = _inertia_about_ball(model) - self.inertia
        if load > self.inertia:
            raise InvalidValueError(
                f"the load has an inertia of {load:.3g} kg m^2 about the origin of its frame: must be at most "
                f"that of the stage's head, inertia = {self.inertia:g} kg m^2; give the stage more"
            )
        return TurningStageDrive(self.following_error_limit, model, data)


def _add_turning_servo(spec: mujoco.MjSpec, name: str, axis: int, stiffness: float, damping: float) -> None:
    """Add an actuator about one axis of the reference frame: -stiffness turn - damping omega, turn from there."""
    add_position_servo(spec, name, stiffness, damping)
    servo = spec.actuators[-1]
    servo.trntype = mujoco.mjtTrn.mjTRN_SITE
    servo.target, servo.refsite = HEAD, REFERENCE
    servo.gear = [float(i == 3 + axis) for i in range(6)]


def _inertia_about_ball(model: mujoco.MjModel) -> float:
    """Largest moment of inertia of all that turns with the head, at the start [kg m^2]."""
    data, M = mujoco.MjData(model), np.zeros((model.nv, model.nv))
    mujoco.mj_forward(model, data)
    mujoco.mj_fullM(model, data, M)
    first = int(model.joint(HEAD).dofadr[0])
    return float(np.linalg.eigvalsh(M[first : first + 3, first : first + 3])[-1])
