"""A Dynamixel servo in current-based position control (operating mode 5), as its e-manual describes it.

    goal position -> profile -> PID on the 12-bit position -> voltage -> current, at most the goal current -> gear

The PID sets a share of the supply voltage (e-manual, "Position PID Gain": P/128, I/65536, D/16, in units of
position and of PWM). The motor draws what voltage, back-EMF and resistance let it, and never more than the goal
current. Against an obstacle the profile runs on, the position error grows until the goal current is all that
counts, and from there the servo is a source of torque, but for what friction takes.

Friction is that of the gear: Coulomb, a share of the motor's torque (a loaded gear rubs more), and viscous. It
holds like a bristle, without creep: a finger that stands still stays where it is, while the torque at its shaft is
anything between `ServoModel.driving_torque` and `ServoModel.holding_torque`.
"""

import math
from dataclasses import dataclass

from palpate.errors import InvalidValueError, not_negative, positive

PULSES = 4096
"""Positions per turn of the 12-bit encoder (e-manual, all X series)."""

PULSE = 2.0 * math.pi / PULSES
"""Resolution of the position [rad]."""

VELOCITY_UNIT = 0.229 * 2.0 * math.pi / 60.0
"""One unit of the velocity registers [rad/s]: 0.229 rev/min (e-manual)."""

PWM_UNITS = 885
"""PWM limit register at the full supply voltage (e-manual, PWM Limit(36))."""

BRISTLE_STEP = 0.1
"""Of k dt^2 / J: the bristle's stiffness follows from it. 0.3 rings (tried at 1 ms); the bristle gives way by
friction / k, 0.1 mrad for an XM430-W210, an eighth of a pulse."""

BRISTLE_DAMPING = 0.5
"""Damping ratio of the rotor on its bristle; a larger one is unstable with `BRISTLE_STEP` where torque is explicit
(damping * dt / J = 2 * 0.5 * sqrt(0.1) = 0.32)."""


@dataclass(frozen=True, slots=True)
class ServoModel:
    """A servo by its e-manual, at its shaft.

    Attributes:
        name: As the maker calls it.
        voltage: Supply [V] to which the next three belong.
        stall_torque: [N m].
        stall_current: [A].
        no_load_speed: [rad/s].
        current_unit: One step of goal and present current [A].
        current_limit: Current Limit(38), initial value [A].
        velocity_limit: Velocity Limit(44), initial value [rad/s].
        gain_p: Position P Gain(84), as in the control table.
        gain_i: Position I Gain(82), likewise.
        gain_d: Position D Gain(80), likewise.
        coulomb: Friction torque without load [N m].
        load_friction: What the gear takes besides, as a share of the motor's torque.
        viscous: Friction torque per speed [N m s/rad].
        inertia: Of rotor and gear [kg m^2].
        mass: [kg].
        source: Where these figures come from, and which are assumed.
    """

    name: str
    voltage: float
    stall_torque: float
    stall_current: float
    no_load_speed: float
    current_unit: float
    current_limit: float
    velocity_limit: float
    gain_p: int
    gain_i: int
    gain_d: int
    coulomb: float
    load_friction: float
    viscous: float
    inertia: float
    mass: float
    source: str

    def __post_init__(self) -> None:
        positive("voltage", self.voltage, "V")
        positive("stall_torque", self.stall_torque, "N m")
        positive("stall_current", self.stall_current, "A")
        positive("no_load_speed", self.no_load_speed, "rad/s")
        positive("current_unit", self.current_unit, "A")
        positive("current_limit", self.current_limit, "A")
        positive("velocity_limit", self.velocity_limit, "rad/s")
        not_negative("gain_p", self.gain_p, "")
        not_negative("gain_i", self.gain_i, "")
        not_negative("gain_d", self.gain_d, "")
        not_negative("coulomb", self.coulomb, "N m")
        not_negative("viscous", self.viscous, "N m s/rad")
        positive("inertia", self.inertia, "kg m^2")
        positive("mass", self.mass, "kg")
        if not 0.0 <= self.load_friction < 1.0:
            raise InvalidValueError(f"load_friction = {self.load_friction}: must be at least 0 and below 1")
        if not self.back_emf > 0.0:
            raise InvalidValueError(
                f"coulomb = {self.coulomb:g} N m, viscous = {self.viscous:g} N m s/rad: the servo could not reach "
                f"its no-load speed of {self.no_load_speed:g} rad/s; take less friction"
            )

    @property
    def torque_constant(self) -> float:
        """Motor torque per current [N m/A], before friction: with it the servo has its maker's stall torque."""
        return (self.stall_torque + self.coulomb) / ((1.0 - self.load_friction) * self.stall_current)

    @property
    def resistance(self) -> float:
        """Voltage per current at stall [Ohm]."""
        return self.voltage / self.stall_current

    @property
    def back_emf(self) -> float:
        """Voltage per speed [V s/rad]: with it the servo has its maker's no-load speed."""
        lost = self.coulomb + self.viscous * self.no_load_speed
        current = lost / (self.torque_constant * (1.0 - self.load_friction))
        return (self.voltage - self.resistance * current) / self.no_load_speed

    @property
    def largest_current(self) -> float:
        """What limit and supply voltage leave at stall [A]."""
        return min(self.current_limit, self.stall_current)

    def driving_torque(self, current: float) -> float:
        """Return what a current [A] drives at most at the shaft, standing still [N m]: friction takes its part."""
        return max(0.0, (1.0 - self.load_friction) * self.torque_constant * current - self.coulomb)

    def holding_torque(self, current: float) -> float:
        """Return what it takes at the shaft to drive the servo back against a current [A]: friction helps."""
        return (1.0 + self.load_friction) * self.torque_constant * current + self.coulomb

    def driving_current(self, torque: float) -> float:
        """Return the current [A] that brings the torque at the shaft up to a value [N m]."""
        return (torque + self.coulomb) / ((1.0 - self.load_friction) * self.torque_constant)

    def yielding_current(self, torque: float) -> float:
        """Return the current [A] at which the torque at the shaft sinks to a value [N m]; 0 if friction holds."""
        return max(0.0, (torque - self.coulomb) / ((1.0 + self.load_friction) * self.torque_constant))


XM430_W210 = ServoModel(
    name="XM430-W210",
    voltage=12.0,
    stall_torque=3.0,
    stall_current=2.3,
    no_load_speed=77.0 * 2.0 * math.pi / 60.0,
    current_unit=2.69e-3,
    current_limit=1193 * 2.69e-3,
    velocity_limit=330 * VELOCITY_UNIT,
    gain_p=800,
    gain_i=0,
    gain_d=0,
    coulomb=0.05,
    load_friction=0.1,
    viscous=0.0,
    inertia=0.005,
    mass=0.082,
    source="ROBOTIS e-manual, emanual.robotis.com/docs/en/dxl/x/xm430-w210: specifications (copy of 2018), "
    "control table. Assumed: coulomb and inertia, 0.1 N m and 0.005 kg m^2 as identified for MX-64 and MX-106 "
    "(google-deepmind/mujoco_menagerie, dynamixel_2r), friction taken down with the stall torque to 1.7 %; "
    "load_friction (arXiv 2410.08650 finds load-dependent friction important; the value is a guess); viscous, "
    "none beside the back-EMF",
)

XL330_M288 = ServoModel(
    name="XL330-M288",
    voltage=5.0,
    stall_torque=0.52,
    stall_current=1.47,
    no_load_speed=103.0 * 2.0 * math.pi / 60.0,
    current_unit=1e-3,
    current_limit=1.75,
    velocity_limit=445 * VELOCITY_UNIT,
    gain_p=400,
    gain_i=0,
    gain_d=0,
    coulomb=0.009,
    load_friction=0.1,
    viscous=0.0,
    inertia=6e-4,
    mass=0.018,
    source="ROBOTIS e-manual, emanual.robotis.com/docs/en/dxl/x/xl330-m288: control table; stall torque as others "
    "quote it from there. From memory, to be checked: stall current (others quote 1.5 A), no-load speed, mass. "
    "Assumed: coulomb, load_friction and viscous in proportion as for the XM430-W210; inertia for the same 13 ms "
    "of inertia over back-EMF damping",
)


class Servo:
    """One servo at work: `write_goals` when the bus brings them, `step` once per time step. Starts at a position.

    Positions are of the shaft [rad]. It remembers its goals, its profile, its integral and its bristle.
    """

    def __init__(self, model: ServoModel, time_step: float) -> None:
        """Take a servo.

        Args:
            model: What it is.
            time_step: Of the simulation, and of the servo's own control [s]. (What rate the firmware runs at is
                not in the e-manual; 1 kHz or more is assumed.)

        Raises:
            InvalidValueError: The time step is too long for the motor's own damping.
        """
        self.model = model
        self._dt = dt = positive("time_step", time_step, "s")
        K, R, ke = model.torque_constant, model.resistance, model.back_emf
        longest = (
            0.5 * model.inertia / (K * ke / R + model.viscous)
        )  # explicit damping: half of what turns it round
        if dt > longest:
            raise InvalidValueError(
                f"time_step = {dt:g} s with {model.name}: must be at most {longest:.2g} s for its back-EMF damping"
            )
        self._K, self._G, self._ke = K, 1.0 / R, ke
        self._volt = model.voltage / PWM_UNITS
        self._p, self._i, self._d = model.gain_p / 128.0, model.gain_i / 65536.0, model.gain_d / 16.0
        self._stiffness = BRISTLE_STEP * model.inertia / dt**2
        self._damping = 2.0 * BRISTLE_DAMPING * math.sqrt(self._stiffness * model.inertia)
        self.start(0.0)

    def start(self, position: float) -> None:
        """Hold a position [rad], without any torque in the gear."""
        self._position = self._profile = self._goal = position
        self._goal_current = self.model.current_limit
        self._speed = self.model.velocity_limit
        self._sum = self._error = self._stretch = self._current = 0.0

    def write_goals(self, position: float, current: float, speed: float) -> None:
        """Take goals as registers hold them: rounded, and within their limits.

        Args:
            position: Goal Position(116) [rad].
            current: Goal Current(102) [A]; its sign does not count in this mode.
            speed: Profile Velocity(112) [rad/s].
        """
        model = self.model
        self._goal = PULSE * round(position / PULSE)
        self._goal_current = min(
            model.current_unit * round(abs(current) / model.current_unit), model.current_limit
        )
        self._speed = min(VELOCITY_UNIT * max(1, round(abs(speed) / VELOCITY_UNIT)), model.velocity_limit)

    @property
    def goal_current(self) -> float:
        """As the register holds it [A]."""
        return self._goal_current

    @property
    def current(self) -> float:
        """Of the last step [A], positive in the direction of positive torque."""
        return self._current

    def step(self, position: float, velocity: float) -> float:
        """Return the torque at the shaft during the next time step [N m], friction included.

        Args:
            position: Of the shaft [rad].
            velocity: Of the shaft [rad/s].
        """
        ahead, reach = self._goal - self._profile, self._speed * self._dt
        self._profile += max(-reach, min(reach, ahead))
        error = (self._profile - PULSE * round(position / PULSE)) / PULSE
        pwm = self._p * error + self._i * (self._sum + error) + self._d * (error - self._error)
        self._error = error
        if -PWM_UNITS < pwm < PWM_UNITS:
            self._sum += error  # no wind-up where the output ends
        else:
            pwm = math.copysign(PWM_UNITS, pwm)
        limit = self._goal_current
        self._current = current = max(-limit, min(limit, self._G * (self._volt * pwm - self._ke * velocity)))
        model = self.model
        drive = self._K * current
        largest, k = model.coulomb + model.load_friction * abs(drive), self._stiffness
        stretch = self._stretch + position - self._position
        self._position = position
        self._stretch = stretch = max(-largest / k, min(largest / k, stretch))
        rubs = max(-largest, min(largest, k * stretch + self._damping * velocity))
        return drive - rubs - model.viscous * velocity

    def state(self) -> tuple[float, ...]:
        """Return all that it remembers."""
        return (
            self._position,
            self._profile,
            self._goal,
            self._goal_current,
            self._speed,
            self._sum,
            self._error,
            self._stretch,
            self._current,
        )

    def set_state(self, state: tuple[float, ...]) -> None:
        """Take back what `state` gave."""
        (
            self._position,
            self._profile,
            self._goal,
            self._goal_current,
            self._speed,
            self._sum,
            self._error,
            self._stretch,
            self._current,
        ) = state
