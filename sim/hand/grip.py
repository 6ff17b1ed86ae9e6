"""From a commanded grip force to currents, over the bus, and back: what runs on a hand's controller.

The force that a finger shall press with becomes a torque through the finger's lever (its Jacobian, one number),
and that a goal current through the torque constant and a model of the gear's friction: `driving_current` while
the force is to rise, `yielding_current` when it is to sink, for friction then holds it up; `GearDirection` goes
over between them. A finger in motion
sideways follows a surface that may fall away at any time: it always gets the former, so that friction never takes
its force away, and presses by up to `Hand.grip_band` more where it is pushed back. Behind the object
lies the goal position that no finger reaches, so that the goal current is what counts.

A force of 0 opens the hand, with little current: until the servo's profile is back from where it ran to behind the
object, its goal still lies closed, and what current there is squeezes.
"""

import math
from dataclasses import dataclass

import mujoco

from palpate.errors import InvalidValueError
from palpate.kinematics.gear_direction import GearDirection
from palpate.kinematics.servo_model import OPENING_FORCE, PULSE
from palpate.runtime.data import HandSample
from palpate.sim.hand.hand import Hand, finger_name
from palpate.sim.hand.servo import Servo
from palpate.sim.hand.sideways import SidewaysState
from palpate.sim.physics import whole_steps
from palpate.spatial import Vector


@dataclass(frozen=True, slots=True)
class GripState:
    """All that a `Grip` remembers, opaque."""

    servos: tuple[tuple[float, ...], ...]
    forces: tuple[float, ...]
    gears: tuple[tuple[float, float, float], ...]
    countdown: int
    sample: HandSample
    positions: tuple[float, ...]
    sideways: SidewaysState


class Grip:
    """Servos of a hand in a compiled scene, and the bus to them. A `HandDrive`."""

    def __init__(self, hand: Hand, model: mujoco.MjModel, data: mujoco.MjData) -> None:
        """Take a hand in a scene.

        Args:
            hand: As it was added to the scene.
            model: The compiled scene.
            data: Its state, which must live on.

        Raises:
            InvalidValueError: The bus period is not a whole number of time steps.
        """
        self._hand, self._data, self._bus_period = hand, data, hand.bus_period
        self._bus_steps = whole_steps("bus_period", hand.bus_period, float(model.opt.timestep))
        n, servo, finger = hand.fingers, hand.finger.servo, hand.finger
        self._servos = tuple(Servo(servo, float(model.opt.timestep)) for _ in range(n))
        first, second = model.joint(finger_name(0)), model.joint(finger_name(1))
        at, dof, of = int(first.qposadr[0]), int(first.dofadr[0]), int(model.actuator(finger_name(0)).id)
        every = int(second.dofadr[0]) - dof
        # views that live as long as the data; fingers stand in a row, each with as many joints
        self._position = data.qpos[at : at + n * every : every]
        self._velocity = data.qvel[dof : dof + n * every : every]
        self._gears = tuple(GearDirection(hand.direction_span) for _ in range(n))
        self._control = data.ctrl[of : of + n]
        self._ratio, self._tip_along = finger.ratio, hand.tip_along
        self._closed = finger.closed(hand.opening, hand.tip_along) / finger.ratio
        self._speed = hand.closing_speed / finger.lever(0.0, hand.tip_along)
        self._sideways = hand.sideways_drive(model, data)
        self.start()

    def start(self) -> None:
        """Stand still, open."""
        n = len(self._servos)
        self._positions = tuple(self._position.tolist())
        for servo, q in zip(self._servos, self._positions, strict=True):
            servo.start(q / self._ratio)
        self._forces = (0.0,) * n
        for gear in self._gears:
            gear.restart()
        self._countdown = 0
        self._sideways.start()
        self.sample = self._read(self._data.time)

    def command(self, forces: tuple[float, ...]) -> None:
        """Take the force with which each finger is to press [N], more than the servo can do included.

        Raises:
            InvalidValueError: Another number of forces than of fingers, or one that is negative or not finite.
        """
        if forces == self._forces:
            return
        if len(forces) != len(self._servos):
            raise InvalidValueError(
                f"grip_force = {forces}: must have {len(self._servos)} entries, one per finger"
            )
        for force in forces:
            if not 0.0 <= force < math.inf:
                raise InvalidValueError(f"grip_force = {forces} N: must be finite, 0 or above; 0 opens the hand")
        for gear, force in zip(self._gears, forces, strict=True):
            gear.command(force)
        self._forces = forces

    def move(self, velocities: tuple[Vector | None, ...] | None) -> None:
        """Take the velocity with which each fingertip is to move, sensor frame [m/s]; None: stand still.

        Raises:
            InvalidValueError: The hand's fingers do not move sideways, another number of velocities than of
                fingers, or one that is not finite.
        """
        self._sideways.command(velocities)

    def advance(self) -> None:
        """Set the torques of the next time step; on the bus's turn, exchange goals and positions first."""
        positions = self._position.tolist()
        self._positions = positions
        if self._countdown == 0:
            self.sample = self._read(self._data.time)
            self._write(self.sample.joint_position[: len(self._servos)])
            self._countdown = self._bus_steps
        self._countdown -= 1
        ratio = self._ratio
        velocities = self._velocity.tolist()
        for i, servo in enumerate(self._servos):
            self._control[i] = servo.step(positions[i] / ratio, velocities[i] / ratio)
        self._sideways.advance()

    def last(self) -> tuple[tuple[float, ...], tuple[float, ...]]:
        """See `HandDrive`."""
        return (*self._positions, *self._sideways.last()), tuple(servo.current for servo in self._servos)

    def state(self) -> GripState:
        """Return all that it remembers."""
        servos = tuple(servo.state() for servo in self._servos)
        positions, sideways = tuple(self._positions), self._sideways.state()
        gears = tuple(gear.state() for gear in self._gears)
        return GripState(servos, self._forces, gears, self._countdown, self.sample, positions, sideways)

    def set_state(self, state: GripState) -> None:
        """Take back what `state` gave."""
        for servo, its in zip(self._servos, state.servos, strict=True):
            servo.set_state(its)
        for gear, how in zip(self._gears, state.gears, strict=True):
            gear.set_state(how)
        self._forces, self._countdown = state.forces, state.countdown
        self.sample, self._positions = state.sample, state.positions
        self._sideways.set_state(state.sideways)

    def _read(self, time: float) -> HandSample:
        step = PULSE * self._ratio
        fingers = (step * round(q / step) for q in self._position.tolist())
        return HandSample(time, (*fingers, *self._sideways.exchange(self._bus_period)))

    def _write(self, positions: tuple[float, ...]) -> None:
        model, finger, moving = self._hand.finger.servo, self._hand.finger, self._sideways.moving
        for servo, force, gear, q in zip(self._servos, self._forces, self._gears, positions, strict=True):
            lever = finger.lever(q, self._tip_along)
            if force == 0.0:
                servo.write_goals(0.0, model.driving_current(OPENING_FORCE * lever), self._speed)
                continue
            torque = force * lever
            current = model.pressing_current(torque, 1.0 if moving else gear.driving)
            servo.write_goals(self._closed, current, self._speed)
