"""Inner loops of arm kinematics, compiled: numba, no Python objects.

One file on purpose: numba's cache looks at the file of a cached function only, not at what it inlines from others.

A chain is packed into one array: the pose of the robot base in base and that of the tip behind the last joint, 12
numbers each (position, rotation by rows), then 13 numbers per joint: the pose of its frame behind the joint before
it, and whether it slides along z of that frame (1) or turns about it (0).
"""

import math

import numpy as np

from palpate.compiling import njit

POSE = 12
"""Numbers per pose."""

JOINT = POSE + 1
"""Numbers per joint in a packed chain."""

_MAX_SWEEPS = 30
"""Of Jacobi's method; 5 to 8 are usual."""

_ORTHOGONAL = 1e-15
"""Cosine of the angle between rows that counts as a right one."""

_NEGLIGIBLE = 1e-32
"""Inner product of rows, relative to the square of the matrix, that is rounding."""

UNLIMITED, SPEED, POSITION, INVALID = 0.0, 1.0, 2.0, 3.0
"""What scaled a motion: see `palpate.kinematics.velocity.Limit`."""


@njit(error_model="numpy")
def _move(frame, pose):
    """Take a frame on by a pose, both as flat arrays of 12."""
    for i in range(3):
        x, y, z = frame[3 + 3 * i], frame[4 + 3 * i], frame[5 + 3 * i]
        frame[i] += x * pose[0] + y * pose[1] + z * pose[2]
        for j in range(3):
            frame[3 + 3 * i + j] = x * pose[3 + j] + y * pose[6 + j] + z * pose[9 + j]


@njit(error_model="numpy")
def _frames(chain, q, axes, origins):
    """Return the tip's frame; write each joint's axis and a point on it, base coordinates, shape (n, 3)."""
    f = chain[:POSE].copy()
    for k in range(len(q)):
        at = 2 * POSE + JOINT * k
        _move(f, chain[at : at + POSE])
        slides = chain[at + POSE] != 0.0
        c, s = (1.0, 0.0) if slides else (math.cos(q[k]), math.sin(q[k]))
        for i in range(3):
            x, y, z = f[3 + 3 * i], f[4 + 3 * i], f[5 + 3 * i]
            axes[k, i], origins[k, i] = z, f[i]
            if slides:
                f[i] += q[k] * z
            else:
                f[3 + 3 * i], f[4 + 3 * i] = c * x + s * y, c * y - s * x
    _move(f, chain[POSE : 2 * POSE])
    return f


@njit(error_model="numpy")
def _columns(chain, frame, axes, origins, jacobian):
    """Write the geometric Jacobian, shape (6, n): velocity of the tip's origin, then angular velocity."""
    for k in range(len(axes)):
        zx, zy, zz = axes[k, 0], axes[k, 1], axes[k, 2]
        if chain[2 * POSE + JOINT * k + POSE] != 0.0:
            jacobian[0, k], jacobian[1, k], jacobian[2, k] = zx, zy, zz
            jacobian[3, k], jacobian[4, k], jacobian[5, k] = 0.0, 0.0, 0.0
            continue
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
    _columns(chain, _frames(chain, q, axes, origins), axes, origins, jacobian)
    return jacobian


@njit(error_model="numpy")
def _orthogonalise(rows, n):
    """Turn the rows among themselves until their first n columns are orthogonal (one-sided Jacobi, Hestenes 1958).

    The first n columns hold a matrix A, the others follow along: with the identity there, A = U S V' leaves S V'
    on the left and U' on the right; small singular values come out as accurately as large ones.
    """
    m, total = len(rows), 0.0
    for i in range(m):
        for k in range(n):
            total += rows[i, k] * rows[i, k]
    for _ in range(_MAX_SWEEPS):
        turned = False
        for i in range(m - 1):
            for j in range(i + 1, m):
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
def _curvature(chain, direction, frame, axes, origins, jacobian, u, length):
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
        if chain[2 * POSE + JOINT * k + POSE] != 0.0:
            result += direction[k] * (u[0] * ax + u[1] * ay + u[2] * az) / length
            vx, vy, vz = vx + zx * direction[k], vy + zy * direction[k], vz + zz * direction[k]
            continue
        x, y, z = frame[0] - origins[k, 0], frame[1] - origins[k, 1], frame[2] - origins[k, 2]
        dx, dy, dz = px - vx, py - vy, pz - vz
        bx = ay * z - az * y + zy * dz - zz * dy
        by = az * x - ax * z + zz * dx - zx * dz
        bz = ax * y - ay * x + zx * dy - zy * dx
        along = (u[0] * bx + u[1] * by + u[2] * bz) / length
        if len(u) == 6:
            along += u[3] * ax + u[4] * ay + u[5] * az
        result += direction[k] * along
        wx, wy, wz = wx + zx * direction[k], wy + zy * direction[k], wz + zz * direction[k]
    return result


@njit(error_model="numpy")
def _add_posture(velocity, z, rows, q, home, bounds, gain, share, braking, negligible):
    """Write into z the velocity towards the home posture that does not move the tip.

    It leaves half of each joint's room to the motion of the tip, and stays below `share` of it, so that an arm
    whose tip stands still stands still.

    Args:
        velocity: Of the joints, for the tip, each in its own unit, shape (n,).
        z: To write into, shape (n,).
        rows: S V' of the Jacobian.
        q: Joint positions in the units of `rows`, and so on.
        home: Likewise.
        bounds: Rows lower, upper, speed.
        gain: [1/s] at which the posture is gone to.
        share: Of the norm of the motion of the tip.
        braking: [1/s]
        negligible: Singular value at which a direction counts as fully taken by the tip.
    """
    n = len(q)
    task = 0.0
    for k in range(n):
        z[k] = gain * (home[k] - q[k])
        task += velocity[k] * velocity[k]
    for i in range(len(rows)):
        square, along = 0.0, 0.0
        for k in range(n):
            square += rows[i, k] * rows[i, k]
            along += rows[i, k] * z[k]
        x = min(math.sqrt(square) / negligible, 1.0)
        factor = along / square * x * x * (3.0 - 2.0 * x) if square > 0.0 else 0.0
        for k in range(n):
            z[k] -= factor * rows[i, k]
    size, part = 0.0, 1.0
    for k in range(n):
        size += z[k] * z[k]
        room = braking * (bounds[1, k] - q[k] if z[k] > 0.0 else q[k] - bounds[0, k])
        allowed = 0.5 * min(max(room, 0.0), bounds[2, k])
        if part * abs(z[k]) > allowed:
            part = allowed / abs(z[k])
    if part * part * size > share * share * task:
        part = share * math.sqrt(task / size)
    for k in range(n):
        z[k] *= part


@njit(error_model="numpy", cache=True)
def joint_motion(chain, bounds, home, settings, q, twist):
    """Return frame (12), joint velocities (n), realised twist (6), scale, smallest singular value, limit, joint.

    The method and its terms are those of `palpate.kinematics.velocity`.

    Args:
        chain: See above.
        bounds: Rows lower, upper [rad or m], speed [rad/s or m/s], shape (3, n).
        home: Posture that the null space is used for [rad or m], shape (n,).
        settings: length [m], threshold, floor, bend, braking rate [1/s], rate [1/s] and share of the posture.
        q: Joint positions [rad or m], shape (n,).
        twist: Wanted (v, w) of the tip in the base, shape (6,).
    """
    n = len(q)
    m = 6 if n >= 6 else 3
    length, threshold, floor, bend, braking, gain, share = settings
    out = np.zeros(12 + n + 6 + 4)
    scale, least, limit, joint = 12 + n + 6, 12 + n + 7, 12 + n + 8, 12 + n + 9
    largest, total = 0.0, 0.0
    for i in range(6):
        total += twist[i]
        if i < m:
            largest = max(largest, abs(twist[i]))
    for k in range(n):
        total += q[k]
    out[joint] = -1.0
    if not abs(total) < math.inf:
        out[limit] = INVALID
        return out
    axes, origins, jacobian = np.empty((n, 3)), np.empty((n, 3)), np.empty((6, n))
    frame = _frames(chain, q, axes, origins)
    _columns(chain, frame, axes, origins, jacobian)
    out[:12] = frame

    unit = np.ones(n)  # of joint positions here: [rad], or `length` of a slide
    for k in range(n):
        if chain[2 * POSE + JOINT * k + POSE] != 0.0:
            unit[k] = length
    rows = np.zeros((m, n + m))
    wanted = np.empty(m)
    for i in range(m):
        weight = 1.0 / length if i < 3 else 1.0
        wanted[i] = (twist[i] / largest if largest > 0.0 else 0.0) * weight
        for k in range(n):
            rows[i, k] = weight * unit[k] * jacobian[i, k]
        rows[i, n + i] = 1.0
    _orthogonalise(rows, n)

    smallest = math.inf
    direction, motion = np.empty(n), np.zeros(n)
    for i in range(m):
        square, along = 0.0, 0.0
        for k in range(n):
            square += rows[i, k] * rows[i, k]
        for j in range(m):
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
                    direction[k] = unit[k] * rows[i, k] / sigma
                k_u = _curvature(chain, direction, frame, axes, origins, jacobian, rows[i, n:], length)
                # on towards the singularity: fades out, so that the motion back stays possible
                towards = min(max(-math.copysign(1.0, along) * k_u / bend, 0.0), 1.0)
                factor *= 1.0 - towards * (1.0 - min(max(x / floor - 1.0, 0.0), 1.0))
        for k in range(n):
            motion[k] += factor * rows[i, k]
    out[least] = smallest

    # joints beyond those that the tip needs go to the home posture meanwhile
    posture = np.zeros(n)
    if n > m:
        for k in range(n):
            direction[k] = largest * motion[k]
        scaled = bounds / unit
        _add_posture(
            direction, posture, rows, q / unit, home / unit, scaled, gain, share, braking, floor * threshold
        )
    # the largest multiple of this motion that no joint objects to
    multiple, out[limit] = largest, UNLIMITED
    for k in range(n):
        motion[k] *= unit[k]
        posture[k] *= unit[k]
        speed = motion[k]
        if speed == 0.0:
            continue
        room = braking * (bounds[1, k] - q[k] if speed > 0.0 else q[k] - bounds[0, k])
        allowed = min(max(room, 0.0), bounds[2, k]) - math.copysign(posture[k], speed * posture[k])
        if multiple * abs(speed) > allowed:
            multiple = allowed / abs(speed)
            out[limit] = POSITION if room < bounds[2, k] else SPEED
            out[joint] = k
    for k in range(n):
        # rounding must not exceed a limit either
        out[12 + k] = min(max(multiple * motion[k] + posture[k], -bounds[2, k]), bounds[2, k])
    for i in range(6):
        for k in range(n):
            out[12 + n + i] += jacobian[i, k] * out[12 + k]
    out[scale] = 1.0 if out[limit] == UNLIMITED else multiple / largest
    return out
