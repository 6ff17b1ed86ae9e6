"""How far a load that changes along a line stays inside a limit surface: the first exit, exactly.

Along load + k direction slip begins where

    G(k) = |(f_t(k), T(k))|_p - mu f_n(k) = 0,    T = |tau| / (c f_n^gamma),

with f_t convex in k, and tau and f_n linear. Where T is linear or convex, so is G, and from inside there is at
most one exit. With gamma > 0 and a normal force that changes, T = |alpha f_n^-gamma + beta f_n^(1-gamma)| / c is
convex at light loads and concave at heavy ones, with one border between. Where it is concave its tangent lies
above it: the exit from that convex problem is never beyond the true one, and repeating from there converges to it
as Newton's method does, from inside.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

from palpate.friction.contact_load import ContactLoad
from palpate.friction.p_norm import p_norm
from palpate.spatial import Vector, add_scaled, dot, norm

_STEPS = 200
"""Most steps of an iteration: bisection alone ends after 60, and Newton's method far earlier, unless the line all
but touches the surface without crossing it; what is then returned is still inside."""

_ROUNDING = 4e-16
"""Steps below this share of the whole change nothing."""

_Excess = Callable[[float], tuple[float, float]]
"""k -> G [N], dG/dk."""


@dataclass(frozen=True, slots=True)
class _Line:
    """A load that changes linearly with k, as friction sees it where e is constant.

    Attributes:
        force: Tangential force at k = 0 [N].
        force_rate: Its change per k.
        torque: Spin torque over e [N].
        torque_rate: Its change per k.
        most: mu f_n [N].
        most_rate: Its change per k.
        p: The norm.
    """

    force: Vector
    force_rate: Vector
    torque: float
    torque_rate: float
    most: float
    most_rate: float
    p: float

    def seen_from(self, k: float, torque: float, torque_rate: float) -> _Line:
        """Return the line that begins at k, with another torque."""
        force, most = add_scaled(self.force, k, self.force_rate), self.most + k * self.most_rate
        return _Line(force, self.force_rate, torque, torque_rate, most, self.most_rate, self.p)

    def excess(self, k: float) -> tuple[float, float]:
        """Return G and dG/dk."""
        most = self.most + k * self.most_rate
        return self.excess_with(k, self.torque + k * self.torque_rate, self.torque_rate, most)

    def excess_with(self, k: float, torque: float, torque_rate: float, most: float) -> tuple[float, float]:
        """Return G and dG/dk with another torque over e and mu f_n at k."""
        force = add_scaled(self.force, k, self.force_rate)
        x, y, p = norm(force), abs(torque), self.p
        # at 0 a length grows in both directions
        x_rate = dot(force, self.force_rate) / x if x > 0.0 else norm(self.force_rate)
        y_rate = torque_rate if torque > 0.0 else -torque_rate if torque < 0.0 else abs(torque_rate)
        largest = max(x, y)
        if largest == 0.0:
            return -most, (x_rate**p + y_rate**p) ** (1.0 / p) - self.most_rate
        size = largest * ((x / largest) ** p + (y / largest) ** p) ** (1.0 / p)
        slope = (x / size) ** (p - 1.0) * x_rate + (y / size) ** (p - 1.0) * y_rate
        return size - most, slope - self.most_rate


def distance_to_surface(
    friction: float,
    spin_length: float,
    load_exponent: float,
    norm_exponent: float,
    load: ContactLoad,
    direction: ContactLoad,
) -> float:
    """Return the smallest k >= 0 with load + k direction on a limit surface.

    See `palpate.friction.LimitSurface` for the surface and `LimitSurface.distance_to_slip` for what is returned.
    """
    line = _Line(
        load.tangential_force,
        direction.tangential_force,
        load.spin_torque / spin_length,
        direction.spin_torque / spin_length,
        friction * load.normal_force,
        friction * direction.normal_force,
        norm_exponent,
    )
    if not math.isfinite(sum(line.force) + sum(line.force_rate) + line.torque + line.torque_rate):
        return math.nan
    if not math.isfinite(line.most + line.most_rate):
        return math.nan
    if load_exponent == 0.0 or (line.torque == 0.0 and line.torque_rate == 0.0):
        return _straight_exit(line)
    if line.most <= 0.0:
        return 0.0
    if direction.normal_force == 0.0:
        growth = load.normal_force**load_exponent
        return _straight_exit(line.seen_from(0.0, line.torque / growth, line.torque_rate / growth))
    return _Curved(line, load.normal_force, direction.normal_force, load_exponent).exit()


def _straight_exit(line: _Line) -> float:
    """Exit where T is linear: G is convex, so that from inside there is one or none."""
    if line.p == 2.0:
        return _cone_exit(line)
    start = line.excess(0.0)[0]
    if start >= 0.0:
        return 0.0
    # |L + k D| >= k |D| - |L|, so there is an exit before `k`; Newton's method comes back and never passes it
    recession = p_norm(norm(line.force_rate), abs(line.torque_rate), line.p) - line.most_rate
    if recession <= 0.0:
        return math.inf
    k = min((start + 2.0 * line.most) / recession, _cone_exit(line))  # the norm for p = 2 is the smallest
    for _ in range(_STEPS):
        value, slope = line.excess(k)
        if value <= 0.0 or slope <= 0.0:
            break
        step = value / slope
        k = max(k - step, 0.0)
        if step <= _ROUNDING * k:
            break
    return k


def _cone_exit(line: _Line) -> float:
    """The same for p = 2: G = 0 is the quadratic equation a k^2 + 2 b k + c = 0.

    With l and d the force and torque and their rate, m and n the same of mu f_n, and w = m d - n l,
    b^2 - a c = |w|^2 - |l x w|^2 / m^2 is taken as a sum of what w has along l and across it: two positive terms,
    however close to the apex the line goes.
    """
    (lx, ly, lz), lt, m = line.force, line.torque, line.most
    (dx, dy, dz), dt, n = line.force_rate, line.torque_rate, line.most_rate
    size = math.hypot(lx, ly, lz, lt)
    if size >= m:
        return 0.0
    c = (size - m) * (size + m)
    b = lx * dx + ly * dy + lz * dz + lt * dt - m * n
    x, y, z, t = m * dx - n * lx, m * dy - n * ly, m * dz - n * lz, m * dt - n * lt
    along = (lx * x + ly * y + lz * z + lt * t) / size if size > 0.0 else 0.0
    if size > 0.0:
        share = along / size
        x, y, z, t = x - share * lx, y - share * ly, z - share * lz, t - share * lt
    root = math.hypot(along, math.hypot(x, y, z, t) * math.sqrt(-c) / m)
    if b > 0.0:
        return -c / (b + root)
    rate = math.hypot(dx, dy, dz, dt)
    a = (rate - n) * (rate + n)
    return (root - b) / a if a > 0.0 else math.inf


@dataclass(frozen=True, slots=True)
class _Curved:
    """A line along which e changes, because the normal force does.

    Attributes:
        line: With the torque over c, not e.
        normal_force: At k = 0 [N], above 0.
        rate: Its change per k, not 0.
        gamma: Above 0.
    """

    line: _Line
    normal_force: float
    rate: float
    gamma: float

    def torque(self, k: float) -> tuple[float, float]:
        """Return T with its sign, and dT/dk."""
        f = self.normal_force + k * self.rate
        growth = f**self.gamma
        torque = (self.line.torque + k * self.line.torque_rate) / growth
        return torque, self.line.torque_rate / growth - self.gamma * torque * self.rate / f

    def excess(self, k: float) -> tuple[float, float]:
        """Return G and dG/dk; infinite where nothing is left to press."""
        if self.normal_force + k * self.rate <= 0.0:
            return math.inf, math.inf
        torque, torque_rate = self.torque(k)
        return self.line.excess_with(k, torque, torque_rate, self.line.most + k * self.line.most_rate)

    def border(self) -> float:
        """Return the normal force [N] below which T is convex and above which it is concave.

        tau / c = alpha + beta f_n, and T'' has the sign of (1 + gamma) alpha - (1 - gamma) beta f_n times that of
        tau, which changes at most once.
        """
        beta = self.line.torque_rate / self.rate
        alpha = self.line.torque - beta * self.normal_force
        if alpha == 0.0:
            return 0.0
        if beta == 0.0:
            return math.inf
        zero = -alpha / beta
        return zero if zero > 0.0 else -zero * (1.0 + self.gamma) / (1.0 - self.gamma)

    def exit(self) -> float:
        """Return the first exit."""
        growth = self.normal_force**self.gamma
        as_if = _straight_exit(self.line.seen_from(0.0, self.line.torque / growth, self.line.torque_rate / growth))
        # with e as it is now: too early where e grows, too late where it shrinks, right where it hardly changes
        if as_if in (0.0, math.inf) or self.normal_force + as_if * self.rate == self.normal_force:
            return as_if
        to_border = (self.border() - self.normal_force) / self.rate
        if self.rate > 0.0:
            found = self.convex_exit(as_if, min(to_border, self.farthest())) if to_border > as_if else math.inf
            return found if found < math.inf else self.concave_exit(max(to_border, as_if), math.inf)
        to_border = min(max(to_border, 0.0), as_if)
        return min(self.concave_exit(0.0, to_border), self.convex_exit(to_border, as_if))

    def farthest(self) -> float:
        """Return a k beyond which f_t alone is too much, infinity if there is none."""
        sliding = norm(self.line.force_rate) - self.line.most_rate
        return (norm(self.line.force) + self.line.most) / sliding if sliding > 0.0 else math.inf

    def convex_exit(self, start: float, end: float) -> float:
        """Return the exit between `start` and `end`, where G is convex, infinity if there is none."""
        if end == math.inf or (self.rate > 0.0 and self.excess(end)[0] < 0.0):
            return math.inf
        low, high, k = start, end, end
        for _ in range(_STEPS):
            value, slope = self.excess(k)
            if value < 0.0:
                low = k
            else:
                high = k
            guess = k - value / slope if 0.0 < slope < math.inf else low
            if not low < guess < high:
                guess = 0.5 * (low + high)
            if abs(guess - k) <= _ROUNDING * guess or high - low <= _ROUNDING * high:
                break
            k = guess
        return k

    def concave_exit(self, start: float, end: float) -> float:
        """Return the first exit between `start` and `end`, where T is concave, infinity if there is none."""
        k = start
        for _ in range(_STEPS):
            if k >= end:
                return math.inf
            step = _straight_exit(self.line.seen_from(k, *self.torque(k)))
            k += step
            if step <= _ROUNDING * k:
                break
        return k
