"""The contact normal, smoothed and led over the known lags."""

import math
from functools import cache
from typing import Any

import numpy as np

from palpate.compiling import machine_code, njit
from palpate.controllers.small_vectors import add_scaled, dot, unit
from palpate.errors import positive
from palpate.sensing.contact import Contact
from palpate.spatial import IDENTITY, ZERO, Matrix, Vector, as_vector


class NormalTracker:
    """A critically damped alpha-beta filter on the contact normal.

    It follows a normal that turns at a constant rate without lag, and predicts it `lead` seconds ahead: that is
    the normal that the commanded motion will meet. Both poles lie at r = exp(-period/time_constant), so
    alpha = 1 - r^2, beta = (1 - r)^2: the fading-memory filter (Brookner 1998, section 1.3).
    """

    def __init__(self, period: float, time_constant: float, lead: float) -> None:
        """Set up the filter.

        Args:
            period: Sampling period [s].
            time_constant: Of the smoothing [s]: longer smooths more noise and reacts later to a bend.
            lead: How far ahead `predicted` looks [s].
        """
        r = math.exp(-positive("period", period, "s") / positive("time_constant", time_constant, "s"))
        self._filter = (period, 1.0 - r * r, (1.0 - r) ** 2 / period, lead)
        self._state = np.zeros(7)  # whether there is a normal, this, its rate
        _kernels()  # compiled before the first period
        self.reset()

    def reset(self) -> None:
        """Forget everything: the next normal is taken as it is."""
        self._state[:] = 0.0
        self._normal: Vector | None = None
        self._predicted: Vector | None = None

    def update(self, measured: Vector) -> None:
        """Take a measured unit normal."""
        self._normal, self._predicted = _kernels()[0](self._state, self._filter, measured)

    def feel(self, rotation: Matrix, contact: Contact) -> tuple[Vector, Vector]:
        """Take a measured contact.

        Args:
            rotation: Maps the coordinates that it is given in to those of the tracked normal.
            contact: It.

        Returns:
            Its unit normal and its centroid [m], rotated.
        """
        turned, place, self._normal, self._predicted = _kernels()[1](
            self._state, self._filter, rotation, as_vector(contact.normal), as_vector(contact.centroid)
        )
        return turned, place

    @property
    def normal(self) -> Vector:
        """The smoothed unit normal.

        Raises:
            ValueError: No normal was measured yet.
        """
        if self._normal is None:
            raise ValueError("no normal was measured yet: call update() first")
        return self._normal

    @property
    def predicted(self) -> Vector:
        """The unit normal expected `lead` seconds from now; raises as `normal`."""
        return self.normal if self._predicted is None else self._predicted


@njit(cache=True)
def _update(state: Any, settings: Any, measured: Vector) -> tuple[Vector, Vector]:
    period, alpha, beta, lead = settings
    normal, rate = measured, (0.0, 0.0, 0.0)
    if state[0] != 0.0:
        rate = (state[4], state[5], state[6])
        expected = add_scaled((state[1], state[2], state[3]), period, rate)
        innovation = (measured[0] - expected[0], measured[1] - expected[1], measured[2] - expected[2])
        normal = unit(add_scaled(expected, alpha, innovation))
        rate = add_scaled(rate, beta, innovation)
        rate = add_scaled(rate, -dot(rate, normal), normal)  # a unit vector turns, it does not grow
    state[0] = 1.0
    for i in range(3):
        state[1 + i], state[4 + i] = normal[i], rate[i]
    return normal, unit((lead * rate[0] + normal[0], lead * rate[1] + normal[1], lead * rate[2] + normal[2]))


@njit(cache=True)
def _feel(
    state: Any, settings: Any, rotation: Matrix, normal: Vector, centroid: Vector
) -> tuple[Vector, Vector, Vector, Vector]:
    a, b, c = rotation
    turned = (dot(a, normal), dot(b, normal), dot(c, normal))
    place = (dot(a, centroid), dot(b, centroid), dot(c, centroid))
    smoothed, predicted = _update(state, settings, turned)
    return turned, place, smoothed, predicted


@cache
def _kernels() -> tuple[Any, Any]:
    state, settings = np.zeros(7), (0.0, 0.0, 0.0, 0.0)
    return (
        machine_code(_update, state, settings, ZERO),
        machine_code(_feel, state, settings, IDENTITY, ZERO, ZERO),
    )
