"""From a wanted twist of the tip to the servo references of a simulated arm, time step by time step."""

import mujoco
import numpy as np

from palpate.compiling import machine_code
from palpate.kinematics import InverseVelocity, TipReference
from palpate.sim.carriers.carrier import refuse_to_turn
from palpate.sim.carriers.servo_ramp import ramp_servos
from palpate.sim.carriers.servoed_arm import ServoedArm
from palpate.sim.physics import whole_steps
from palpate.spatial import Vector

SERVO_SPEED = 0.95
"""Of a joint's speed limit, to which its position error may drive it: the rest is for what joints do to one
another when all of them are wrenched about (2 % were seen)."""


class ArmDrive:
    """Drives a `ServoedArm` in a scene: once per control period `begin`, and before each time step `advance`.

    As in a real servo's cascade, the speed that the position error asks for ends at `SERVO_SPEED` of the joint's
    limit.

    Attributes:
        reference: Where tip and joints shall be.
    """

    def __init__(self, arm: ServoedArm, model: mujoco.MjModel, data: mujoco.MjData, period: float) -> None:
        """Take an arm in a scene; `start` comes before the first period.

        Args:
            arm: As it was added to the scene.
            model: The compiled scene.
            data: Its state, which must live on.
            period: Of control [s], a whole number of the model's time steps.

        Raises:
            InvalidValueError: The period is no whole number of time steps, or too long for `TipReference`.
        """
        self._dt = float(model.opt.timestep)
        self._steps = whole_steps("period", period, self._dt)
        n = len(arm.joints)
        first = int(model.joint(arm.joints[0]).qposadr[0])
        # joints that the tip leaves free stay near where they start
        inverse = InverseVelocity(arm.kinematics, home=tuple(model.qpos0[first : first + n].tolist()))
        self.reference = TipReference(inverse, period, arm.following_error_limit)
        self._turns = inverse.turns
        # the servo k (u - q) - k lead q' drives a joint to the speed (u - q) / lead, with a first-order lag
        reach = np.array([SERVO_SPEED * arm.lead * limits.speed for limits in arm.model.arm.limits])
        # views that live as long as the data
        self._position = data.qpos[first : first + n]
        first = int(model.actuator(arm.joints[0]).id)
        self._control = data.ctrl[first : first + n]
        self._ramp, self._before = np.zeros(n), np.zeros(n)
        self._references = self.reference.state[:n]
        self._ramped = (
            self._position,
            self._before,
            self.reference.state,
            float(arm.lead),
            reach,
            self._steps,
            self._control,
            self._ramp,
        )
        self._ramps = machine_code(ramp_servos, *self._ramped)

    @property
    def steps(self) -> int:
        """Time steps in a control period."""
        return self._steps

    def start(self) -> None:
        """Hold the arm where it is."""
        self.reference.start(self._position)
        self._ramp[:] = 0.0
        self._control[:] = self._position

    def begin(self, velocity: Vector, angular_velocity: Vector) -> None:
        """Begin a control period.

        Args:
            velocity: Wanted, of the tip frame's origin in base coordinates [m/s].
            angular_velocity: Likewise, of the tip frame [rad/s].

        Raises:
            InvalidValueError: It is to turn its tip, and has too few joints for that.
        """
        if not self._turns:
            refuse_to_turn(angular_velocity, f"arm of {len(self._ramp)} joints")
        self._before[:] = self._references
        self.reference.step(self._position, velocity, angular_velocity)
        self._ramps(*self._ramped)

    def advance(self) -> None:
        """Move the servos' references by one time step; `mj_step` comes next."""
        self._control += self._ramp

    def snapshot(self) -> tuple[float, ...]:
        """Return all that it remembers from period to period, in plain numbers."""
        return (*self.reference.state.tolist(), *self._ramp.tolist(), *self._control.tolist())

    def restore(self, state: tuple[float, ...]) -> None:
        """Go on from what `snapshot` returned."""
        n = len(self._ramp)
        self.reference.state[:] = state[: -2 * n]
        self._ramp[:] = state[-2 * n : -n]
        self._control[:] = state[-n:]
