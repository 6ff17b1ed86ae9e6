"""A surface by name: how it rubs on one kind of fingertip, and how much that differs from touch to touch.

What is known of it is the four numbers of a limit surface, ln mu, ln c, gamma and p, each with two deviations:

- from touch to touch on the same specimen (`scatter`): grain, dust, wear. It decides how many touches it takes;
- from specimen to specimen (`specimen`): all touches of one share it, and no number of touches averages it away.
"""

import math

import msgspec
import numpy as np

from palpate.errors import FloatArray, InvalidValueError, not_negative, positive
from palpate.friction.limit_surface import LimitSurface

LARGEST_DEVIATION = 1.0
"""Of a logarithm or an exponent: beyond, nothing is known, or it is given in per cent."""

LARGEST_FRICTION = 10.0
"""More than any fingertip was seen to have; it is in per cent."""

LARGEST_SPIN_LENGTH = 0.1
"""[m]. e is about half the radius of the contact; more is in millimetres."""

PARAMETERS = 4
"""ln mu, ln c, gamma and p, in this order wherever they are a vector."""


class Deviations(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Standard deviations of what is known of a surface.

    Attributes:
        friction: Of mu, relative: that of ln mu.
        spin_length: Of c, relative.
        load_exponent: Of gamma.
        norm_exponent: Of p.
    """

    friction: float
    spin_length: float
    load_exponent: float = 0.0
    norm_exponent: float = 0.0

    def __post_init__(self) -> None:
        for name in self.__struct_fields__:
            value = not_negative(name, getattr(self, name), "")
            if value > LARGEST_DEVIATION:
                raise InvalidValueError(
                    f"{name} = {value:g}: must be at most {LARGEST_DEVIATION:g}; 0.02 stands for 2 %"
                )

    @property
    def variances(self) -> FloatArray:
        """Of ln mu, ln c, gamma and p, shape (4,)."""
        values = (self.friction, self.spin_length, self.load_exponent, self.norm_exponent)
        return np.square(np.array(values, dtype=np.float64))


class Material(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """One surface. Units stand in the keys of the file.

    Attributes:
        name: One line for people; no other of the library has it.
        kinetic_friction: mu_k, of fast slip.
        static_friction: mu_s, at which slip begins; mu_k if not given.
        stribeck_speed: v_s, over which mu falls from static to kinetic [m/s].
        viscous_friction: Growth of mu with the slip speed [s/m].
        spin_length: c, which is e at 1 N [m].
        load_exponent: gamma, 0 to 1/3.
        norm_exponent: p, 1 to 4.
        scatter: From touch to touch; friction and spin length must have some.
        specimen: From one specimen of the material to another.
        provenance: Where the figures come from.
    """

    name: str
    kinetic_friction: float
    static_friction: float | None = None
    stribeck_speed: float = msgspec.field(name="stribeck_speed_m_per_s", default=0.01)
    viscous_friction: float = msgspec.field(name="viscous_friction_s_per_m", default=0.0)
    spin_length: float = msgspec.field(name="spin_length_m")
    load_exponent: float = 0.0
    norm_exponent: float = 2.0
    scatter: Deviations
    specimen: Deviations = Deviations(friction=0.0, spin_length=0.0)
    provenance: str

    def __post_init__(self) -> None:
        for key, text in (("name", self.name), ("provenance", self.provenance)):
            if not text.strip() or not text.isprintable():
                raise InvalidValueError(f"{key} = {text[:40]!r}: must be one line of printable characters")
        positive("stribeck_speed_m_per_s", self.stribeck_speed, "m/s")
        not_negative("viscous_friction_s_per_m", self.viscous_friction, "s/m")
        _at_most("kinetic_friction", self.kinetic_friction, LARGEST_FRICTION, "in per cent?")
        _at_most("spin_length_m", self.spin_length, LARGEST_SPIN_LENGTH, "in millimetres?")
        _ = self.surface  # refuses what no limit surface can have
        if self.static_friction is not None:
            _at_most("static_friction", self.static_friction, LARGEST_FRICTION, "in per cent?")
            if not self.static_friction >= self.kinetic_friction:
                raise InvalidValueError(
                    f"static_friction = {self.static_friction:g}: must be at least the kinetic_friction = "
                    f"{self.kinetic_friction:g}; for friction that grows with speed give viscous_friction_s_per_m"
                )
        for key in ("friction", "spin_length"):
            positive(f"scatter.{key}", getattr(self.scatter, key), "")

    @property
    def surface(self) -> LimitSurface:
        """What it bears in fast slip, the least it ever does unless mu grows with the speed."""
        return LimitSurface(self.kinetic_friction, self.spin_length, self.load_exponent, self.norm_exponent)

    @property
    def parameters(self) -> FloatArray:
        """The vector ln mu_k, ln c, gamma, p, shape (4,)."""
        logs = (math.log(self.kinetic_friction), math.log(self.spin_length))
        return np.array([*logs, self.load_exponent, self.norm_exponent], dtype=np.float64)

    def friction_at(self, slip_speed: float) -> float:
        """Return mu at a slip speed [m/s]; at 0 it is the static one.

        mu_k + (mu_s - mu_k) exp(-(v/v_s)^2) + viscous v (Armstrong-Helouvry, Dupont, Canudas de Wit 1994).
        """
        static = self.kinetic_friction if self.static_friction is None else self.static_friction
        drop = math.exp(-((slip_speed / self.stribeck_speed) ** 2))
        return self.kinetic_friction + (static - self.kinetic_friction) * drop + self.viscous_friction * slip_speed

    def spin_length_at(self, normal_force: float) -> float:
        """Return e [m] at a normal force [N]."""
        return self.surface.spin_length_at(normal_force)


def _at_most(key: str, value: float, most: float, doubt: str) -> None:
    if not value <= most:
        raise InvalidValueError(f"{key} = {value!r}: must be at most {most:g}; {doubt}")
