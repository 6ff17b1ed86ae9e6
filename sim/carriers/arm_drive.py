"""From a wanted twist of the tip to the servo references of a simulated arm, time step by time step."""

import mujoco
import numpy as np

from palpate.kinematics import InverseVelocity, JointMotion, Pose, TipReference
from palpate.sim.carriers.carrier import refuse_to_turn
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
        self._lead, self._turns = arm.lead, inverse.turns
        # the servo k (u - q) - k lead q' drives a joint to the speed (u - q) / lead, with a first-order lag
        self._reach = tuple(SERVO_SPEED * arm.lead * limits.speed for limits in arm.model.arm.limits)
        # views that live as long as the data
        self._position = data.qpos[first : first + n]
        first = int(model.actuator(arm.joints[0]).id)
        self._control = data.ctrl[first : first + n]
        self._ramp = np.zeros(n)

    @property
    def steps(self) -> int:
        """Time steps in a control period."""
        return self._steps

    def start(self) -> None:
        """Hold the arm where it is."""
        self.reference.start(self._position)
        self._ramp[:] = 0.0
        self._control[:] = self._position

    def begin(self, velocity: Vector, angular_velocity: Vector) -> JointMotion:
        """Begin a control period, and return how the joints are to move in it.

        Args:
            velocity: Wanted, of the tip frame's origin in base coordinates [m/s].
            angular_velocity: Likewise, of the tip frame [rad/s].

        Raises:
            InvalidValueError: It is to turn its tip, and has too few joints for that.
        """
        if not self._turns:
            refuse_to_turn(angular_velocity, f"arm of {len(self._ramp)} joints")
        reference, lead, steps = self.reference, self._lead, self._steps
        actual, before = self._position.tolist(), reference.joint_reference
        motion = reference.step(actual, velocity, angular_velocity)
        first: list[float] = []
        ramp: list[float] = []
        for q, a, b, rate, reach in zip(
            actual, before, reference.joint_reference, reference.joint_feed_forward, self._reach, strict=True
        ):
            # what lies farther would make the joint faster than it may be
            start = min(max(a + lead * rate, q - reach), q + reach)
            end = min(max(b + lead * rate, q - reach), q + reach)
            first.append(start)
            # a ramp, not stairs, whose ripple would break friction
            ramp.append((end - start) / steps)
        self._control[:], self._ramp[:] = first, ramp
        return motion

    def advance(self) -> None:
        """Move the servos' references by one time step; `mj_step` comes next."""
        self._control += self._ramp

    def snapshot(self) -> tuple[float, ...]:
        """Return all that it remembers from period to period, in plain numbers."""
        reference = self.reference
        rows = reference.pose_base_tip.rotation
        return (
            *reference.joint_reference,
            *reference.joint_feed_forward,
            *reference.pose_base_tip.position,
            *rows[0],
            *rows[1],
            *rows[2],
            *self._ramp.tolist(),
            *self._control.tolist(),
        )

    def restore(self, state: tuple[float, ...]) -> None:
        """Go on from what `snapshot` returned."""
        n, reference = len(self._ramp), self.reference
        reference.joint_reference, reference.joint_feed_forward = state[:n], state[n : 2 * n]
        x, y, z, *entries = state[2 * n : 2 * n + 12]
        a, b, c, d, e, f, g, h, i = entries
        reference.pose_base_tip = Pose((x, y, z), ((a, b, c), (d, e, f), (g, h, i)))
        self._ramp[:] = state[-2 * n : -n]
        self._control[:] = state[-n:]
