"""How fingertips move sideways: a rack square to the plane in which a finger closes, or nothing at all.

A tip on two racks square to each other never turns. Where it touches an object that turns about the hand's axis it
rolls about a line parallel to that axis, with no spin about the contact's normal: nothing is twisted that friction
would have to hold.

Sideways means along y of the finger's sensor frame: about the hand's axis, anticlockwise seen from above the palm.
"""

import math
from dataclasses import dataclass

import mujoco

from palpate.errors import InvalidValueError, check_positive, not_negative
from palpate.kinematics.servo_model import PULSE, XL330_M288, ServoModel
from palpate.sim.hand.servo import Servo
from palpate.spatial import ZERO, Vector

MAX_LEAD = 2e-3
"""[m] As far the goal may be ahead of where a finger is: one that is held does not leap when it is let go. At 20
mm/s an XL330-M288 on a 5 mm pinion lags 0.8 mm (its back-EMF over its proportional gain)."""


@dataclass(frozen=True, slots=True)
class SidewaysRack:
    """A rack that carries a finger with its servo sideways, driven by a position-controlled servo.

    Attributes:
        servo: What drives the pinion.
        pinion: Its radius [m].
        mass: Of rack and carriage, without the servo that rides on it [kg].
        travel: From the middle to either side [m].
    """

    servo: ServoModel = XL330_M288
    pinion: float = 0.005
    mass: float = 0.03
    travel: float = 0.012

    def __post_init__(self) -> None:
        check_positive(self, pinion="m", travel="m")
        not_negative("mass", self.mass, "kg")


@dataclass(frozen=True, slots=True)
class SidewaysState:
    """All that a `SidewaysDrive` remembers, opaque."""

    servos: tuple[tuple[float, ...], ...] = ()
    velocities: tuple[float, ...] | None = None
    goals: tuple[float, ...] = ()
    positions: tuple[float, ...] = ()


class FixedSideways:
    """Of a hand whose fingers only close."""

    moving = False

    def start(self) -> None:
        """It never moves."""

    def command(self, velocities: tuple[Vector | None, ...] | None) -> None:
        """Refuse any velocity.

        Raises:
            InvalidValueError: One is given.
        """
        if velocities is not None:
            raise InvalidValueError(
                f"finger_velocity = {velocities}: the fingers of this hand only close; leave it None, or take a "
                "hand whose fingers have more joints, as palpate.sim.hand.turning_hand.turning_hand()"
            )

    def exchange(self, bus_period: float) -> tuple[float, ...]:
        """No joint, no position."""
        return ()

    def advance(self) -> None:
        """It never moves."""

    def last(self) -> tuple[float, ...]:
        """No joint, no position."""
        return ()

    def state(self) -> SidewaysState:
        """It remembers nothing."""
        return SidewaysState()

    def set_state(self, state: SidewaysState) -> None:
        """It remembers nothing."""


class RackDrive:
    """Servos of racks, fed with goals that follow commanded velocities.

    A commanded velocity is summed up to a goal position, which ends at the travel as the servo's own position
    limits make it, and which runs ahead of the finger by `MAX_LEAD` at most.
    """

    def __init__(
        self, rack: SidewaysRack, joints: tuple[str, ...], model: mujoco.MjModel, data: mujoco.MjData
    ) -> None:
        """Take racks in a scene.

        Args:
            rack: What each of them is.
            joints: Their names, and those of their actuators.
            model: The compiled scene.
            data: Its state, which must live on.
        """
        self._rack, self._data = rack, data
        self._servos = tuple(Servo(rack.servo, float(model.opt.timestep)) for _ in joints)
        self._at = [int(model.joint(name).qposadr[0]) for name in joints]
        self._dof = [int(model.joint(name).dofadr[0]) for name in joints]
        self._of = [int(model.actuator(name).id) for name in joints]
        self.start()

    @property
    def moving(self) -> bool:
        """Whether a sideways motion is commanded, even at zero speed."""
        return self._velocities is not None

    def start(self) -> None:
        """Stand still where the joints are."""
        self._positions = self._goals = self._where()
        self._velocities: tuple[float, ...] | None = None
        for servo, y in zip(self._servos, self._positions, strict=True):
            servo.start(y / self._rack.pinion)

    def command(self, velocities: tuple[Vector | None, ...] | None) -> None:
        """Take the velocity with which each fingertip is to move, sensor frame [m/s]; None: stand still.

        Raises:
            InvalidValueError: Another number of velocities than of fingers, one that is not finite, or one that
                is not along y.
        """
        if velocities is None:
            self._velocities = None
            return
        if len(velocities) != len(self._servos):
            raise InvalidValueError(
                f"finger_velocity = {velocities}: must have {len(self._servos)} entries, one per finger"
            )
        for x, y, z in (velocity or ZERO for velocity in velocities):
            if x or z or not math.isfinite(y):
                raise InvalidValueError(
                    f"finger_velocity = {velocities} m/s: must be finite, and along y alone: these fingers move "
                    "sideways while they press"
                )
        self._velocities = tuple((velocity or ZERO)[1] for velocity in velocities)

    def exchange(self, bus_period: float) -> tuple[float, ...]:
        """Exchange goals and positions over the bus; return positions as it tells them [m]."""
        rack, model = self._rack, self._rack.servo
        step = PULSE * rack.pinion
        measured = tuple(step * round(y / step) for y in self._where())
        goals = []
        velocities = self._velocities or (0.0,) * len(self._servos)
        for servo, goal, v, y in zip(self._servos, self._goals, velocities, measured, strict=True):
            wanted = goal
            if v:
                wanted = max(-rack.travel, min(rack.travel, goal + v * bus_period))
                wanted = max(y - MAX_LEAD, min(y + MAX_LEAD, wanted))
            servo.write_goals(wanted / rack.pinion, model.current_limit, model.velocity_limit)
            goals.append(wanted)
        self._goals = tuple(goals)
        return measured

    def advance(self) -> None:
        """Set the torques of the next time step."""
        control, speeds, pinion = self._data.ctrl, self._data.qvel, self._rack.pinion
        self._positions = self._where()
        for servo, y, dof, of in zip(self._servos, self._positions, self._dof, self._of, strict=True):
            control[of] = servo.step(y / pinion, float(speeds[dof]) / pinion)

    def last(self) -> tuple[float, ...]:
        """Return where each finger was at the last time step, without rounding [m]."""
        return self._positions

    def state(self) -> SidewaysState:
        """Return all that it remembers."""
        servos = tuple(servo.state() for servo in self._servos)
        return SidewaysState(servos, self._velocities, self._goals, self._positions)

    def set_state(self, state: SidewaysState) -> None:
        """Take back what `state` gave."""
        for servo, its in zip(self._servos, state.servos, strict=True):
            servo.set_state(its)
        self._velocities, self._goals, self._positions = state.velocities, state.goals, state.positions

    def _where(self) -> tuple[float, ...]:
        position = self._data.qpos
        return tuple(float(position[at]) for at in self._at)


SidewaysDrive = FixedSideways | RackDrive
"""Sideways motion of the fingers of a hand in a compiled scene; the hand's drive calls it."""
