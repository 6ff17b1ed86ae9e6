"""All contacts of a wrench on a triangle mesh with interpolated normals, facet by facet, compiled.

On a facet, point and normal are weighted means of the corners' v_i and N_i, and so the balance
m = c x f + lambda N reads sum_i b_i (u_i - lambda N_i) = 0 with u_i = m - v_i x f: the weights b span the null
space of a 3x3 matrix whose determinant is a cubic in lambda. So every contact is found, and no second one missed.

Interpolated normals are those of no smooth surface: where they turn back across a facet, or face the force on a
facet that does not, a wrench may have several contacts. Each is a regular point of m as a function of (b, lambda),
whose orientations add up to one; so a second contact needs a facet that can be turned over, and where none can
there is one. A mesh knows which spin turns which facets over (`palpate.surfaces.mesh.turning`).
"""

import math

import numpy as np

from palpate.compiling import njit
from palpate.sensing.contact import ContactStatus
from palpate.sensing.kernels.contact_rows import clear_contact, in_tip_frame
from palpate.sensing.kernels.implicit import MIN_PUSH
from palpate.surfaces.mesh import HEADER, ROW, facet_on_ray

_OK = int(ContactStatus.OK)
_AMBIGUOUS = int(ContactStatus.AMBIGUOUS)
_NO_CONTACT = int(ContactStatus.NO_CONTACT)
_NOT_CONVERGED = int(ContactStatus.NOT_CONVERGED)

INSIDE = 1e-9
"""Smallest weight of a corner, below zero, of a contact that rounding may have put across an edge."""

SAME = 1e-6
"""Contacts on edges that are nearer than this, relative to the size of the tip, are one found from both sides."""

MARGIN = 4.0
"""By so much more spin over normal force a second contact may have than the first."""


@njit(error_model="numpy")
def _cross(ax, ay, az, bx, by, bz):
    return ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx


@njit(error_model="numpy")
def _determinant(a, b, c):
    x, y, z = _cross(b[0], b[1], b[2], c[0], c[1], c[2])
    return a[0] * x + a[1] * y + a[2] * z


@njit(error_model="numpy")
def _corner(p, row, i, f, m):
    """Return u_i = m - v_i x f, N_i and f.N_i of a corner."""
    v = row + 3 * i
    x, y, z = _cross(p[v], p[v + 1], p[v + 2], f[0], f[1], f[2])
    nx, ny, nz = p[v + 9], p[v + 10], p[v + 11]
    return (m[0] - x, m[1] - y, m[2] - z), (nx, ny, nz), nx * f[0] + ny * f[1] + nz * f[2]


@njit(error_model="numpy")
def _apart(low, high, u, n):
    """Whether the three u_i - lambda N_i lie on one side of a coordinate plane, for every lambda between."""
    for k in range(3):
        least, most = math.inf, -math.inf
        for i in range(3):
            a, b = u[i][k] - low * n[i][k], u[i][k] - high * n[i][k]
            least, most = min(least, min(a, b)), max(most, max(a, b))
        if least > 0.0 or most < 0.0:
            return True
    return False


@njit(error_model="numpy")
def _root_between(a0, a1, a2, a3, low, high, at_low, at_high):
    """Return the root of a cubic between two places of different sign: Newton between brackets."""
    t = 0.5 * (low + high)
    for _ in range(80):
        value = ((a3 * t + a2) * t + a1) * t + a0
        if value == 0.0:
            break
        if (value > 0.0) == (at_high > 0.0):
            high = t
        else:
            low = t
        slope = (3.0 * a3 * t + 2.0 * a2) * t + a1
        new = t - value / slope if slope != 0.0 else math.inf
        if not low < new < high:
            new = 0.5 * (low + high)
        if abs(new - t) <= 1e-16 * abs(t):
            break
        t = new
    return t


@njit(error_model="numpy")
def _weights(u, n, t):
    """Return corner weights of sum 1 that solve sum_i b_i (u_i - t N_i) = 0: across two of the three rows."""
    best, b0, b1, b2 = 0.0, math.nan, math.nan, math.nan
    for k in range(3):
        i, j = (k + 1) % 3, (k + 2) % 3
        x, y, z = _cross(
            u[0][i] - t * n[0][i], u[1][i] - t * n[1][i], u[2][i] - t * n[2][i],
            u[0][j] - t * n[0][j], u[1][j] - t * n[1][j], u[2][j] - t * n[2][j],
        )  # fmt: skip
        total = x + y + z
        if abs(x) + abs(y) + abs(z) > best and total != 0.0:
            best = abs(x) + abs(y) + abs(z)
            b0, b1, b2 = x / total, y / total, z / total
    return b0, b1, b2


@njit(error_model="numpy")
def _refined(u, n, b1, b2, t):
    """Newton's step on sum_i b_i (u_i - t N_i) = 0 for weights and t; also the matrix's determinant."""
    b0 = 1.0 - b1 - b2
    rest = (
        b0 * (u[0][0] - t * n[0][0]) + b1 * (u[1][0] - t * n[1][0]) + b2 * (u[2][0] - t * n[2][0]),
        b0 * (u[0][1] - t * n[0][1]) + b1 * (u[1][1] - t * n[1][1]) + b2 * (u[2][1] - t * n[2][1]),
        b0 * (u[0][2] - t * n[0][2]) + b1 * (u[1][2] - t * n[1][2]) + b2 * (u[2][2] - t * n[2][2]),
    )
    d1 = (
        u[1][0] - u[0][0] - t * (n[1][0] - n[0][0]),
        u[1][1] - u[0][1] - t * (n[1][1] - n[0][1]),
        u[1][2] - u[0][2] - t * (n[1][2] - n[0][2]),
    )
    d2 = (
        u[2][0] - u[0][0] - t * (n[2][0] - n[0][0]),
        u[2][1] - u[0][1] - t * (n[2][1] - n[0][1]),
        u[2][2] - u[0][2] - t * (n[2][2] - n[0][2]),
    )
    e = (
        -(b0 * n[0][0] + b1 * n[1][0] + b2 * n[2][0]),
        -(b0 * n[0][1] + b1 * n[1][1] + b2 * n[2][1]),
        -(b0 * n[0][2] + b1 * n[1][2] + b2 * n[2][2]),
    )
    whole = _determinant(d1, d2, e)
    s1, s2, st = (
        _determinant(rest, d2, e) / whole,
        _determinant(d1, rest, e) / whole,
        _determinant(d1, d2, rest) / whole,
    )
    return b1 - s1, b2 - s2, t - st, whole


@njit(error_model="numpy")
def _on_facet(p, facet, f, m, s, found):
    """Write the pushing contacts on a facet as rows (b0, b1, b2, lambda); returns how many, at most 3."""
    row = HEADER + ROW * facet
    u0, n0, phi0 = _corner(p, row, 0, f, m)
    u1, n1, phi1 = _corner(p, row, 1, f, m)
    u2, n2, phi2 = _corner(p, row, 2, f, m)
    least, most = min(min(phi0, phi1), phi2), max(max(phi0, phi1), phi2)
    if least >= 0.0:
        return 0
    u, n = (u0, u1, u2), (n0, n1, n2)
    # lambda = s / f.N, which lies between the corners'; what the moment can hold bounds it where that is zero
    one = s / least
    moment = math.sqrt(m[0] * m[0] + m[1] * m[1] + m[2] * m[2])
    other = math.copysign(min(4.0 * (moment + p[1]), abs(s) / MIN_PUSH), -s)
    if most < 0.0 and abs(s / most) < abs(other):
        other = s / most
    room = 1e-9 * (abs(one) + p[1])
    low, high = min(one, other) - room, max(one, other) + room
    if _apart(low, high, u, n):
        return 0
    a0 = _determinant(u0, u1, u2)
    a1 = -(_determinant(n0, u1, u2) + _determinant(u0, n1, u2) + _determinant(u0, u1, n2))
    a2 = _determinant(u0, n1, n2) + _determinant(n0, u1, n2) + _determinant(n0, n1, u2)
    a3 = -_determinant(n0, n1, n2)
    # the cubic between its extrema
    stops = np.empty(4)
    stops[0], count = low, 1
    square = a2 * a2 - 3.0 * a3 * a1
    if square > 0.0:
        half = -(a2 + math.copysign(math.sqrt(square), a2))
        first, second = (half / (3.0 * a3) if a3 != 0.0 else math.inf), (a1 / half if half != 0.0 else math.inf)
        for stop in (min(first, second), max(first, second)):
            if low < stop < high:
                stops[count] = stop
                count += 1
    stops[count] = high
    total = 0
    for k in range(count):
        start, end = stops[k], stops[k + 1]
        at_start = ((a3 * start + a2) * start + a1) * start + a0
        at_end = ((a3 * end + a2) * end + a1) * end + a0
        if (at_start > 0.0) == (at_end > 0.0):
            continue
        t = _root_between(a0, a1, a2, a3, start, end, at_start, at_end)
        b0, b1, b2 = _weights(u, n, t)
        if not min(min(b0, b1), b2) >= -1e-3:
            continue
        for _ in range(3):
            b1, b2, t, _whole = _refined(u, n, b1, b2, t)
        b0 = 1.0 - b1 - b2
        phi = b0 * phi0 + b1 * phi1 + b2 * phi2
        if min(min(b0, b1), b2) >= -INSIDE and phi < -MIN_PUSH and total < 3:
            found[total, 0], found[total, 1], found[total, 2], found[total, 3] = b0, b1, b2, t
            total += 1
    return total


@njit(error_model="numpy")
def _mean(p, facet, first, b0, b1, b2):
    """Return the weighted mean of the corners' positions (first = 0) or normals (first = 9)."""
    r = HEADER + ROW * facet + first
    return (
        b0 * p[r] + b1 * p[r + 3] + b2 * p[r + 6],
        b0 * p[r + 1] + b1 * p[r + 4] + b2 * p[r + 7],
        b0 * p[r + 2] + b1 * p[r + 5] + b2 * p[r + 8],
    )


@njit(error_model="numpy")
def _look(p, facets, f, m, s, known, found):
    """Look on facets for contacts other than a known one.

    Args:
        p: The packed mesh.
        facets: Where to look.
        f: Unit force.
        m: Moment per force [m].
        s: f.m.
        known: Facet, weights and lambda of one that is known, facet -1 for none; improved if it lies on an edge.
        found: Scratch, shape (3, 4).

    Returns:
        How many there are, 2 for several.
    """
    count = 1 if known[0] >= 0.0 else 0
    for facet in facets:
        for k in range(_on_facet(p, facet, f, m, s, found)):
            least = min(min(found[k, 0], found[k, 1]), found[k, 2])
            if count > 0:
                own = min(min(known[1], known[2]), known[3])
                x, y, z = _mean(p, facet, 0, found[k, 0], found[k, 1], found[k, 2])
                kx, ky, kz = _mean(p, int(known[0]), 0, known[1], known[2], known[3])
                apart = math.sqrt((x - kx) ** 2 + (y - ky) ** 2 + (z - kz) ** 2)
                edge = 1e3 * INSIDE
                if not (apart <= SAME * p[1] and (int(known[0]) == facet or (least < edge and own < edge))):
                    return 2
                if least <= own:
                    continue
            count = 1
            known[0] = facet
            for j in range(4):
                known[j + 1] = found[k, j]
    return count


@njit(error_model="numpy")
def _condition(p, known, f, m, c):
    """Return the condition at a contact, see `palpate.sensing.solver`, and whether it is turned over."""
    row = HEADER + ROW * int(known[0])
    u0, n0, _ = _corner(p, row, 0, f, m)
    u1, n1, _ = _corner(p, row, 1, f, m)
    u2, n2, _ = _corner(p, row, 2, f, m)
    t = known[4]
    b0, b1, b2 = known[1], known[2], known[3]
    g1 = (
        u1[0] - u0[0] - t * (n1[0] - n0[0]),
        u1[1] - u0[1] - t * (n1[1] - n0[1]),
        u1[2] - u0[2] - t * (n1[2] - n0[2]),
    )
    g2 = (
        u2[0] - u0[0] - t * (n2[0] - n0[0]),
        u2[1] - u0[1] - t * (n2[1] - n0[1]),
        u2[2] - u0[2] - t * (n2[2] - n0[2]),
    )
    g3 = (
        b0 * n0[0] + b1 * n1[0] + b2 * n2[0],
        b0 * n0[1] + b1 * n1[1] + b2 * n2[1],
        b0 * n0[2] + b1 * n1[2] + b2 * n2[2],
    )
    whole = _determinant(g1, g2, g3)
    r1x, r1y, r1z = _cross(g2[0], g2[1], g2[2], g3[0], g3[1], g3[2])
    r2x, r2y, r2z = _cross(g3[0], g3[1], g3[2], g1[0], g1[1], g1[2])
    moment = math.sqrt(m[0] * m[0] + m[1] * m[1] + m[2] * m[2])
    total = 0.0
    for k in range(3):
        ex, ey, ez = 1.0 * (k == 0), 1.0 * (k == 1), 1.0 * (k == 2)
        fx, fy, fz = _cross(c[0], c[1], c[2], ex, ey, ez)
        for part in range(2):
            x, y, z = (ex * moment, ey * moment, ez * moment) if part == 0 else (fx, fy, fz)
            d1, d2 = (r1x * x + r1y * y + r1z * z) / whole, (r2x * x + r2y * y + r2z * z) / whole
            for j in range(3):
                total += (d1 * (p[row + 3 + j] - p[row + j]) + d2 * (p[row + 6 + j] - p[row + j])) ** 2
    # without spin a facet that the force meets from outside has this orientation
    return math.sqrt(total / (c[0] * c[0] + c[1] * c[1] + c[2] * c[2])), whole < 0.0


@njit(error_model="numpy", cache=True)
def vouch(p, order, spins, center, rotation, wrenches, hard, result, status):
    """Check contacts found on a mesh, find those that were not, and mark those that are not the only one.

    Args:
        p: The packed mesh.
        order: Facets, first those that the least spin turns over.
        spins: That spin over normal force, in the same order [m].
        center: Origin of the mesh's frame in the sensor frame, shape (3,) [m].
        rotation: Columns are the mesh's axes in sensor coordinates, shape (3, 3).
        wrenches: Shape (n, 6), C order; the others are as in `palpate.sensing.kernels.quadric.solve_quadric`.
        hard: See there.
        result: See there.
        status: See there.
    """
    total, stride = len(wrenches), len(result) // 15
    found, known = np.empty((3, 4)), np.empty(5)
    r = rotation
    for i in range(total):
        if status[i] != _OK and status[i] != _NO_CONTACT and status[i] != _NOT_CONVERGED:
            continue
        w = wrenches[i]
        force = math.sqrt(w[0] * w[0] + w[1] * w[1] + w[2] * w[2])
        f, m = in_tip_frame(w, center, r, force)
        s = f[0] * m[0] + f[1] * m[1] + f[2] * m[2]
        along = s
        if hard:
            m = (m[0] - s * f[0], m[1] - s * f[1], m[2] - s * f[2])
            s = 0.0
        known[0], count, certain = -1.0, 0, False
        if status[i] == _OK:
            x, y, z = result[3 * i] - center[0], result[3 * i + 1] - center[1], result[3 * i + 2] - center[2]
            cx = r[0, 0] * x + r[1, 0] * y + r[2, 0] * z
            cy = r[0, 1] * x + r[1, 1] * y + r[2, 1] * z
            cz = r[0, 2] * x + r[1, 2] * y + r[2, 2] * z
            facet, b0, b1, b2 = facet_on_ray(p, cx, cy, cz)
            vx, vy, vz = _mean(p, facet, 9, b0, b1, b2)
            known[0], known[1], known[2], known[3] = facet, b0, b1, b2
            known[4] = result[13 * stride + i] / force / math.sqrt(vx * vx + vy * vy + vz * vz)
            if hard:
                known[4] = 0.0
            push = result[12 * stride + i] / force
            condition, over = _condition(p, known, f, m, (cx, cy, cz))
            if not over and push > p[2]:
                turned = np.searchsorted(spins, MARGIN * abs(s) / (push * push))
                if turned == 0:
                    result[14 * stride + i] = condition
                    continue
                count = _look(p, order[:turned], f, m, s, known, found)
                certain = True
        if not certain:
            known[0] = -1.0
            count = _look(p, order, f, m, s, known, found)
        if count == 1:
            b0, b1, b2, t = known[1], known[2], known[3], known[4]
            c = _mean(p, int(known[0]), 0, b0, b1, b2)
            v = _mean(p, int(known[0]), 9, b0, b1, b2)
            length = math.sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2])
            phi = (f[0] * v[0] + f[1] * v[1] + f[2] * v[2]) / length
            condition, _over = _condition(p, known, f, m, c)
            push = -phi * force
            for j in range(3):
                nj = (r[j, 0] * v[0] + r[j, 1] * v[1] + r[j, 2] * v[2]) / length
                result[3 * i + j] = center[j] + r[j, 0] * c[0] + r[j, 1] * c[1] + r[j, 2] * c[2]
                result[3 * (stride + i) + j] = nj
                result[3 * (3 * stride + i) + j] = w[j] + push * nj
            result[12 * stride + i] = push
            result[13 * stride + i] = (along * phi if hard else t * length) * force
            result[14 * stride + i] = condition
            status[i] = _OK
        elif count == 2:
            clear_contact(result, stride, i)
            status[i] = _AMBIGUOUS
        elif status[i] == _OK:  # nothing found again: rounding at the limit of what can be resolved
            clear_contact(result, stride, i)
            status[i] = _NOT_CONVERGED
