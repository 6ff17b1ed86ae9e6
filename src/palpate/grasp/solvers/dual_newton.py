"""Least effort by semismooth Newton steps on the six multipliers of equilibrium, compiled.

    minimise  sum (f_i + d_i)^2 + eps |u_i|^2   with   |u_i| <= mu_i f_i,   lo_i <= f_i <= hi_i,   A x + b = 0,

u = (f_t1, f_t2, tau / e); d_i is what is kept in reserve of each normal force (its wrench is a part of b). Only
equilibrium gets multipliers, y in R^6. Given y, what each contact does is known in closed form: it presses freely,
lies on its cone, is held at a bound, or rests at the apex. So the dual function, its gradient A x + b and its
generalised Hessian are sums over contacts: cost is linear in their number, and a warm start is six numbers. The
least-violation problem is the same function with kappa / 2 |y - y0|^2 added: at its minimum A x + b is
kappa (y - y0).
"""

import math
from typing import Any

from palpate.compiling import njit

P, N, T1, T2, E, MU, LO, HI, RESERVE, ROW = 0, 3, 6, 9, 12, 13, 14, 15, 16, 17
"""Columns of a contact: place, normal, tangents (scaled, object frame), e, mu, bounds of f, d; their number."""

FARKAS = 6
"""Place in the gradient's array of the least of y . (A x + b) over all x within the limits: above 0 nothing
holds."""

ROUNDING = 4e-15
"""What rounding may do to y . (column of A), over the sum of |y|: taken off before anything is called proven."""

ENDLESS = 1e8
"""Infeasible means: not with forces of so many times the load either, where a contact has no largest force."""

ARMIJO = 1e-4
"""Share of the predicted decrease that a step must achieve (Armijo)."""

SHORT = 0.6
"""Share of a step below which the next is damped: beyond a kink the Hessian promises too much. Without damping one
cold start in six of two fingers was given up, with it none of 343."""

DAMPING, MORE, LESS = 0.01, 8.0, 0.01
"""Added to the diagonal, over the trace, after a short step; its factors after another and after a full one."""

MIN_STEP = 1e-10
"""Shorter steps mean that rounding rules."""


@njit(cache=True, error_model="numpy")
def evaluate(
    contacts: Any,
    load: Any,
    eps: float,
    kappa: float,
    center: Any,
    y: Any,
    forces: Any,
    gradient: Any,
    hessian: Any,
) -> float:
    """Return minus the dual function at y; fill forces (n, 4), gradient with `FARKAS` (7,), lower Hessian."""
    value = 0.0
    fx, fy, fz, mx, my, mz = load[0], load[1], load[2], load[3], load[4], load[5]
    y0, y1, y2, y3, y4, y5 = y[0], y[1], y[2], y[3], y[4], y[5]
    value += y0 * fx + y1 * fy + y2 * fz + y3 * mx + y4 * my + y5 * mz
    farkas = value
    doubt = ROUNDING * (abs(y0) + abs(y1) + abs(y2) + abs(y3) + abs(y4) + abs(y5))
    for i in range(6):
        for j in range(i + 1):
            hessian[i, j] = 0.0
    for i in range(contacts.shape[0]):
        c = contacts[i]
        px, py, pz, nx, ny, nz = c[0], c[1], c[2], c[3], c[4], c[5]
        e, mu, lo, hi, reserve = c[12], c[13], c[14], c[15], c[16]
        vx, vy, vz = y0 + y4 * pz - y5 * py, y1 + y5 * px - y3 * pz, y2 + y3 * py - y4 * px
        gn = nx * vx + ny * vy + nz * vz
        g1 = c[6] * vx + c[7] * vy + c[8] * vz
        g2 = c[9] * vx + c[10] * vy + c[11] * vz
        g3 = e * (nx * y3 + ny * y4 + nz * y5)
        r = math.sqrt(g1 * g1 + g2 * g2 + g3 * g3)
        worst = gn - mu * r - doubt * (1.0 + mu)
        farkas += worst * (lo if worst > 0.0 else min(hi, ENDLESS))
        gn += 2.0 * reserve
        # f alone; on the cone where friction would not do for the u that is wanted
        wanted = 0.5 * r / eps
        f = -0.5 * gn
        if mu * f < wanted:
            f = 0.5 * (mu * r - gn) / (1.0 + eps * mu * mu)
        held = not lo < f < hi
        f = min(max(f, lo), hi)
        sliding = mu * f < wanted
        s = mu * f if sliding else wanted
        value += f * f + eps * s * s + gn * f - r * s + reserve * reserve
        if s > 0.0:
            along = -s / r
            u1, u2, u3 = along * g1, along * g2, along * g3
        else:
            u1, u2, u3 = 0.0, 0.0, 0.0
        forces[i, 0], forces[i, 1], forces[i, 2], forces[i, 3] = f, u1, u2, u3
        wx = f * nx + u1 * c[6] + u2 * c[9]
        wy = f * ny + u1 * c[7] + u2 * c[10]
        wz = f * nz + u1 * c[8] + u2 * c[11]
        fx += wx
        fy += wy
        fz += wz
        mx += py * wz - pz * wy + e * u3 * nx
        my += pz * wx - px * wz + e * u3 * ny
        mz += px * wy - py * wx + e * u3 * nz
        if held and s <= 0.0:
            continue  # at the apex, or pressing without friction: a change of y moves nothing
        kx, ky, kz = py * nz - pz * ny, pz * nx - px * nz, px * ny - py * nx
        if s > 0.0:
            # d: the direction of u as a wrench
            d1, d2, d3 = u1 / s, u2 / s, u3 / s
            dx = d1 * c[6] + d2 * c[9]
            dy = d1 * c[7] + d2 * c[10]
            dz = d1 * c[8] + d2 * c[11]
            ex = py * dz - pz * dy + e * d3 * nx
            ey = pz * dx - px * dz + e * d3 * ny
            ez = px * dy - py * dx + e * d3 * nz
        else:
            dx = dy = dz = ex = ey = ez = 0.0
        if sliding:
            beta = s / r
            minus = beta
            alpha, slope = (0.0 if held else 0.5 / (1.0 + eps * mu * mu)), mu
        else:
            beta = 0.5 / eps
            minus = 0.0
            alpha, slope = (0.0 if held else 0.5), 0.0
        ax, ay, az = nx + slope * dx, ny + slope * dy, nz + slope * dz
        bx, by, bz = kx + slope * ex, ky + slope * ey, kz + slope * ez
        pp = px * px + py * py + pz * pz
        ee = e * e
        # alpha a a' + beta A_u A_u' - minus d d'; A_u A_u' = [[I - n n', .], [P - k n', P P' - k k' + e^2 n n']]
        hessian[0, 0] += alpha * ax * ax + beta * (1.0 - nx * nx) - minus * dx * dx
        hessian[1, 0] += alpha * ay * ax - beta * ny * nx - minus * dy * dx
        hessian[1, 1] += alpha * ay * ay + beta * (1.0 - ny * ny) - minus * dy * dy
        hessian[2, 0] += alpha * az * ax - beta * nz * nx - minus * dz * dx
        hessian[2, 1] += alpha * az * ay - beta * nz * ny - minus * dz * dy
        hessian[2, 2] += alpha * az * az + beta * (1.0 - nz * nz) - minus * dz * dz
        hessian[3, 0] += alpha * bx * ax - beta * kx * nx - minus * ex * dx
        hessian[3, 1] += alpha * bx * ay - beta * (pz + kx * ny) - minus * ex * dy
        hessian[3, 2] += alpha * bx * az + beta * (py - kx * nz) - minus * ex * dz
        hessian[4, 0] += alpha * by * ax + beta * (pz - ky * nx) - minus * ey * dx
        hessian[4, 1] += alpha * by * ay - beta * ky * ny - minus * ey * dy
        hessian[4, 2] += alpha * by * az - beta * (px + ky * nz) - minus * ey * dz
        hessian[5, 0] += alpha * bz * ax - beta * (py + kz * nx) - minus * ez * dx
        hessian[5, 1] += alpha * bz * ay + beta * (px - kz * ny) - minus * ez * dy
        hessian[5, 2] += alpha * bz * az - beta * kz * nz - minus * ez * dz
        hessian[3, 3] += alpha * bx * bx + beta * (pp - px * px - kx * kx + ee * nx * nx) - minus * ex * ex
        hessian[4, 3] += alpha * by * bx + beta * (-py * px - ky * kx + ee * ny * nx) - minus * ey * ex
        hessian[4, 4] += alpha * by * by + beta * (pp - py * py - ky * ky + ee * ny * ny) - minus * ey * ey
        hessian[5, 3] += alpha * bz * bx + beta * (-pz * px - kz * kx + ee * nz * nx) - minus * ez * ex
        hessian[5, 4] += alpha * bz * by + beta * (-pz * py - kz * ky + ee * nz * ny) - minus * ez * ey
        hessian[5, 5] += alpha * bz * bz + beta * (pp - pz * pz - kz * kz + ee * nz * nz) - minus * ez * ez
    gradient[0], gradient[1], gradient[2], gradient[3], gradient[4], gradient[5] = -fx, -fy, -fz, -mx, -my, -mz
    gradient[FARKAS] = farkas
    value = -value
    if kappa > 0.0:
        for i in range(6):
            away = y[i] - center[i]
            value += 0.5 * kappa * away * away
            gradient[i] += kappa * away
            hessian[i, i] += kappa
    return value  # type: ignore[no-any-return]


@njit(cache=True, error_model="numpy")
def newton_step(hessian: Any, gradient: Any, shift: float, factor: Any, step: Any) -> bool:
    """Fill step (6,) = -(H + shift I)^-1 gradient by Cholesky's method; return whether all pivots are positive."""
    for j in range(6):
        pivot = hessian[j, j] + shift
        for k in range(j):
            pivot -= factor[j, k] * factor[j, k]
        if not pivot > 0.0:
            return False
        pivot = math.sqrt(pivot)
        factor[j, j] = pivot
        for i in range(j + 1, 6):
            left = hessian[i, j]
            for k in range(j):
                left -= factor[i, k] * factor[j, k]
            factor[i, j] = left / pivot
    for i in range(6):
        right = -gradient[i]
        for k in range(i):
            right -= factor[i, k] * step[k]
        step[i] = right / factor[i, i]
    for i in range(5, -1, -1):
        right = step[i]
        for k in range(i + 1, 6):
            right -= factor[k, i] * step[k]
        step[i] = right / factor[i, i]
    return True


@njit(cache=True, error_model="numpy")
def descend(
    contacts: Any,
    load: Any,
    eps: float,
    kappa: float,
    center: Any,
    tolerance: float,
    most: int,
    y: Any,
    forces: Any,
    work: Any,
) -> tuple[int, float]:
    """Move y (6,) to the minimum; return evaluations used (negative: short of it) and the largest gradient entry.

    It ends early where y proves that nothing holds. `work` is (15, 7): Hessian, factor, gradient (row 12), step,
    trial. `forces` (n, 4) are those at y.
    """
    hessian, factor = work[0:6], work[6:12]
    gradient, step, trial = work[12], work[13], work[14]
    value = evaluate(contacts, load, eps, kappa, center, y, forces, gradient, hessian)
    used = 1
    damping = 0.0
    while True:
        size = 0.0
        for i in range(6):
            size = max(size, abs(gradient[i]))
        if size <= tolerance:
            return used, size
        if used >= most or (kappa == 0.0 and gradient[FARKAS] > 0.0):
            return -used, size
        trace = 0.0
        for i in range(6):
            trace += hessian[i, i]
        shift = 1e-14 * trace + 1e-300 if trace > 0.0 else 1.0
        shift += (min(1e-6, size * size) + damping) * trace
        while not newton_step(hessian, gradient, shift, factor, step):
            shift = 16.0 * shift
        slope = 0.0
        for i in range(6):
            slope += gradient[i] * step[i]
        length, found = 1.0, value
        better = False
        while used < most and length > MIN_STEP:
            for i in range(6):
                trial[i] = y[i] + length * step[i]
            found = evaluate(contacts, load, eps, kappa, center, trial, forces, gradient, hessian)
            used += 1
            # near the minimum differences of values are rounding: then the slope at the end decides
            after = 0.0
            for i in range(6):
                after += gradient[i] * step[i]
            if found <= value + ARMIJO * length * slope or (
                abs(after) <= 0.9 * abs(slope) and found <= value + 1e-14 * abs(value)
            ):
                better = True
                break
            # the parabola through value, slope and the value found
            below = found - value - length * slope
            length *= min(max(-0.5 * length * slope / below, 0.1), 0.5) if below > 0.0 else 0.5
        if not better:
            found = evaluate(contacts, load, eps, kappa, center, y, forces, gradient, hessian)
            size = 0.0
            for i in range(6):
                size = max(size, abs(gradient[i]))
            return -used, size
        for i in range(6):
            y[i] = trial[i]
        value = found
        if length < SHORT:
            damping = max(MORE * damping, DAMPING)
        elif length == 1.0:
            damping *= LESS
