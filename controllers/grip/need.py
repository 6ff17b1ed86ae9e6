"""The least normal force that bears a load, as a controller plans it, and as the true load would need it."""

from typing import Protocol

from palpate.friction.limit_surface import LimitSurface
from palpate.spatial import Vector, Wrench, add_scaled, cross, dot, norm, subtract, unit


class GripNeed(Protocol):
    """From what a contact bears to the normal force that it needs."""

    def least(self, surface: LimitSurface, tangential_force: float, spin_torque: float) -> float:
        """Return the least normal force [N].

        Args:
            surface: What the contact bears.
            tangential_force: Its length [N].
            spin_torque: About the normal [N m].
        """
        ...


class NeedWithSpin:
    """Neither slip nor spin: what the limit surface says. A `GripNeed`."""

    def least(self, surface: LimitSurface, tangential_force: float, spin_torque: float) -> float:
        """See `GripNeed`."""
        return surface.least_normal_force(tangential_force, spin_torque)


class NeedWithoutSpin:
    """Coulomb's law alone, as if there were no torque: what it costs to ignore spin. A `GripNeed`."""

    def least(self, surface: LimitSurface, tangential_force: float, spin_torque: float) -> float:
        """See `GripNeed`."""
        return tangential_force / surface.friction


def least_grip_of_two(surface: LimitSurface, load: Wrench, first: Vector, second: Vector) -> float:
    """Return the least force [N] with which two opposed fingers hold an object, sharing its load as best they can.

    The fingers press along the line through their contacts; the load across that line, F, and its moment about it,
    M, are what friction has to bear. With one grip for both, each must bear its share within the same convex set
    of loads (f_t, tau), that of the limit surface at this normal force. If some shares (x, L - x) do, so do two of
    their mean, which lies between them: so equal shares need the least,

        f = least_normal_force(|F| / 2, |M| / 2).

    A moment across the line takes forces that differ from finger to finger, which raises the least grip: it is the
    caller's to leave such loads out, or to take this for a lower bound.

    Args:
        surface: What each contact really bears.
        load: What acts on the object besides the fingers, weight and inertia included, about the origin [N, N m].
        first: One contact, in the same frame [m].
        second: The other [m].
    """
    line = unit(subtract(second, first))
    force, moment = load[:3], load[3:]
    across = add_scaled(force, -dot(force, line), line)
    about_line = dot(subtract(moment, cross(first, force)), line)
    return surface.least_normal_force(0.5 * norm(across), 0.5 * abs(about_line))
