"""The contact centroid on a paraboloid or a hyperboloid's sheet, compiled, by mapping to the unit sphere.

A soft contact on the quadric Q satisfies L c~ = K Q c~ with homogeneous c~ and the antisymmetric 4x4 matrix
L = [[ [f]x, m ], [-m', 0]]. Where c~ = T y turns Q into diag(1, 1, 1, -1), T' L T is the L of another wrench, and
y a point of the unit sphere that explains it: the centred quadric's stages do the rest. Of its two points,
pushing and pulling, one may be the wanted contact: the one on the wanted sheet with the force pushing inwards.
"""

import math

import numpy as np

from palpate.compiling import njit
from palpate.sensing.kernels.block import (
    BLOCK,
    F_LOW,
    FINITE,
    INVALID,
    KAPPA,
    M_LOW,
    MODULUS_INVERSE,
    NO_CONTACT,
    NO_FORCE,
    OK,
    P_,
    PUSH,
    S_LOW,
    SCRATCH_SIZE,
    SPIN,
    STATUS,
    C,
    F,
    K,
    M,
    N,
    S,
    can_stream,
    clear_low_parts,
    dot3,
    finish,
    load,
    remove_parallel_moment,
    scale,
    settle_cancelled_dots,
    store,
    to_sensor_axes,
    to_surface_axes,
)
from palpate.sensing.kernels.contact_rows import last_scalars
from palpate.sensing.kernels.interleave import fence
from palpate.sensing.kernels.quadric import centroid, root, square_of_w
from palpate.surfaces.open_quadric import PackedProjective
from palpate.surfaces.quadric import Packed

_LENGTH_EXPONENT = int(Packed.LENGTH_EXPONENT)
_ALIGNED = int(Packed.ALIGNED)
_SCALE_X = int(PackedProjective.SCALE_X)
_SCALE_Y = int(PackedProjective.SCALE_Y)
_MIX = int(PackedProjective.MIX)
_BETA = int(PackedProjective.BETA)
_ETA = int(PackedProjective.ETA)

# rows behind the shared scratch: the force in the surface's axes, and the first candidate
FORCE = SCRATCH_SIZE
CANDIDATE = SCRATCH_SIZE + 3 * BLOCK
CANDIDATE_K = SCRATCH_SIZE + 6 * BLOCK
HARD_SPIN = SCRATCH_SIZE + 7 * BLOCK
_SIZE = SCRATCH_SIZE + 8 * BLOCK


@njit(error_model="numpy")
def _to_sphere(q, n, t):
    """Turn the wrench into the one that its image exerts on the unit sphere: T' L T."""
    a, b, p, qq, r, s = q[_SCALE_X], q[_SCALE_Y], q[_MIX], q[_MIX + 1], q[_MIX + 2], q[_MIX + 3]
    determinant = p * s - qq * r
    for i in range(n):
        f0, f0l, f1, f1l = t[F + i], t[F_LOW + i], t[F + BLOCK + i], t[F_LOW + BLOCK + i]
        f2 = t[F + 2 * BLOCK + i]
        m0, m0l, m1, m1l = t[M + i], t[M_LOW + i], t[M + BLOCK + i], t[M_LOW + BLOCK + i]
        m2 = t[M + 2 * BLOCK + i]
        t[FORCE + i], t[FORCE + BLOCK + i], t[FORCE + 2 * BLOCK + i] = f0, f1, f2
        x, xl = dot3(p, 0.0, -r, 0.0, 0.0, 0.0, f0, f0l, m1, m1l, 0.0, 0.0)
        y, yl = dot3(p, 0.0, r, 0.0, 0.0, 0.0, f1, f1l, m0, m0l, 0.0, 0.0)
        u, ul = dot3(qq, 0.0, s, 0.0, 0.0, 0.0, f1, f1l, m0, m0l, 0.0, 0.0)
        v, vl = dot3(-qq, 0.0, s, 0.0, 0.0, 0.0, f0, f0l, m1, m1l, 0.0, 0.0)
        t[F + i], t[F_LOW + i] = b * x, b * xl
        t[F + BLOCK + i], t[F_LOW + BLOCK + i] = a * y, a * yl
        t[F + 2 * BLOCK + i], t[F_LOW + 2 * BLOCK + i] = a * b * f2, 0.0
        t[M + i], t[M_LOW + i] = a * u, a * ul
        t[M + BLOCK + i], t[M_LOW + BLOCK + i] = b * v, b * vl
        t[M + 2 * BLOCK + i], t[M_LOW + 2 * BLOCK + i] = determinant * m2, 0.0
        zero = t[S + i] == 0.0
        h, low = dot3(
            t[F + i], t[F_LOW + i], t[F + BLOCK + i], t[F_LOW + BLOCK + i], t[F + 2 * BLOCK + i], 0.0,
            t[M + i], t[M_LOW + i], t[M + BLOCK + i], t[M_LOW + BLOCK + i], t[M + 2 * BLOCK + i], 0.0,
        )  # fmt: skip
        # f.m of the image is that of the wrench times det T: zero for both or for none
        t[S + i] = 0.0 if zero else h
        t[S_LOW + i] = 0.0 if zero else low


@njit(error_model="numpy")
def _negate(n, t):
    """Turn the wrench round: its pushing point is the other's pulling one."""
    for row in range(3):
        for i in range(n):
            t[F + row * BLOCK + i] = -t[F + row * BLOCK + i]
            t[F_LOW + row * BLOCK + i] = -t[F_LOW + row * BLOCK + i]
            t[M + row * BLOCK + i] = -t[M + row * BLOCK + i]
            t[M_LOW + row * BLOCK + i] = -t[M_LOW + row * BLOCK + i]


@njit(error_model="numpy")
def _keep_candidate(n, t):
    """Put the first candidate by."""
    for row in range(3):
        for i in range(n):
            t[CANDIDATE + row * BLOCK + i] = t[C + row * BLOCK + i]
    for i in range(n):
        t[CANDIDATE_K + i] = t[K + i]


@njit(error_model="numpy")
def _choose(q, n, hard, t):
    """Map both candidates back and keep the one on the wanted sheet into which the force pushes."""
    a, b, p, qq, r, s = q[_SCALE_X], q[_SCALE_Y], q[_MIX], q[_MIX + 1], q[_MIX + 2], q[_MIX + 3]
    beta, eta = q[_BETA], q[_ETA]
    for i in range(n):
        f0, f1, f2 = t[FORCE + i], t[FORCE + BLOCK + i], t[FORCE + 2 * BLOCK + i]
        # without spin there is a contact only where the axis hits: else the root is a point of the limb
        solved = math.isfinite(t[MODULUS_INVERSE + i]) and (t[P_ + i] > 0.0 or t[S + i] != 0.0)
        code = NO_CONTACT
        best = kept0 = kept1 = kept2 = 0.0
        for which in range(2):
            start = CANDIDATE if which == 0 else C
            y0, y1, y2 = t[start + i], t[start + BLOCK + i], t[start + 2 * BLOCK + i]
            K_ = t[CANDIDATE_K + i] if which == 0 else -t[K + i]
            w = r * y2 + s
            c0, c1, c2 = a * y0 / w, b * y1 / w, (p * y2 + qq) / w
            v0, v1, v2 = c0 / (a * a), c1 / (b * b), beta * c2 + eta
            gradient = math.sqrt(v0 * v0 + v1 * v1 + v2 * v2)
            n0, n1, n2 = v0 / gradient, v1 / gradient, v2 / gradient
            push = -(f0 * n0 + f1 * n1 + f2 * n2)
            # of two, the nearer: where a force along the axis puts the other at infinity, rounding may bring it
            # back on either side
            if solved and w > best and push > 0.0:
                best, code = w, OK
                t[SPIN + i] = -t[HARD_SPIN + i] * push if hard else K_ * gradient
                t[N + i], t[N + BLOCK + i], t[N + 2 * BLOCK + i] = n0, n1, n2
                t[PUSH + i] = push
                kept0, kept1, kept2 = c0, c1, c2
        if code == OK:
            t[C + i], t[C + BLOCK + i], t[C + 2 * BLOCK + i] = kept0, kept1, kept2
            # |dc/dm| from the curvatures at c, as for unbounded centred quadrics: Q, f and m are still to scale
            v0, v1, v2 = kept0 / (a * a), kept1 / (b * b), beta * kept2 + eta
            size = math.sqrt(v0 * v0 + v1 * v1 + v2 * v2)
            n0, n1, n2 = v0 / size, v1 / size, v2 / size
            p0, p1, p2 = 1.0 / (a * a), 1.0 / (b * b), beta
            trace = (p0 * (1.0 - n0 * n0) + p1 * (1.0 - n1 * n1) + p2 * (1.0 - n2 * n2)) / size
            gaussian = (p1 * p2 * n0 * n0 + p0 * p2 * n1 * n1 + p0 * p1 * n2 * n2) / (size * size)
            bend = 0.5 * trace + math.sqrt(max(0.25 * trace * trace - gaussian, 0.0))
            spin = abs(t[SPIN + i])
            push = t[PUSH + i]
            spread = (spin * bend + push) / (push * push + spin * spin * max(gaussian, 0.0))
            force = math.sqrt(f0 * f0 + f1 * f1 + f2 * f2)
            reach = math.sqrt(kept0 * kept0 + kept1 * kept1 + kept2 * kept2) + min(a, b)
            m0 = kept1 * f2 - kept2 * f1
            m1 = kept2 * f0 - kept0 * f2
            m2 = kept0 * f1 - kept1 * f0
            moment = math.sqrt(m0 * m0 + m1 * m1 + m2 * m2) + spin
            t[KAPPA + i] = spread * (force + moment / reach)
        if f0 == 0.0 and f1 == 0.0 and f2 == 0.0:
            code = NO_FORCE
        if t[FINITE + i] != 0.0:
            code = INVALID
        t[STATUS + i] = code


@njit(error_model="numpy", cache=True)
def solve_projective(q, unit_sphere, wrenches, hard, result, status):
    """Solve n wrenches on one open quadric; arguments as in `solve_quadric`, `unit_sphere` packed likewise."""
    t = np.empty(_SIZE)
    length_exponent = int(q[_LENGTH_EXPONENT])
    total, stride = len(status), len(result) // 15
    streaming = can_stream(total, stride, result)
    for start in range(0, total, BLOCK):
        n = min(BLOCK, total - start)
        load(wrenches, start, n, t)
        if scale(n, length_exponent, t) > 0:
            settle_cancelled_dots(wrenches, start, n, length_exponent, t)
        clear_low_parts(n, t)
        if q[_ALIGNED] != 1.0:
            to_surface_axes(q, n, t)
        if hard:
            remove_parallel_moment(n, t)
            for i in range(n):
                t[HARD_SPIN + i] = t[SPIN + i]
        _to_sphere(q, n, t)
        square_of_w(unit_sphere, n, t)
        root(n, t)
        for i in range(n):
            t[KAPPA + i] = t[K + i]
        centroid(unit_sphere, n, t)
        _keep_candidate(n, t)
        _negate(n, t)
        for i in range(n):
            t[K + i] = t[KAPPA + i]
        centroid(unit_sphere, n, t)
        _choose(q, n, hard, t)
        if q[_ALIGNED] != 1.0:
            to_sensor_axes(q, n, t)
        finish(n, length_exponent, t)
        store(t, start, n, stride, streaming, result, status)
    if streaming:
        fence()
    return last_scalars(result, status)
