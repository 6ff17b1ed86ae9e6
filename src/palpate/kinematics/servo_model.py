"""Dynamixel servos by their e-manual: currents, torques and units of registers, simulated and real alike.

Friction is that of the gear: Coulomb, a share of the motor's torque (a loaded gear rubs more), and viscous. A
shaft that stands still stays there, while the torque at it is anything between `ServoModel.driving_torque` and
`ServoModel.holding_torque`.
"""

import math
from dataclasses import dataclass

from palpate.errors import InvalidValueError, check_not_negative, check_positive

PULSES = 4096
"""Positions per turn of the 12-bit encoder (e-manual, all X series)."""

PULSE = 2.0 * math.pi / PULSES
"""Resolution of the position [rad]."""

VELOCITY_UNIT = 0.229 * 2.0 * math.pi / 60.0
"""One unit of the velocity registers [rad/s]: 0.229 rev/min (e-manual)."""

PWM_UNITS = 885
"""PWM limit register at the full supply voltage (e-manual, PWM Limit(36))."""


OPENING_FORCE = 0.5
"""With which a finger opens [N]: enough against the gear's friction, and harmless while it still squeezes, until
the profile is back from where it ran to behind the object."""


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
        source: Where these metrics come from, and which are assumed.
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
        check_positive(
            self,
            voltage="V",
            stall_torque="N m",
            stall_current="A",
            no_load_speed="rad/s",
            current_unit="A",
            current_limit="A",
            velocity_limit="rad/s",
            inertia="kg m^2",
            mass="kg",
        )
        check_not_negative(self, gain_p="", gain_i="", gain_d="", coulomb="N m", viscous="N m s/rad")
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

    def pressing_current(self, torque: float, driving: float) -> float:
        """Return the current [A] for a torque at the shaft [N m] between both sides of friction.

        Args:
            torque: Wanted.
            driving: Share of the current that drives; the rest yields (`GearDirection`).
        """
        current = driving * self.driving_current(torque)
        return current if driving == 1.0 else current + (1.0 - driving) * self.yielding_current(torque)


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
