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

from palpate.errors import InvalidValueError, positive
from palpate.kinematics.servo_model import PULSE, PWM_UNITS, VELOCITY_UNIT, ServoModel

BRISTLE_STEP = 0.1
"""Of k dt^2 / J: the bristle's stiffness follows from it. 0.3 rings (tried at 1 ms); the bristle yields by
friction / k, 0.1 mrad for an XM430-W210, an eighth of a pulse."""

BRISTLE_DAMPING = 0.5
"""Damping ratio of the rotor on its bristle; a larger one is unstable with `BRISTLE_STEP` where torque is explicit
(damping * dt / J = 2 * 0.5 * sqrt(0.1) = 0.32)."""


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
