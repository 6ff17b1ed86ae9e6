"""The loads that a soft contact can bear: a limit surface in normal force, tangential force and spin torque.

    |(f_t / mu f_n, tau / mu e f_n)|_p = 1,    e = c f_n^gamma.

p = 2 is the ellipsoid (Howe & Cutkosky 1996), p = 1 a double cone; real rubber lies between. gamma runs from 0, a
contact whose size does not change, to the 1/3 of a linear elastic sphere (Xydas & Kao 1999). What slips does so by
maximum dissipation (Goyal, Ruina & Papadopoulos 1991): at the given normal force the slip (v, omega) is normal to
the surface, and the load is the one that takes the most power.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from numbers import Real

from palpate.errors import InvalidValueError, check_positive, not_negative, shown
from palpate.friction.contact_load import ContactLoad, Slip
from palpate.friction.p_norm import dual_point, p_norm
from palpate.friction.slip_distance import distance_to_surface
from palpate.spatial import ZERO, scale

LARGEST_LOAD_EXPONENT = 1.0 / 3.0
"""Of a linear elastic sphere, a ~ f_n^(1/3) (Hertz); soft materials lie below (Xydas & Kao 1999)."""

LARGEST_NORM_EXPONENT = 4.0
"""One patch lies between 1 and 2; of several, or of friction that differs by direction, up to 4 is fitted."""

_NEWTON_STEPS = 30
"""Never reached: from within a factor of 2 Newton's method takes at most 6."""

_EVEN = 100
"""Loads from 2^-100 to 2^100 N are reckoned with as they are: the squares of their ratios neither over- nor
underflow."""

_LARGEST_POWER = 1000
"""Of two, that a load is multiplied by: beyond 1023 it would be no number."""


@dataclass(frozen=True, slots=True)
class LimitSurface:
    """What a contact bears before it slips.

    Attributes:
        friction: mu: tangential force over normal force, without torque.
        spin_length: c [m], which is e at a normal force of 1 N: torque over mu f_n, without tangential force.
        load_exponent: gamma, 0 to 1/3: how e grows with the normal force.
        norm_exponent: p, 1 (diamond) over 2 (ellipse) to 4: how force and torque share.
    """

    friction: float
    spin_length: float
    load_exponent: float = 0.0
    norm_exponent: float = 2.0

    def __post_init__(self) -> None:
        for name, unit in _UNITS.items():
            object.__setattr__(self, name, _number(name, getattr(self, name), unit))
        check_positive(self, friction="", spin_length="m")
        not_negative("load_exponent", self.load_exponent, "")
        if self.load_exponent > LARGEST_LOAD_EXPONENT:
            raise InvalidValueError(
                f"load_exponent = {self.load_exponent:g}: must be at most {LARGEST_LOAD_EXPONENT:.4g}, that of an "
                f"elastic sphere"
            )
        if not 1.0 <= self.norm_exponent <= LARGEST_NORM_EXPONENT:
            raise InvalidValueError(
                f"norm_exponent = {self.norm_exponent:g}: must lie between 1 (diamond) and "
                f"{LARGEST_NORM_EXPONENT:g}; 2 is the ellipsoid"
            )

    def spin_length_at(self, normal_force: float) -> float:
        """Return e [m] at a normal force [N]; below 0 it is that at 0."""
        if type(normal_force) is not float:
            normal_force = _number("normal_force", normal_force, "N")
        if self.load_exponent == 0.0:
            return self.spin_length
        return self.spin_length * float(max(normal_force, 0.0) ** self.load_exponent)

    def load_ratio(self, normal_force: float, tangential_force: float, spin_torque: float) -> float:
        """Return the norm of a load that is below 1 inside the surface, 1 on it and above 1 outside.

        Args:
            normal_force: [N].
            tangential_force: Its length [N].
            spin_torque: [N m].

        Returns:
            0 without load; infinity for a load without normal force; NaN of what is not a number.

        Raises:
            InvalidValueError: An array or a text instead of a number.
        """
        if type(normal_force) is not float:
            normal_force = _number("normal_force", normal_force, "N")
        size, most = self._size(normal_force, tangential_force, spin_torque), self.friction * normal_force
        if size == 0.0:
            return math.nan if math.isnan(most) else 0.0
        return math.inf if most <= 0.0 else size / most

    def margin(self, normal_force: float, tangential_force: float, spin_torque: float) -> float:
        """Return mu f_n - |(f_t, tau / e)|_p [N]: how much more friction there is than is needed.

        Args:
            normal_force: [N].
            tangential_force: Its length [N].
            spin_torque: [N m].

        Returns:
            Above 0 inside the surface, 0 on it, below 0 outside; -infinity if there is torque and e is 0.

        Raises:
            InvalidValueError: As in `load_ratio`.
        """
        if type(normal_force) is not float:
            normal_force = _number("normal_force", normal_force, "N")
        return self.friction * normal_force - self._size(normal_force, tangential_force, spin_torque)

    def least_normal_force(self, tangential_force: float, spin_torque: float) -> float:
        """Return the smallest normal force [N] that bears a load.

        With gamma > 0 it solves (f_t / mu f)^p + (tau / mu c f^(1 + gamma))^p = 1. The logarithm of the left side
        is a convex, falling function of log f: Newton's method from below rises to the root and never passes it.

        Args:
            tangential_force: Its length [N].
            spin_torque: [N m].

        Returns:
            Infinity for an infinite load, NaN of what is not a number.

        Raises:
            InvalidValueError: As in `load_ratio`.
        """
        if not type(tangential_force) is type(spin_torque) is float:
            tangential_force = _number("tangential_force", tangential_force, "N")
            spin_torque = _number("spin_torque", spin_torque, "N m")
        by_force = abs(tangential_force) / self.friction
        by_torque = abs(spin_torque) / (self.friction * self.spin_length)
        gamma, p = self.load_exponent, self.norm_exponent
        if gamma == 0.0:
            return p_norm(by_force, by_torque, p)
        alone = float(by_torque ** (1.0 / (1.0 + gamma)))
        start = max(by_force, alone)
        if not 0.0 < start < math.inf:
            return by_force + alone
        # in units of `start` one of the two terms is 1, the other below
        by_force, alone = by_force / start, alone / start
        if by_force == 0.0 or alone == 0.0:
            return start
        a, b = p * math.log(by_force), p * (1.0 + gamma) * math.log(alone)
        u = 0.0
        for _ in range(_NEWTON_STEPS):
            first, second = math.exp(a - p * u), math.exp(b - p * (1.0 + gamma) * u)
            both = first + second
            step = math.log(both) * both / (p * (first + (1.0 + gamma) * second))
            u += step
            if step <= 1e-16:
                break
        return start * math.exp(u)

    def distance_to_slip(self, load: ContactLoad, direction: ContactLoad) -> float:
        """Return the smallest factor k >= 0 that brings load + k direction onto the surface.

        With a change of the load per second as the direction, that is the time until slip [s]. For gamma > 0 the
        loads that are borne are no convex set; it is the first exit all the same.

        Args:
            load: The load now.
            direction: How it changes, in units of the load.

        Returns:
            0 on the surface and outside, infinity if the load stays inside for ever, NaN of what is not a number.
        """
        of_load, of_rate = _power(load), _power(direction)
        if abs(of_load) <= _EVEN:
            of_load = 0
        gamma = self.load_exponent
        # the same surface in another unit of force: e = c f_n^gamma is the same length
        spin_length = self.spin_length * 2.0 ** (-gamma * of_load) if of_load else self.spin_length
        found = distance_to_surface(
            self.friction,
            spin_length,
            gamma,
            self.norm_exponent,
            _times(of_load, load) if of_load else load,
            _times(of_rate, direction),
        )
        try:
            return math.ldexp(found, of_rate - of_load)
        except OverflowError:
            return math.inf  # farther than numbers reach

    def slip_direction(self, load: ContactLoad) -> Slip:
        """Return how the object slips over the finger under a load on the surface (elsewhere: on it, scaled).

        Normality: v ~ f_t^(p-1), e omega ~ (tau / e)^(p-1). At a corner of the diamond (p = 1), where there is a
        cone of normals, it is the axis of that cone, which only slides or only spins; on its edges v = e omega.

        Returns:
            Slip of speed |(v, e omega)|_q = 1 m/s, 1/p + 1/q = 1, which dissipates mu f_n times 1 m/s; none
            without load. A torque where e is 0 only spins, infinitely fast.
        """
        force, e, p = load.tangential_length, self.spin_length_at(load.normal_force), self.norm_exponent
        torque = abs(load.spin_torque)
        x, y, z = load.tangential_force
        # divided, not scaled by 1 / force: that is infinite for subnormal forces
        direction = (x / force, y / force, z / force) if force > 0.0 else ZERO
        if torque == 0.0:
            return Slip(direction, 0.0)
        if e == 0.0:
            return Slip(ZERO, math.copysign(math.inf, load.spin_torque))
        if force == 0.0:
            return Slip(ZERO, math.copysign(1.0 / e, load.spin_torque))
        size = p_norm(force, torque / e, p)
        spin = math.copysign((torque / (e * size)) ** (p - 1.0) / e, load.spin_torque)
        return Slip(scale((force / size) ** (p - 1.0), direction), spin)

    def load_for_slip(self, normal_force: float, slip: Slip) -> ContactLoad:
        """Return what a contact in full slip bears: of all loads on the surface the one that takes most power.

        Where many do (p = 1) it is the middle of them. Without slip, or without normal force, there is none.

        Args:
            normal_force: [N].
            slip: Of the object over the finger; of any speed.
        """
        e, speed = self.spin_length_at(normal_force), math.hypot(*slip.velocity)
        x, y = dual_point(speed, e * abs(slip.spin), self.norm_exponent)
        most = self.friction * max(normal_force, 0.0)
        along = scale(most * x / speed, slip.velocity) if speed > 0.0 else ZERO
        return ContactLoad(normal_force, along, math.copysign(most * e * y, slip.spin))

    def _size(self, normal_force: float, tangential_force: float, spin_torque: float) -> float:
        """|(f_t, tau / e)|_p [N]."""
        if not type(tangential_force) is type(spin_torque) is float:
            tangential_force = _number("tangential_force", tangential_force, "N")
            spin_torque = _number("spin_torque", spin_torque, "N m")
        if spin_torque == 0.0:
            return abs(tangential_force)
        e = self.spin_length_at(normal_force)
        return p_norm(abs(tangential_force), abs(spin_torque) / e, self.norm_exponent) if e != 0.0 else math.inf


_UNITS = {"friction": "", "spin_length": "m", "load_exponent": "", "norm_exponent": ""}


def _number(name: str, value: object, unit: str) -> float:
    """Return a number of whatever type as a float.

    Raises:
        InvalidValueError: It is an array, a text or anything else: a text would pass comparisons that come later,
            an array would come out as a margin per component.
    """
    if isinstance(value, Real):
        return float(value)
    shape = getattr(value, "shape", None)
    if shape == ():  # numpy's array of no dimension
        return float(value)  # type: ignore[arg-type]  # whatever has a shape converts, or says so
    given = f" = {shown(value)}" if shape is None else f" has shape {shape}"
    many = shape is not None or isinstance(value, list | tuple)
    several = "; take several one by one, and of a force its length" if many else ""
    raise InvalidValueError(f"{name}{given}: must be one number" + (f" [{unit}]" if unit else "") + several)


def _power(load: ContactLoad) -> int:
    """Return by which power of two a load comes to about one newton or newton metre; 0 if that makes no sense."""
    size = max(abs(load.normal_force), load.tangential_length, abs(load.spin_torque))
    return min(-math.frexp(size)[1], _LARGEST_POWER) if 0.0 < size < math.inf else 0


def _times(power: int, load: ContactLoad) -> ContactLoad:
    """Return a load times a power of two, to the last bit."""
    factor = 2.0**power
    return ContactLoad(factor * load.normal_force, scale(factor, load.tangential_force), factor * load.spin_torque)
