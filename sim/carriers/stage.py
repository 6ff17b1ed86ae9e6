"""A three-axis stage: the cheapest machine that can carry a fingertip anywhere."""

from dataclasses import dataclass

import mujoco
import numpy as np
import numpy.typing as npt

from palpate.errors import FloatArray, check_positive
from palpate.sim.carriers.carriage import add_carriage, add_position_servo
from palpate.sim.carriers.carrier import CarriedMass
from palpate.sim.carriers.stage_drive import StageDrive
from palpate.spatial import Vector

AXES: tuple[tuple[str, Vector], ...] = (("x", (1.0, 0.0, 0.0)), ("y", (0.0, 1.0, 0.0)), ("z", (0.0, 0.0, 1.0)))


@dataclass(frozen=True, slots=True)
class Stage:
    """Three slides driven by critically damped position servos, with their own weight balanced.

    A velocity command is integrated into the servos' reference. Following a ramp, the stage lags by `lag`.

    Attributes:
        mass: Moving mass without the tip [kg].
        bandwidth: Natural frequency of the servos [rad/s].
        following_error_limit: Largest distance of the reference from the actual position [m]: bounds the force
        with which the
            stage pushes against an obstacle (anti-windup), and its speed to following-error limit * bandwidth / 2.
    """

    mass: float = 5.0
    bandwidth: float = 100.0
    following_error_limit: float = 0.0025

    def __post_init__(self) -> None:
        check_positive(self, mass="kg", bandwidth="rad/s", following_error_limit="m")

    @property
    def lag(self) -> float:
        """2 / bandwidth [s]: how far a critically damped servo runs behind a ramp."""
        return 2.0 / self.bandwidth

    def stiffness(self, tip_mass: float) -> float:
        """Stiffness of the servos [N/m]."""
        return (self.mass + tip_mass) * self.bandwidth**2

    def mount(self, spec: mujoco.MjSpec, load: CarriedMass, start: Vector) -> mujoco.MjsBody:
        """See `palpate.sim.carriers.carrier.Carrier`."""
        return self.add_to(spec, start, load.mass)

    def add_sensors(self, spec: mujoco.MjSpec) -> None:
        """It needs none: it does not turn."""

    def drive(self, model: mujoco.MjModel, data: mujoco.MjData, period: float) -> StageDrive:
        """See `palpate.sim.carriers.carrier.Carrier`."""
        return StageDrive(self.following_error_limit, model, data)

    def references(self, velocity: FloatArray, steps: int, time_step: float) -> FloatArray:
        """See `palpate.sim.open_loop.OpenLoopCarrier`; added up one after the other, as `StageDrive` does."""
        return np.cumsum(np.repeat(time_step * velocity, steps, axis=0), axis=0)

    def keeps_up(self, reference: FloatArray, position: FloatArray) -> npt.NDArray[np.bool_]:
        """See `palpate.sim.open_loop.OpenLoopCarrier`."""
        return np.asarray(np.linalg.norm(reference - position, axis=-1) < self.following_error_limit)

    def add_to(self, spec: mujoco.MjSpec, start: Vector, tip_mass: float) -> mujoco.MjsBody:
        """Add slides and servos to a scene; returns the moving body, at `start` [m] when all slides are at 0."""
        body = add_carriage(spec, "stage", start, self.mass, tip_mass)
        stiffness = self.stiffness(tip_mass)
        damping = 2.0 * (self.mass + tip_mass) * self.bandwidth
        for name, axis in AXES:
            body.add_joint(name=name, type=mujoco.mjtJoint.mjJNT_SLIDE, axis=axis)
            add_position_servo(spec, name, stiffness, damping)
        return body
