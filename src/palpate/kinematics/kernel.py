"""Inner loops of arm kinematics, compiled: numba, no Python objects.

One file on purpose: numba's cache looks at the file of a cached function only, not at what it inlines from others.

A chain is packed into one array: 5 numbers per joint (a, d, cos alpha, sin alpha, offset), then the poses
robot base in base and tip in flange, 12 numbers each (position, rotation by rows).
"""

import math

import numpy as np

from palpate.compiling import njit

JOINT = 5
"""Numbers per joint in a packed chain."""

POSE = 12
"""Numbers per pose."""

_MAX_SWEEPS = 30
"""Of Jacobi's method; 5 to 8 are usual."""

_ORTHOGONAL = 1e-15
"""Cosine of the angle between rows that counts as a right one."""

_NEGLIGIBLE = 1e-32
"""Inner product of rows, relative to the square of the matrix, that is rounding."""

UNLIMITED, SPEED, POSITION, INVALID = 0.0, 1.0, 2.0, 3.0
"""What scaled a motion: see `palpate.kinematics.velocity.Limit`."""


@njit(error_model="numpy")
def _times(frame, position, rotation):
    """Return frame times (position, rotation), both as flat arrays of 12."""
    out = np.empty(12)
    for i in range(3):
        r0, r1, r2 = frame[3 + 3 * i], frame[4 + 3 * i], frame[5 + 3 * i]
        out[i] = frame[i] + r0 * position[0] + r1 * position[1] + r2 * position[2]
        for j in range(3):
            out[3 + 3 * i + j] = r0 * rotation[j] + r1 * rotation[3 + j] + r2 * rotation[6 + j]
    return out


@njit(error_model="numpy")
def _frames(chain, q, axes, origins):
    """Return the tip's frame; write each joint's axis and a point on it, base coordinates, shape (n, 3)."""
    n = len(q)
    f = chain[JOINT * n : JOINT * n + POSE].copy()
    for k in range(n):
        a, d, ca, sa, offset = chain[5 * k], chain[5 * k + 1], chain[5 * k + 2], chain[5 * k + 3], chain[5 * k + 4]
        c, s = math.cos(q[k] + offset), math.sin(q[k] + offset)
        for i in range(3):
            x, y, z = f[3 + 3 * i], f[4 + 3 * i], f[5 + 3 * i]
            axes[k, i], origins[k, i] = z, f[i]
            turned_x, turned_y = c * x + s * y, c * y - s * x
            f[i] += d * z + a * turned_x
            f[3 + 3 * i] = turned_x
            f[4 + 3 * i] = ca * turned_y + sa * z
            f[5 + 3 * i] = ca * z - sa * turned_y
    last = JOINT * n + POSE
    return _times(f, chain[last : last + 3], chain[last + 3 : last + 12])


@njit(error_model="numpy")
def _columns(frame, axes, origins, jacobian):
    """Write the geometric Jacobian, shape (6, n): velocity of the tip's origin, then angular velocity."""
    for k in range(len(axes)):
        zx, zy, zz = axes[k, 0], axes[k, 1], axes[k, 2]
        x, y, z = frame[0] - origins[k, 0], frame[1] - origins[k, 1], frame[2] - origins[k, 2]
        jacobian[0, k] = zy * z - zz * y
        jacobian[1, k] = zz * x - zx * z
        jacobian[2, k] = zx * y - zy * x
        jacobian[3, k], jacobian[4, k], jacobian[5, k] = zx, zy, zz


@njit(error_model="numpy", cache=True)
def tip_frame(chain, q):
    """Return the tip's frame in the base as a flat array of 12: position, rotation by rows."""
    n = len(q)
    return _frames(chain, q, np.empty((n, 3)), np.empty((n, 3)))


@njit(error_model="numpy", cache=True)
def tip_jacobian(chain, q):
    """Return the geometric Jacobian in the base, shape (6, n)."""
    n = len(q)
    axes, origins, jacobian = np.empty((n, 3)), np.empty((n, 3)), np.empty((6, n))
    _columns(_frames(chain, q, axes, origins), axes, origins, jacobian)
    return jacobian


@njit(error_model="numpy")
def _orthogonalise(rows, n):
    """Turn the rows among themselves until their first n columns are orthogonal (one-sided Jacobi, Hestenes 1958).

    The first n columns hold a matrix A, the others follow along: with the identity there, A = U S V' leaves S V'
    on the left and U' on the right; small singular values come out as accurately as large ones.
    """
    total = 0.0
    for i in range(6):
        for k in range(n):
            total += rows[i, k] * rows[i, k]
    for _ in range(_MAX_SWEEPS):
        turned = False
        for i in range(5):
            for j in range(i + 1, 6):
                ii, jj, ij = 0.0, 0.0, 0.0
                for k in range(n):
                    ii += rows[i, k] * rows[i, k]
                    jj += rows[j, k] * rows[j, k]
                    ij += rows[i, k] * rows[j, k]
                if abs(ij) <= _ORTHOGONAL * math.sqrt(ii * jj) or abs(ij) <= _NEGLIGIBLE * total:
                    continue
                turned = True
                cotangent = (jj - ii) / (2.0 * ij)
                t = math.copysign(1.0 / (abs(cotangent) + math.sqrt(1.0 + cotangent * cotangent)), cotangent)
                c = 1.0 / math.sqrt(1.0 + t * t)
                s = c * t
                for k in range(rows.shape[1]):
                    x, y = rows[i, k], rows[j, k]
                    rows[i, k], rows[j, k] = c * x - s * y, s * x + c * y
        if not turned:
            return


@njit(error_model="numpy")
def _curvature(direction, frame, axes, origins, jacobian, u, length):
    """Return how the tip bends towards u while the joints move straight along `direction`: u . (dJ/dt) direction.

    With J in units of `length`. The tip moves by sigma s u + s^2/2 curvature u, so that sigma grows by it.
    """
    n = len(direction)
    px, py, pz = 0.0, 0.0, 0.0
    for k in range(n):
        px += jacobian[0, k] * direction[k]
        py += jacobian[1, k] * direction[k]
        pz += jacobian[2, k] * direction[k]
    result, wx, wy, wz, vx, vy, vz = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for k in range(n):
        if k > 0:  # velocity of this joint's origin: the last joint's, and what the link between them turns
            x, y, z = (
                origins[k, 0] - origins[k - 1, 0],
                origins[k, 1] - origins[k - 1, 1],
                origins[k, 2] - origins[k - 1, 2],
            )
            vx, vy, vz = vx + wy * z - wz * y, vy + wz * x - wx * z, vz + wx * y - wy * x
        zx, zy, zz = axes[k, 0], axes[k, 1], axes[k, 2]
        ax, ay, az = wy * zz - wz * zy, wz * zx - wx * zz, wx * zy - wy * zx  # the axis' own rate
        x, y, z = frame[0] - origins[k, 0], frame[1] - origins[k, 1], frame[2] - origins[k, 2]
        dx, dy, dz = px - vx, py - vy, pz - vz
        bx = ay * z - az * y + zy * dz - zz * dy
        by = az * x - ax * z + zz * dx - zx * dz
        bz = ax * y - ay * x + zx * dy - zy * dx
        along = (u[0] * bx + u[1] * by + u[2] * bz) / length + u[3] * ax + u[4] * ay + u[5] * az
        result += direction[k] * along
        wx, wy, wz = wx + zx * direction[k], wy + zy * direction[k], wz + zz * direction[k]
    return result


@njit(error_model="numpy", cache=True)
def joint_motion(chain, bounds, settings, q, twist):
    """Return frame (12), joint velocities (n), realised twist (6), scale, smallest singular value, limit, joint.

    The method and its terms are those of `palpate.kinematics.velocity`.

    Args:
        chain: See above.
        bounds: Rows lower, upper [rad], speed [rad/s], shape (3, n).
        settings: length [m], threshold, floor, bend, braking rate [1/s].
        q: Joint angles [rad], shape (n,).
        twist: Wanted (v, w) of the tip in the base, shape (6,).
    """
    n = len(q)
    length, threshold, floor, bend, braking = settings
    out = np.zeros(12 + n + 6 + 4)
    scale, least, limit, joint = 12 + n + 6, 12 + n + 7, 12 + n + 8, 12 + n + 9
    largest, total = 0.0, 0.0
    for i in range(6):
        largest = max(largest, abs(twist[i]))
        total += twist[i]
    for k in range(n):
        total += q[k]
    out[joint] = -1.0
    if not abs(total) < math.inf:
        out[limit] = INVALID
        return out
    axes, origins, jacobian = np.empty((n, 3)), np.empty((n, 3)), np.empty((6, n))
    frame = _frames(chain, q, axes, origins)
    _columns(frame, axes, origins, jacobian)
    out[:12] = frame

    rows = np.zeros((6, n + 6))
    wanted = np.empty(6)
    for i in range(6):
        weight = 1.0 / length if i < 3 else 1.0
        wanted[i] = (twist[i] / largest if largest > 0.0 else 0.0) * weight
        for k in range(n):
            rows[i, k] = weight * jacobian[i, k]
        rows[i, n + i] = 1.0
    _orthogonalise(rows, n)

    smallest = math.inf
    direction = np.empty(n)
    for i in range(6):
        square, along = 0.0, 0.0
        for k in range(n):
            square += rows[i, k] * rows[i, k]
        for j in range(6):
            along += rows[i, n + j] * wanted[j]
        sigma = math.sqrt(square)
        smallest = min(smallest, sigma)
        if sigma >= threshold:
            factor = along / square
        else:
            x = sigma / threshold
            factor = 4.0 * along / (threshold * (1.0 + x * x)) ** 2
            if x < 2.0 * floor and sigma > 0.0:
                for k in range(n):
                    direction[k] = rows[i, k] / sigma
                k_u = _curvature(direction, frame, axes, origins, jacobian, rows[i, n:], length)
                # on towards the singularity: fades out, so that the motion back stays possible
                towards = min(max(-math.copysign(1.0, along) * k_u / bend, 0.0), 1.0)
                factor *= 1.0 - towards * (1.0 - min(max(x / floor - 1.0, 0.0), 1.0))
        for k in range(n):
            out[12 + k] += factor * rows[i, k]
    out[least] = smallest

    # the largest multiple of this direction that no joint objects to
    multiple, out[limit] = largest, UNLIMITED
    for k in range(n):
        speed = out[12 + k]
        if speed == 0.0:
            continue
        room = braking * (bounds[1, k] - q[k] if speed > 0.0 else q[k] - bounds[0, k])
        allowed = min(max(room, 0.0), bounds[2, k])
        if multiple * abs(speed) > allowed:
            multiple = allowed / abs(speed)
            out[limit] = POSITION if room < bounds[2, k] else SPEED
            out[joint] = k
    for k in range(n):
        # rounding must not exceed a limit either
        out[12 + k] = min(max(multiple * out[12 + k], -bounds[2, k]), bounds[2, k])
    for i in range(6):
        for k in range(n):
            out[12 + n + i] += jacobian[i, k] * out[12 + k]
    out[scale] = 1.0 if out[limit] == UNLIMITED else multiple / largest
    return out
