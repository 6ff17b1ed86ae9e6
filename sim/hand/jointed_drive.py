"""Torque-controlled fingers in a compiled scene: grip forces and tip velocities to joint torques."""

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import mujoco
import numpy as np

from palpate.errors import FloatArray, InvalidValueError
from palpate.kinematics.kernel import tip_frame, tip_jacobian
from palpate.runtime.data import HandSample
from palpate.sim.hand.operational_space import finger_torque
from palpate.sim.physics import whole_steps
from palpate.spatial import ZERO, Vector

if TYPE_CHECKING:
    from palpate.sim.hand.jointed_hand import JointedHand


@dataclass(frozen=True, slots=True)
class JointedState:
    """All that a `JointedDrive` remembers, opaque."""

    forces: tuple[float, ...]
    velocities: tuple[Vector | None, ...]
    references: tuple[tuple[float, ...], ...]
    homing: tuple[tuple[float, ...], ...]
    countdown: int
    sample: HandSample
    positions: tuple[float, ...]


class JointedDrive:
    """Motors of a `JointedHand`. A `HandDrive`."""

    def __init__(self, hand: "JointedHand", model: mujoco.MjModel, data: mujoco.MjData) -> None:
        """Take a hand in a scene.

        Args:
            hand: As it was added to the scene.
            model: The compiled scene.
            data: Its state, which must live on.

        Raises:
            InvalidValueError: The bus period is not a whole number of time steps.
        """
        self._hand, self._model, self._data = hand, model, data
        self._dt = float(model.opt.timestep)
        self._bus_steps = whole_steps("bus_period", hand.bus_period, self._dt)
        self._fingers = [_Finger(hand, i, model) for i in range(hand.fingers)]
        self._inertia, self._bias = np.zeros((model.nv, model.nv)), np.zeros(model.nv)
        self.start()

    def start(self) -> None:
        """See `HandDrive`."""
        n = len(self._fingers)
        self._forces: tuple[float, ...] = (0.0,) * n
        self._velocities: tuple[Vector | None, ...] = (None,) * n
        for finger in self._fingers:
            finger.restart(self._data)
        self._countdown = 0
        self._positions = self._where()
        self.sample = HandSample(self._data.time, self._positions)

    def command(self, forces: tuple[float, ...]) -> None:
        """See `HandDrive`."""
        self._check("grip_force", forces)
        for force in forces:
            if not 0.0 <= force < math.inf:
                raise InvalidValueError(f"grip_force = {forces} N: must be finite, 0 or above; 0 opens the hand")
        self._take(forces, self._velocities)

    def move(self, velocities: tuple[Vector | None, ...] | None) -> None:
        """See `HandDrive`."""
        given = (None,) * len(self._fingers) if velocities is None else velocities
        self._check("finger_velocity", given)
        if not all(math.isfinite(sum(velocity)) for velocity in given if velocity is not None):
            raise InvalidValueError(f"finger_velocity = {given} m/s: must be finite")
        self._take(self._forces, given)

    def advance(self) -> None:
        """See `HandDrive`."""
        model, data = self._model, self._data
        self._positions = self._where()
        if self._countdown == 0:
            self.sample = HandSample(data.time, self._positions)
            self._countdown = self._bus_steps
        self._countdown -= 1
        # of this very state: MuJoCo's own are of the one before the last time step
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        mujoco.mj_makeM(model, data)
        mujoco.mj_fullM(model, data, self._inertia)
        mujoco.mj_comVel(model, data)
        mujoco.mj_rne(model, data, 0, self._bias)
        for finger, force, velocity in zip(self._fingers, self._forces, self._velocities, strict=True):
            finger.drive(data, self._inertia, self._bias, force, velocity, self._dt)

    def last(self) -> tuple[tuple[float, ...], tuple[float, ...]]:
        """See `HandDrive`."""
        return self._positions, (0.0,) * len(self._fingers)

    def state(self) -> JointedState:
        """See `HandDrive`."""
        references, homing = zip(*(finger.state() for finger in self._fingers), strict=True)
        return JointedState(
            self._forces, self._velocities, references, homing, self._countdown, self.sample, self._positions
        )

    def set_state(self, state: JointedState) -> None:
        """See `HandDrive`."""
        for finger, reference, homing in zip(self._fingers, state.references, state.homing, strict=True):
            finger.set_state(reference, homing)
        self._forces, self._velocities = state.forces, state.velocities
        self._countdown, self.sample, self._positions = state.countdown, state.sample, state.positions

    def _take(self, forces: tuple[float, ...], velocities: tuple[Vector | None, ...]) -> None:
        """Go on from where a finger is, if it is to do something of another kind."""
        before = zip(self._forces, self._velocities, strict=True)
        for finger, old, new in zip(self._fingers, before, zip(forces, velocities, strict=True), strict=True):
            if _kind(*old) != _kind(*new):
                finger.restart(self._data)
        self._forces, self._velocities = forces, velocities

    def _check(self, name: str, given: tuple[object, ...]) -> None:
        if len(given) != len(self._fingers):
            raise InvalidValueError(f"{name} = {given}: must have {len(self._fingers)} entries, one per finger")

    def _where(self) -> tuple[float, ...]:
        return tuple(q for finger in self._fingers for q in self._data.qpos[finger.at].tolist())


def _kind(force: float, velocity: Vector | None) -> tuple[bool, bool]:
    return force > 0.0, velocity is not None


class _Finger:
    """One finger: where it stands in MuJoCo's arrays, and what its control remembers."""

    def __init__(self, hand: "JointedHand", i: int, model: mujoco.MjModel) -> None:
        names, limits = hand.joint_names(i), hand.each[i].arm.limits
        self.at = np.array([int(model.joint(name).qposadr[0]) for name in names])
        self._dof = np.array([int(model.joint(name).dofadr[0]) for name in names])
        self._of = np.array([int(model.actuator(name).id) for name in names])
        self._block = np.ix_(self._dof, self._dof)
        self._chain, self._axes = hand.chain(i), hand.closing_axes(i)
        self._home = np.array(hand.split(hand.start)[i])
        self._speeds = np.array([limit.speed for limit in limits])
        self._torques = np.array([limit.torque for limit in limits])
        self._closing, self._bandwidth, self._follow = hand.closing_speed, hand.bandwidth, hand.following_error
        self._reference, self._homing = np.zeros(3), np.zeros(len(names))

    def restart(self, data: mujoco.MjData) -> None:
        """Hold it where it is."""
        self._homing[:] = data.qpos[self.at]
        self._reference[:] = tip_frame(self._chain, self._homing)[:3]

    def drive(
        self,
        data: mujoco.MjData,
        inertia: FloatArray,
        bias: FloatArray,
        force: float,
        velocity: Vector | None,
        dt: float,
    ) -> None:
        """Set the torques of the next time step, with inertia and bias torques of all that moves."""
        q, rate = data.qpos[self.at], data.qvel[self._dof]
        M, own = np.ascontiguousarray(inertia[self._block]), bias[self._dof]
        if force == 0.0 and velocity is None:
            data.ctrl[self._of] = self._homing_torque(q, rate, M, own, dt)
            return
        x, y, z = velocity or ZERO
        law = np.array([force if force > 0.0 else -1.0, self._closing, self._bandwidth, self._follow])
        motion, limits = (q, rate, M, own), (self._speeds, self._torques)
        data.ctrl[self._of] = finger_torque(
            self._chain, self._axes, *motion, self._reference, np.array([x, y, z]), law, *limits, dt
        )

    def _homing_torque(
        self, q: FloatArray, rate: FloatArray, inertia: FloatArray, bias: FloatArray, dt: float
    ) -> FloatArray:
        """Back to the start, the tip no faster than it closes."""
        b, left = self._bandwidth, self._home - self._homing
        ahead = float(np.linalg.norm(tip_jacobian(self._chain, self._homing)[:3] @ left))
        fastest = max(ahead / self._closing, float(np.max(np.abs(left) / self._speeds)))
        share = min(1.0, dt / fastest) if fastest > 0.0 else 1.0
        self._homing += share * left
        reached = share * left / dt if fastest > dt else 0.0
        torque = bias + inertia @ (b * b * (self._homing - q) + 2.0 * b * (reached - rate))
        return np.clip(torque, -self._torques, self._torques)

    def state(self) -> tuple[tuple[float, ...], tuple[float, ...]]:
        """Return reference and homing."""
        return tuple(self._reference.tolist()), tuple(self._homing.tolist())

    def set_state(self, reference: tuple[float, ...], homing: tuple[float, ...]) -> None:
        """Take back what `state` gave."""
        self._reference[:], self._homing[:] = reference, homing
