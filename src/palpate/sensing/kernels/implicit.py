"""The contact centroid on any smooth convex surface.

With n the normal at c, phi = f.n, v = m - c x f, Q = v.n, the tangential part of v must vanish. Moving c by a
tangent d changes it by phi n x d - Q W d, W the shape operator: a 2x2 system with determinant phi^2 + Q^2 kG,
which is singular at grazing contact without spin only. So Newton's step always exists and always goes downhill; it
is shortened until the residual falls and the force still pushes.

The start is the exact solution on the ellipsoid with the same half lengths. Should the iteration get stuck, the
moment is led from one for which the start is exact, m_0 = c_0 x f + (s/phi_0) n_0 with s = f.m, to the measured
one: s stays the same in between, and with it the sign of the spin, so that the path never meets the singularity.
Should that get stuck too, other starts follow: where the wrench axis comes in, which is exact without spin, and
where an ellipsoid meets the force, or the moment, squarely.

A surface that yields, c = x - delta(f_n) n with x on the undeformed one, is solved for x likewise: moving x
by d moves c by (I - delta W) d and, through the normal force, along n. It makes sense while delta W stays below 1.
"""

import math
from collections.abc import Callable
from functools import lru_cache
from typing import Any

from numba.core.dispatcher import Dispatcher

from palpate.compiling import keep_closure, kept_name, njit
from palpate.sensing.contact import ContactStatus
from palpate.sensing.kernels.contact_rows import clear_contact, in_tip_frame
from palpate.surfaces.implicit import Evaluate, Level

_OK = int(ContactStatus.OK)
_NO_CONTACT = int(ContactStatus.NO_CONTACT)
_NO_FORCE = int(ContactStatus.NO_FORCE)
_INVALID = int(ContactStatus.INVALID)
_NOT_CONVERGED = int(ContactStatus.NOT_CONVERGED)

RESIDUAL = 1e-14
"""Of the moment, relative to |m| + |c||f|, at which the iteration is content; it goes on while that improves."""

ACCEPTED = 1e-12
"""Largest such residual that counts as a contact."""

MOST_EXACT = 1e-13
"""The same where something else finds what Newton's iteration does not."""

INTERMEDIATE = 1e-6
"""The same for the contacts between the easy moment and the measured one."""

MAX_STEPS = 40
"""Of Newton's iteration; 5 to 8 are usual."""

USUAL_STEPS = 12
"""Of Newton's iteration along a ray, after which it takes turns with bisection."""

MIN_PUSH = 1e-9
"""Normal force, relative to the force, below which rounding decides on which side a finger is touched."""

MIN_SPIN = 1e-14
"""f.m, relative to |f||m|, that cannot be distinguished from zero."""

SOFTEST = 1.0 - 1e-6
"""Indentation times curvature of a contact: at 1 the yielding surface folds over."""

STARTS = 4
"""See `search`."""

STARTING_PUSH = 1e-6
"""The same where an iteration starts."""

LONGEST_STEP = 0.5
"""Of a Newton step, relative to the distance from the centre."""

SMALLEST_SHARE = 1.0 / 64.0
"""Shortest share of a Newton step that is tried."""

SMALLEST_LEAD = 1e-7
"""Shortest step from the easy moment to the measured one, of the whole distance."""


@lru_cache(maxsize=64)
def solver_for(evaluate: Evaluate, cheaper: Level | None = None) -> Callable[..., None]:
    """Return the solver of surfaces given by `evaluate`: compiled if it is, else plain Python.

    Args:
        evaluate: Value and derivatives.
        cheaper: Value and gradient alone, where that saves time.
    """
    compiled = isinstance(evaluate, Dispatcher)
    name = "" if cheaper is not None else kept_name(evaluate)

    def jit(function: Any) -> Any:
        if not compiled:
            return function
        if name:
            # processes that each compile one solver may give their functions one name: loaded together, one of
            # them would be called for both
            function.__qualname__ = f"{name.split()[0]}.{function.__name__}"
        return njit(error_model="numpy")(function)

    def first_four(p: Any, x: Any, y: Any, z: Any) -> Any:
        value, gx, gy, gz, _a, _b, _c, _d, _e, _f = evaluate(p, x, y, z)
        return value, gx, gy, gz

    level = jit(first_four) if cheaper is None else cheaper

    @jit
    def project(p, x, y, z):
        """Move a point along its ray from the centre onto the surface: Newton between brackets."""
        low, high, t = 0.0, math.inf, 1.0
        for step in range(100):
            value, gx, gy, gz = level(p, t * x, t * y, t * z)
            if value <= 0.0:
                low = t
            else:
                high = t
            slope = gx * x + gy * y + gz * z
            new = t - value / slope if slope > 0.0 else math.inf
            # far out, where a value grows like an exponential, Newton is slow
            if not low < new < high or (step > USUAL_STEPS and step % 2 == 0):
                new = 2.0 * t if math.isinf(high) else 0.5 * (low + high)
            if abs(new - t) <= 2e-16 * t:
                return new
            if value == 0.0:
                return t
            t = new
        return t

    @jit
    def indentation(law, phi):
        """delta, and its rate of change with -phi, for a force of law[2] N."""
        push = -phi * law[2]
        if not (push > 0.0 and law[0] < math.inf):
            return 0.0, 0.0
        delta = (push / law[0]) ** law[1]
        return delta, law[1] * delta / -phi

    @jit
    def frame_at(p, law, f, m, x):
        """Normal, phi, Q, tangential residual (3), and the shape operator's six numbers at a point."""
        _value, gx, gy, gz, hxx, hyy, hzz, hyz, hxz, hxy = evaluate(p, x[0], x[1], x[2])
        length = math.sqrt(gx * gx + gy * gy + gz * gz)
        nx, ny, nz = gx / length, gy / length, gz / length
        phi = f[0] * nx + f[1] * ny + f[2] * nz
        delta, _rate = indentation(law, phi)
        c = (x[0] - delta * nx, x[1] - delta * ny, x[2] - delta * nz)
        vx = m[0] - (c[1] * f[2] - c[2] * f[1])
        vy = m[1] - (c[2] * f[0] - c[0] * f[2])
        vz = m[2] - (c[0] * f[1] - c[1] * f[0])
        Q = vx * nx + vy * ny + vz * nz
        residual = (vx - Q * nx, vy - Q * ny, vz - Q * nz)
        hessian = (hxx / length, hyy / length, hzz / length, hyz / length, hxz / length, hxy / length)
        return (nx, ny, nz), phi, Q, residual, hessian

    @jit
    def softness(law, n, phi, h):
        """Delta times the largest curvature: beyond 1 the yielding surface has folded over."""
        if not law[0] < math.inf:
            return 0.0
        delta, _rate = indentation(law, phi)
        along = (
            n[0] * (n[0] * h[0] + 2.0 * n[1] * h[5])
            + n[1] * (n[1] * h[1] + 2.0 * n[2] * h[3])
            + n[2] * (n[2] * h[2] + 2.0 * n[0] * h[4])
        )
        mean = 0.5 * (h[0] + h[1] + h[2] - along)
        # n' adj(H) n is the Gaussian curvature
        gauss = (
            n[0] * n[0] * (h[1] * h[2] - h[3] * h[3])
            + n[1] * n[1] * (h[0] * h[2] - h[4] * h[4])
            + n[2] * n[2] * (h[0] * h[1] - h[5] * h[5])
            + 2.0 * n[1] * n[2] * (h[4] * h[5] - h[0] * h[3])
            + 2.0 * n[0] * n[2] * (h[3] * h[5] - h[1] * h[4])
            + 2.0 * n[0] * n[1] * (h[3] * h[4] - h[2] * h[5])
        )
        return delta * (mean + math.sqrt(max(mean * mean - gauss, 0.0)))

    @jit
    def system_at(law, f, n, phi, Q, h):
        """Tangent basis, shape operator in it (ee, eg, gg), and phi [n]x (I - delta W) - Q W - ... row by row."""
        # a tangent basis without a branch cut near any axis that matters (Duff et al. 2017)
        sign = math.copysign(1.0, n[2])
        a = -1.0 / (sign + n[2])
        b = n[0] * n[1] * a
        e = (1.0 + sign * n[0] * n[0] * a, sign * b, -sign * n[0])
        g = (b, sign + n[1] * n[1] * a, -n[1])
        he = (
            h[0] * e[0] + h[5] * e[1] + h[4] * e[2],
            h[5] * e[0] + h[1] * e[1] + h[3] * e[2],
            h[4] * e[0] + h[3] * e[1] + h[2] * e[2],
        )
        hg = (
            h[0] * g[0] + h[5] * g[1] + h[4] * g[2],
            h[5] * g[0] + h[1] * g[1] + h[3] * g[2],
            h[4] * g[0] + h[3] * g[1] + h[2] * g[2],
        )
        wee = e[0] * he[0] + e[1] * he[1] + e[2] * he[2]
        weg = e[0] * hg[0] + e[1] * hg[1] + e[2] * hg[2]
        wgg = g[0] * hg[0] + g[1] * hg[1] + g[2] * hg[2]
        # n x e = g, n x g = -e up to the basis' orientation
        ox = e[1] * g[2] - e[2] * g[1]
        oy = e[2] * g[0] - e[0] * g[2]
        oz = e[0] * g[1] - e[1] * g[0]
        side = math.copysign(1.0, ox * n[0] + oy * n[1] + oz * n[2])
        turn = phi * side
        delta, rate = indentation(law, phi)
        fe = f[0] * e[0] + f[1] * e[1] + f[2] * e[2]
        fg = f[0] * g[0] + f[1] * g[1] + f[2] * g[2]
        ae, ag = wee * fe + weg * fg, weg * fe + wgg * fg
        j00 = turn * delta * weg - Q * wee + rate * side * fg * ae
        j01 = -turn * (1.0 - delta * wgg) - Q * weg + rate * side * fg * ag
        j10 = turn * (1.0 - delta * wee) - Q * weg - rate * side * fe * ae
        j11 = -turn * delta * weg - Q * wgg - rate * side * fe * ag
        return e, g, (wee, weg, wgg), (j00, j01, j10, j11)

    @jit
    def solved(j, re, rg):
        """Solve the system for -r."""
        determinant = j[0] * j[3] - j[1] * j[2]
        return -(j[3] * re - j[1] * rg) / determinant, -(j[0] * rg - j[2] * re) / determinant

    @jit
    def step_from(law, f, n, phi, Q, r, h):
        """Newton's step along the surface."""
        e, g, _w, j = system_at(law, f, n, phi, Q, h)
        re = r[0] * e[0] + r[1] * e[1] + r[2] * e[2]
        rg = r[0] * g[0] + r[1] * g[1] + r[2] * g[2]
        de, dg = solved(j, re, rg)
        return de * e[0] + dg * g[0], de * e[1] + dg * g[1], de * e[2] + dg * g[2]

    @jit
    def condition_at(law, f, n, phi, Q, h, c, moment):
        """Frobenius norm of dc/d(f, m), columns in units of |f| = 1 and |m|, over |c|."""
        e, g, w, j = system_at(law, f, n, phi, Q, h)
        delta, rate = indentation(law, phi)
        fe = f[0] * e[0] + f[1] * e[1] + f[2] * e[2]
        fg = f[0] * g[0] + f[1] * g[1] + f[2] * g[2]
        we, wg = w[0] * fe + w[1] * fg, w[1] * fe + w[2] * fg
        total = 0.0
        for k in range(5):  # the moment along e and g, the force along e, g and n
            u = e if k == 2 else (g if k == 3 else n)
            b = (u[1] * c[2] - u[2] * c[1], u[2] * c[0] - u[0] * c[2], u[0] * c[1] - u[1] * c[0])
            if k == 4:
                b = (
                    b[0] - rate * (n[1] * f[2] - n[2] * f[1]),
                    b[1] - rate * (n[2] * f[0] - n[0] * f[2]),
                    b[2] - rate * (n[0] * f[1] - n[1] * f[0]),
                )
            be = b[0] * e[0] + b[1] * e[1] + b[2] * e[2]
            bg = b[0] * g[0] + b[1] * g[1] + b[2] * g[2]
            if k < 2:
                be, bg = (moment, 0.0) if k == 0 else (0.0, moment)
            de, dg = solved(j, be, bg)
            sunk = rate * ((1.0 if k == 4 else 0.0) + we * de + wg * dg)
            ce, cg = de - delta * (w[0] * de + w[1] * dg), dg - delta * (w[1] * de + w[2] * dg)
            total += ce * ce + cg * cg + sunk * sunk
        return math.sqrt(total / (c[0] * c[0] + c[1] * c[1] + c[2] * c[2]))

    @jit
    def newton(p, law, f, m, start):
        """Iterate from a point; returns the last and its relative residual, infinite where the force pulls."""
        c = start
        size = math.sqrt(m[0] * m[0] + m[1] * m[1] + m[2] * m[2])
        spun = f[0] * m[0] + f[1] * m[1] + f[2] * m[2]
        n, phi, Q, r, h = frame_at(p, law, f, m, c)
        error = math.sqrt(r[0] * r[0] + r[1] * r[1] + r[2] * r[2])
        if not softness(law, n, phi, h) < 1.0:
            return c, math.inf
        for _ in range(MAX_STEPS):
            reach = math.sqrt(c[0] * c[0] + c[1] * c[1] + c[2] * c[2])
            if error <= RESIDUAL * (size + reach):
                break
            d = step_from(law, f, n, phi, Q, r, h)
            length = math.sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2])
            if not length < math.inf:
                break
            share = min(1.0, LONGEST_STEP * reach / length) if length > 0.0 else 1.0
            better = False
            new, n2, phi2, Q2, r2, h2, error2 = c, n, phi, Q, r, h, error
            while share >= SMALLEST_SHARE * min(1.0, LONGEST_STEP * reach / max(length, 1e-300)):
                x, y, z = c[0] + share * d[0], c[1] + share * d[1], c[2] + share * d[2]
                t = project(p, x, y, z)
                new = (t * x, t * y, t * z)
                n2, phi2, Q2, r2, h2 = frame_at(p, law, f, m, new)
                error2 = math.sqrt(r2[0] * r2[0] + r2[1] * r2[1] + r2[2] * r2[2])
                pushes = phi2 < 0.0 or Q2 * spun < 0.0
                falls = pushes and error2 < (1.0 - 0.1 * share) * error
                if falls and softness(law, n2, phi2, h2) < 1.0:
                    better = True
                    break
                share *= 0.5
            if not better:
                break
            c, n, phi, Q, r, h, error = new, n2, phi2, Q2, r2, h2, error2
        reach = math.sqrt(c[0] * c[0] + c[1] * c[1] + c[2] * c[2])
        return c, (error / (size + reach) if phi < -MIN_PUSH else math.inf)

    @jit
    def lead(p, law, f, m, start, n, phi, s):
        """Follow the contact while the moment goes from one that the start explains to the measured one."""
        k = s / phi
        delta, _rate = indentation(law, phi)
        x, y, z = start[0] - delta * n[0], start[1] - delta * n[1], start[2] - delta * n[2]
        m0 = (y * f[2] - z * f[1] + k * n[0], z * f[0] - x * f[2] + k * n[1], x * f[1] - y * f[0] + k * n[2])
        c, progress, share, residual = start, 0.0, 0.25, math.inf
        while progress < 1.0:
            ahead = min(1.0, progress + share)
            moment = (
                m0[0] + ahead * (m[0] - m0[0]),
                m0[1] + ahead * (m[1] - m0[1]),
                m0[2] + ahead * (m[2] - m0[2]),
            )
            new, residual = newton(p, law, f, moment, c)
            if residual <= (ACCEPTED if ahead == 1.0 else INTERMEDIATE):
                c, progress, share = new, ahead, 2.0 * share
            else:
                share *= 0.5
                if share < SMALLEST_LEAD:
                    break
        return c, residual

    @jit
    def soften(p, law, f, m, start):
        """Follow the contact from the rigid surface's while the surface becomes as soft as it is."""
        c, progress, share, residual = start, 0.0, 0.25, math.inf
        while progress < 1.0:
            ahead = min(1.0, progress + share)
            # delta is `ahead` times that of the law
            new, residual = newton(p, (law[0] * ahead ** (-1.0 / law[1]), law[1], law[2]), f, m, c)
            if residual <= (ACCEPTED if ahead == 1.0 else INTERMEDIATE):
                c, progress, share = new, ahead, 2.0 * share
            else:
                share *= 0.5
                if share < SMALLEST_LEAD:
                    break
        return c, residual

    @jit
    def along_axis(p, axes, f, m):
        """Where the wrench axis comes in through the surface, and its least value, above zero if it misses."""
        rx, ry, rz = f[1] * m[2] - f[2] * m[1], f[2] * m[0] - f[0] * m[2], f[0] * m[1] - f[1] * m[0]
        # nearest to the centre at r: where it hits, it hits within the tip's size of there
        reach = 2.0 * max(max(axes[0], axes[1]), axes[2])
        low, high = -reach, reach
        golden = 0.5 * (math.sqrt(5.0) - 1.0)
        a, b = high - golden * (high - low), low + golden * (high - low)
        at_a = level(p, rx + a * f[0], ry + a * f[1], rz + a * f[2])[0]
        at_b = level(p, rx + b * f[0], ry + b * f[1], rz + b * f[2])[0]
        for _ in range(80):
            if at_a < at_b:
                high, b, at_b = b, a, at_a
                a = high - golden * (high - low)
                at_a = level(p, rx + a * f[0], ry + a * f[1], rz + a * f[2])[0]
            else:
                low, a, at_a = a, b, at_b
                b = low + golden * (high - low)
                at_b = level(p, rx + b * f[0], ry + b * f[1], rz + b * f[2])[0]
        least, inside, outside = min(at_a, at_b), (a if at_a < at_b else b), -reach
        for _ in range(60):
            t = 0.5 * (inside + outside)
            if level(p, rx + t * f[0], ry + t * f[1], rz + t * f[2])[0] < 0.0:
                inside = t
            else:
                outside = t
        return (rx + inside * f[0], ry + inside * f[1], rz + inside * f[2]), least

    @jit
    def on_ellipsoid(axes, f, m):
        """The contact on the ellipsoid of the same half lengths."""
        a = (m[0] / (axes[1] * axes[2]), m[1] / (axes[0] * axes[2]), m[2] / (axes[0] * axes[1]))
        b = (f[0] / axes[0], f[1] / axes[1], f[2] / axes[2])
        bb = b[0] * b[0] + b[1] * b[1] + b[2] * b[2]
        P = bb - (a[0] * a[0] + a[1] * a[1] + a[2] * a[2])
        Q = 2.0 * (a[0] * b[0] + a[1] * b[1] + a[2] * b[2])
        larger = math.sqrt(0.5 * (math.hypot(P, Q) + abs(P)))
        smaller = 0.5 * abs(Q) / larger if larger > 0.0 else 0.0
        g = -larger if P > 0.0 else -smaller
        k = (smaller if P > 0.0 else larger) * (-1.0 if Q > 0.0 else 1.0)
        x = k * a[0] + g * b[0] + b[1] * a[2] - b[2] * a[1]
        y = k * a[1] + g * b[1] + b[2] * a[0] - b[0] * a[2]
        z = k * a[2] + g * b[2] + b[0] * a[1] - b[1] * a[0]
        scale = 1.0 / (k * k + bb)
        return x * scale * axes[0], y * scale * axes[1], z * scale * axes[2]

    @jit
    def squarely(axes, v, sign):
        """The point at which an ellipsoid's normal is v or its opposite."""
        c = (sign * v[0] * axes[0] ** 2, sign * v[1] * axes[1] ** 2, sign * v[2] * axes[2] ** 2)
        reach = math.sqrt(c[0] ** 2 + c[1] ** 2 + c[2] ** 2)
        size = axes[0] / reach
        return (c[0] * size, c[1] * size, c[2] * size)

    @jit
    def search(p, law, axes, f, m, s, starts):
        """Solve from one start after the other: the ellipsoid's contact, the force, the wrench axis, the moment.

        Returns the last point, its residual, and the least value on the wrench axis where that was looked for.
        """
        c, residual, least = (math.nan, math.nan, math.nan), math.inf, -1.0
        for attempt in range(starts):
            if attempt == 0:
                start = on_ellipsoid(axes, f, m)
            elif attempt == 2:
                start, least = along_axis(p, axes, f, m)
                if least > 0.0:
                    continue
            else:
                start = squarely(axes, f, -1.0) if attempt == 1 else squarely(axes, m, -1.0 if s > 0.0 else 1.0)
            if not (
                math.isfinite(start[0] + start[1] + start[2]) and start[0] ** 2 + start[1] ** 2 + start[2] ** 2
            ):
                continue
            t = project(p, start[0], start[1], start[2])
            start = (t * start[0], t * start[1], t * start[2])
            n, phi, _Q, _r, _h = frame_at(p, law, f, m, start)
            if not (phi < -STARTING_PUSH or (attempt == 2 and phi < 0.0)):
                continue
            c, residual = newton(p, law, f, m, start)
            if not residual <= ACCEPTED and starts > 1:
                c, residual = lead(p, law, f, m, start, n, phi, s)
            if residual <= ACCEPTED:
                break
        return c, residual, least

    @jit
    def solve(p, axes, center, rotation, stiffness, exponent, starts, wrenches, hard, result, status):
        """Solve n wrenches on one surface.

        Args:
            p: Parameters of `evaluate`.
            axes: Half lengths of the starting ellipsoid, shape (3,) [m].
            center: Origin of the surface's frame in the sensor frame, shape (3,) [m].
            rotation: Columns are the surface's axes in sensor coordinates, shape (3, 3).
            stiffness: Of the law delta = (f_n / stiffness)^exponent; infinite for a rigid surface.
            exponent: Of the same law.
            starts: `STARTS`, or 1 for Newton's iteration alone, where others find what that does not.
            wrenches: Shape (n, 6), C order.
            hard: As in `solve_quadric`.
            result: See there.
            status: See there.
        """
        total, stride = len(wrenches), len(result) // 15
        r = rotation
        for i in range(total):
            w = wrenches[i]
            n = c = (math.nan, math.nan, math.nan)
            along = phi = Q = delta = moment = math.nan
            f, law = (math.nan, math.nan, math.nan), (stiffness, exponent, math.nan)
            h = (math.nan, math.nan, math.nan, math.nan, math.nan, math.nan)
            code = _OK
            for j in range(6):
                if not math.isfinite(w[j]):
                    code = _INVALID
            force = math.hypot(math.hypot(w[0], w[1]), w[2])
            for j in range(3):
                result[6 * stride + 3 * i + j] = w[j]
            if code == _INVALID:
                pass
            elif force == 0.0:
                code = _NO_FORCE
            elif not math.isfinite(force):
                code = _INVALID
            if code == _OK:
                f, m = in_tip_frame(w, center, r, force)
                s = f[0] * m[0] + f[1] * m[1] + f[2] * m[2]
                along = s
                law = (stiffness, exponent, force)
                if hard:
                    m = (m[0] - s * f[0], m[1] - s * f[1], m[2] - s * f[2])
                    s = 0.0
                residual, least = math.inf, -1.0
                if math.isfinite(m[0] + m[1] + m[2]):
                    now = law
                    while True:
                        c, residual, least = search(p, now, axes, f, m, s, starts)
                        if residual <= ACCEPTED or now[0] == math.inf:
                            break
                        now = (math.inf, 1.0, force)
                    if now[0] != stiffness:
                        c, residual = soften(p, law, f, m, c)
                code = _NOT_CONVERGED
                if residual <= (ACCEPTED if starts > 1 else MOST_EXACT):
                    n, phi, Q, _rest, h = frame_at(p, law, f, m, c)
                    delta, _rate = indentation(law, phi)
                    if softness(law, n, phi, h) < SOFTEST:
                        code = _OK
                moment = math.sqrt(m[0] * m[0] + m[1] * m[1] + m[2] * m[2])
                if code != _OK and abs(s) <= MIN_SPIN * moment and least > 0.0:
                    code = _NO_CONTACT
            if code == _OK:
                c = (c[0] - delta * n[0], c[1] - delta * n[1], c[2] - delta * n[2])
                push = -phi * force
                spin = along * phi if hard else Q
                condition = condition_at(law, f, n, phi, Q, h, c, moment)
                for j in range(3):
                    nj = r[j, 0] * n[0] + r[j, 1] * n[1] + r[j, 2] * n[2]
                    result[3 * i + j] = center[j] + r[j, 0] * c[0] + r[j, 1] * c[1] + r[j, 2] * c[2]
                    result[3 * (stride + i) + j] = nj
                    result[3 * (3 * stride + i) + j] = w[j] + push * nj
                result[12 * stride + i] = push
                result[13 * stride + i] = spin * force
                result[14 * stride + i] = condition
            else:
                clear_contact(result, stride, i)
            status[i] = code

    return keep_closure(solve, name) if name else solve  # type: ignore[no-any-return]
