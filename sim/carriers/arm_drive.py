"""From a wanted twist of the tip to the servo references of a simulated arm, time step by time step."""

import mujoco
import numpy as np

from palpate.kinematics import UR5E, InverseVelocity, JointMotion, Pose, TipReference
from palpate.sim.carriers.ur5e import JOINTS, Ur5e
from palpate.sim.physics import whole_steps
from palpate.spatial import Vector

SERVO_SPEED = 0.95
"""Of a joint's speed limit, to which its position error may drive it: the rest is for what joints do to one
another when all of them are wrenched about (2 % were seen)."""


class ArmDrive:
    """Drives a `Ur5e` in a compiled scene. Once per control period `begin`, then `advance` before each time step.

    As in a real servo's cascade, the speed that the position error asks for ends at `SERVO_SPEED` of the joint's
    limit.

    Attributes:
        reference: Where tip and joints shall be.
    """

    def __init__(self, arm: Ur5e, model: mujoco.MjModel, data: mujoco.MjData, period: float) -> None:
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
        self.reference = TipReference(InverseVelocity(arm.kinematics), period, arm.following_error_limit)
        self._lead = arm.lead
        # the servo k (u - q) - k lead q' drives a joint to the speed (u - q) / lead, with a first-order lag
        self._reach = tuple(SERVO_SPEED * arm.lead * limits.speed for limits in UR5E.limits)
        # views that live as long as the data
        first = int(model.joint(JOINTS[0]).qposadr[0])
        self._position = data.qpos[first : first + len(JOINTS)]
        first = int(model.actuator(JOINTS[0]).id)
        self._control = data.ctrl[first : first + len(JOINTS)]
        self._ramp = np.zeros(len(JOINTS))

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
        """
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
        n, reference = len(JOINTS), self.reference
        reference.joint_reference, reference.joint_feed_forward = state[:n], state[n : 2 * n]
        x, y, z, *entries = state[2 * n : 2 * n + 12]
        a, b, c, d, e, f, g, h, i = entries
        reference.pose_base_tip = Pose((x, y, z), ((a, b, c), (d, e, f), (g, h, i)))
        self._ramp[:] = state[-2 * n : -n]
        self._control[:] = state[-n:]
