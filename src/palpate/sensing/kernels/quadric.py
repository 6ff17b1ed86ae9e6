"""The contact centroid on a centred quadric, compiled: many wrenches in blocks, one as a block of one.

With A = diag(1/semi-axis), its cofactor matrix C and D = det A (Bicchi 1990, equations 11-18, rearranged):

    a = C m,  b = A f,  s = f.m,  w = b + i a,  z = g + i k = -sqrt(w.w), the root with g <= 0,
    K = k/D = s/g,  c = [K C^2 m + (A^2 f) x m + g f] / (k^2 + |b|^2),  q = K A^2 c.

w.w = |b|^2 - |a|^2 + 2 i D s cancels where the wrench axis grazes the surface, and the three terms of c cancel
where the force is nearly tangential or the surface slender. So all of it runs in double-double up to the last
division; then the error of c is a few units in the last place whatever the conditioning. Most contacts cancel
little: for them float64 gives the same few units from w.w on, at half the cost. Each contact is looked at by
itself, so that its result does not depend on its neighbours in the block.
"""

import math

import numpy as np

from palpate.compiling import njit
from palpate.sensing.kernels.block import (
    AA,
    BB,
    BLOCK,
    CANCELLED,
    F_LOW,
    FINITE,
    G_LOW,
    INVALID,
    K_LOW,
    KAPPA,
    KEPT,
    LARGER_INVERSE,
    M_LOW,
    MODULUS_INVERSE,
    NO_CONTACT,
    NO_FORCE,
    OK,
    P_,
    P_LOW,
    PUSH,
    Q_,
    Q_LOW,
    S_LOW,
    SCRATCH_SIZE,
    SMALLEST_NORMAL,
    SMALLEST_SCALED,
    SPIN,
    STATUS,
    C,
    F,
    G,
    K,
    M,
    N,
    S,
    can_stream,
    clear_low_parts,
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
from palpate.sensing.kernels.double_double import (
    add,
    bits,
    fast_two_sum,
    fma,
    multiply,
    power_of_two,
    square,
    two_product,
)
from palpate.sensing.kernels.interleave import fence
from palpate.surfaces.quadric import Packed

_LENGTH_EXPONENT = int(Packed.LENGTH_EXPONENT)
_ALIGNED = int(Packed.ALIGNED)
_A = int(Packed.A)
_A2 = int(Packed.A_SQUARED)
_COF = int(Packed.COFACTOR)
_COF2 = int(Packed.COFACTOR_SQUARED)
_DET = int(Packed.DETERMINANT)
_DET_INV = int(Packed.DETERMINANT_INVERSE)

LARGEST_TURN = 1e100
"""Share of a condition number that is the spin's, the normal force's being at most 1, up to which both count:
its square stays within float64."""

_LITTLE_CANCELLATION = 3.0
"""c, or the normal, may be this many times smaller than the terms it is summed from: float64 then is within some
ten units in the last place."""


@njit(error_model="numpy")
def _centroid_row(K, Kl, C2, C2l, m, ml, u1, u1l, m2, m2l, u2, u2l, m1, m1l, g, gl, f, fl):
    """Return one component of K C^2 m + (A^2 f) x m + g f as a double-double."""
    h, low = multiply(C2, C2l, m, ml)
    h, low = multiply(K, Kl, h, low)
    p, e = multiply(u1, u1l, m2, m2l)
    h, low = add(h, low, p, e)
    p, e = multiply(-u2, -u2l, m1, m1l)
    h, low = add(h, low, p, e)
    p, e = multiply(g, gl, f, fl)
    return add(h, low, p, e)


@njit(error_model="numpy")
def square_of_w(q, n, t):
    """Take w.w = P + i Q = |b|^2 - |a|^2 + 2 i D s, b = A f, a = C m."""
    A0, A1, A2, A0l, A1l, A2l = q[_A], q[_A + 1], q[_A + 2], q[_A + 3], q[_A + 4], q[_A + 5]
    C0, C1, C2, C0l, C1l, C2l = q[_COF], q[_COF + 1], q[_COF + 2], q[_COF + 3], q[_COF + 4], q[_COF + 5]
    D, Dl = q[_DET], q[_DET + 1]
    for i in range(n):
        b0, b0l = multiply(A0, A0l, t[F + i], t[F_LOW + i])
        b1, b1l = multiply(A1, A1l, t[F + BLOCK + i], t[F_LOW + BLOCK + i])
        b2, b2l = multiply(A2, A2l, t[F + 2 * BLOCK + i], t[F_LOW + 2 * BLOCK + i])
        a0, a0l = multiply(C0, C0l, t[M + i], t[M_LOW + i])
        a1, a1l = multiply(C1, C1l, t[M + BLOCK + i], t[M_LOW + BLOCK + i])
        a2, a2l = multiply(C2, C2l, t[M + 2 * BLOCK + i], t[M_LOW + 2 * BLOCK + i])
        b0, b0l = square(b0, b0l)
        b1, b1l = square(b1, b1l)
        b2, b2l = square(b2, b2l)
        a0, a0l = square(a0, a0l)
        a1, a1l = square(a1, a1l)
        a2, a2l = square(a2, a2l)
        b0, b0l = add(b0, b0l, b1, b1l)
        bb, bbl = add(b0, b0l, b2, b2l)
        a0, a0l = add(a0, a0l, a1, a1l)
        aa, aal = add(a0, a0l, a2, a2l)
        P, Pl = add(bb, bbl, -aa, -aal)
        t[P_ + i], t[P_LOW + i] = fast_two_sum(P, Pl)
        t[Q_ + i], t[Q_LOW + i] = multiply(2.0 * D, 2.0 * Dl, t[S + i], t[S_LOW + i])
        t[AA + i] = aa
        t[BB + i] = bb


@njit(error_model="numpy")
def _float_root(P, Q, s):
    """Return z = -sqrt(P + i Q) as g, k, and 1/max(|g|, |k|), |P + i Q|; the sign of k is that of -s.

    The larger part comes by a square root, the other by division, so that neither cancels; P and Q are scaled by
    an exact power of two to keep their squares in range.
    """
    exponent = max((bits(max(abs(P), abs(Q))) >> 52) - 1023, -1022)
    down = power_of_two(-exponent)
    x = P * down
    y = Q * down
    modulus = math.sqrt(x * x + y * y) * power_of_two(exponent)
    larger = math.sqrt(0.5 * (modulus + abs(P)))
    larger_inverse = 1.0 / larger
    smaller = abs(0.5 * Q * larger_inverse)
    hits = P > 0.0
    g = -(larger if hits else smaller)
    k = smaller if hits else larger
    return g, (-k if s > 0.0 else k), larger_inverse, modulus


@njit(error_model="numpy")
def quick(q, n, t):
    """Take z, K and c in float64, from w.w and f.m in double-double.

    Returns how many of the c cancel so far that they need more digits; those are marked.
    """
    AA0, AA1, AA2 = q[_A2], q[_A2 + 1], q[_A2 + 2]
    CC0, CC1, CC2 = q[_COF2], q[_COF2 + 1], q[_COF2 + 2]
    D_inverse = q[_DET_INV]
    cancelled = 0
    for i in range(n):
        P, Q, s = t[P_ + i], t[Q_ + i], t[S + i]
        g, k, larger_inverse, modulus = _float_root(P, Q, s)
        hits = P > 0.0
        K_ = -s * larger_inverse if hits else k * D_inverse

        f0, f1, f2 = t[F + i], t[F + BLOCK + i], t[F + 2 * BLOCK + i]
        m0, m1, m2 = t[M + i], t[M + BLOCK + i], t[M + 2 * BLOCK + i]
        u0, u1, u2 = AA0 * f0, AA1 * f1, AA2 * f2
        a0, a1, a2 = K_ * (CC0 * m0), K_ * (CC1 * m1), K_ * (CC2 * m2)
        d0, d1, d2 = g * f0, g * f1, g * f2
        n0 = fma(u1, m2, fma(-u2, m1, a0 + d0))
        n1 = fma(u2, m0, fma(-u0, m2, a1 + d1))
        n2 = fma(u0, m1, fma(-u1, m0, a2 + d2))
        inverse = 1.0 / (k * k + t[BB + i])
        t[C + i] = n0 * inverse
        t[C + BLOCK + i] = n1 * inverse
        t[C + 2 * BLOCK + i] = n2 * inverse
        t[G + i] = g
        t[K + i] = K_
        t[MODULUS_INVERSE + i] = 1.0 / max(modulus, SMALLEST_NORMAL)

        # how much larger than c, and than the normal, are the terms that they are summed from?
        a0 = abs(a0) + abs(u1 * m2) + abs(u2 * m1) + abs(d0)
        a1 = abs(a1) + abs(u2 * m0) + abs(u0 * m2) + abs(d1)
        a2 = abs(a2) + abs(u0 * m1) + abs(u1 * m0) + abs(d2)
        largest = max(max(a0, a1), a2)
        enough = max(max(abs(n0), abs(n1)), abs(n2)) * _LITTLE_CANCELLATION
        steepest = max(max(AA0 * a0, AA1 * a1), AA2 * a2)
        sharp = max(max(AA0 * abs(n0), AA1 * abs(n1)), AA2 * abs(n2)) * _LITTLE_CANCELLATION
        needs_more = not (largest <= enough and steepest <= sharp)
        t[CANCELLED + i] = 1.0 if needs_more else 0.0
        cancelled += 1 if needs_more else 0
    return cancelled


@njit(error_model="numpy")
def keep_quick(n, t):
    """Put what `quick` found by, before `root` and `centroid` find it again with more digits."""
    for i in range(n):
        t[KEPT + i] = t[C + i]
        t[KEPT + BLOCK + i] = t[C + BLOCK + i]
        t[KEPT + 2 * BLOCK + i] = t[C + 2 * BLOCK + i]
        t[KEPT + 3 * BLOCK + i] = t[G + i]
        t[KEPT + 4 * BLOCK + i] = t[K + i]


@njit(error_model="numpy")
def restore_quick(n, t):
    """Take back what `quick` found where that was good enough."""
    for i in range(n):
        more = t[CANCELLED + i] != 0.0
        t[C + i] = t[C + i] if more else t[KEPT + i]
        t[C + BLOCK + i] = t[C + BLOCK + i] if more else t[KEPT + BLOCK + i]
        t[C + 2 * BLOCK + i] = t[C + 2 * BLOCK + i] if more else t[KEPT + 2 * BLOCK + i]
        t[G + i] = t[G + i] if more else t[KEPT + 3 * BLOCK + i]
        t[K + i] = t[K + i] if more else t[KEPT + 4 * BLOCK + i]


@njit(error_model="numpy")
def root(n, t):
    """Take the root z = g + i k = -sqrt(P + i Q) in double-double."""
    for i in range(n):
        P, Pl, Q, Ql = t[P_ + i], t[P_LOW + i], t[Q_ + i], t[Q_LOW + i]
        g, k, larger_inverse, modulus = _float_root(P, Q, t[S + i])

        # one Newton step on z^2 = w.w in double-double; each residual is proportional to the part it corrects
        gg, ggl = two_product(g, g)
        kk, kkl = two_product(k, k)
        e, el = add(P, Pl, -gg, -ggl)
        e, el = add(e, el, kk, kkl)
        real = e + el
        imaginary = fma(-2.0 * g, k, Q) + Ql
        modulus_inverse = 1.0 / max(modulus, SMALLEST_NORMAL)
        gl = 0.5 * modulus_inverse * (real * g + imaginary * k)
        kl = 0.5 * modulus_inverse * (imaginary * g - real * k)
        t[G + i], t[G_LOW + i] = fast_two_sum(g, gl)
        t[K + i], t[K_LOW + i] = fast_two_sum(k, kl)
        t[LARGER_INVERSE + i] = larger_inverse
        t[MODULUS_INVERSE + i] = modulus_inverse


@njit(error_model="numpy")
def centroid(q, n, t):
    """Take K = s/g = k/D, and c = [K C^2 m + (A^2 f) x m + g f] / (k^2 + |b|^2)."""
    AA0, AA1, AA2 = q[_A2], q[_A2 + 1], q[_A2 + 2]
    AA0l, AA1l, AA2l = q[_A2 + 3], q[_A2 + 4], q[_A2 + 5]
    CC0, CC1, CC2 = q[_COF2], q[_COF2 + 1], q[_COF2 + 2]
    CC0l, CC1l, CC2l = q[_COF2 + 3], q[_COF2 + 4], q[_COF2 + 5]
    Di, Dil = q[_DET_INV], q[_DET_INV + 1]
    for i in range(n):
        f0, f0l = t[F + i], t[F_LOW + i]
        f1, f1l = t[F + BLOCK + i], t[F_LOW + BLOCK + i]
        f2, f2l = t[F + 2 * BLOCK + i], t[F_LOW + 2 * BLOCK + i]
        m0, m0l = t[M + i], t[M_LOW + i]
        m1, m1l = t[M + BLOCK + i], t[M_LOW + BLOCK + i]
        m2, m2l = t[M + 2 * BLOCK + i], t[M_LOW + 2 * BLOCK + i]
        s, sl, g, gl, k, kl = t[S + i], t[S_LOW + i], t[G + i], t[G_LOW + i], t[K + i], t[K_LOW + i]
        inverse = t[LARGER_INVERSE + i]
        K_hit = -s * inverse
        K_hit_l = -(fma(-K_hit, g, s) + (sl - K_hit * gl)) * inverse
        K_miss, K_miss_l = multiply(k, kl, Di, Dil)
        hits = t[P_ + i] > 0.0
        K_ = K_hit if hits else K_miss
        Kl = K_hit_l if hits else K_miss_l
        u0, u0l = multiply(AA0, AA0l, f0, f0l)
        u1, u1l = multiply(AA1, AA1l, f1, f1l)
        u2, u2l = multiply(AA2, AA2l, f2, f2l)
        n0, n0l = _centroid_row(K_, Kl, CC0, CC0l, m0, m0l, u1, u1l, m2, m2l, u2, u2l, m1, m1l, g, gl, f0, f0l)
        n1, n1l = _centroid_row(K_, Kl, CC1, CC1l, m1, m1l, u2, u2l, m0, m0l, u0, u0l, m2, m2l, g, gl, f1, f1l)
        n2, n2l = _centroid_row(K_, Kl, CC2, CC2l, m2, m2l, u0, u0l, m1, m1l, u1, u1l, m0, m0l, g, gl, f2, f2l)
        inverse = 1.0 / (k * k + t[BB + i])
        t[C + i] = (n0 + n0l) * inverse
        t[C + BLOCK + i] = (n1 + n1l) * inverse
        t[C + 2 * BLOCK + i] = (n2 + n2l) * inverse
        t[K + i] = K_


@njit(error_model="numpy")
def derive(q, n, hard, t):
    """Take normal, normal force, spin torque, condition and status from c, g and K.

    The condition is |S| |(|f|, |m| / |c|)|, see `palpate.sensing.solver`, of the Frobenius norm of S = dc/dm:
    |S|^2 = (q^2 (k1^2 + k2^2) + 2 phi^2) / (phi^2 + q^2 k1 k2)^2 with phi = f.n, q the spin torque and k1, k2 the
    principal curvatures, with sum (tr A^2 - n'A^2 n) / |A^2 c| and product (D / |A^2 c|^2)^2.
    """
    A0, A1, A2 = q[_A], q[_A + 1], q[_A + 2]
    AA0, AA1, AA2 = q[_A2], q[_A2 + 1], q[_A2 + 2]
    bounded = q[_DET] != 0.0
    determinant = q[_DET]
    for i in range(n):
        f0, f1, f2 = t[F + i], t[F + BLOCK + i], t[F + 2 * BLOCK + i]
        m0, m1, m2 = t[M + i], t[M + BLOCK + i], t[M + 2 * BLOCK + i]
        c0, c1, c2 = t[C + i], t[C + BLOCK + i], t[C + 2 * BLOCK + i]
        aa, bb = t[AA + i], t[BB + i]
        # f.n = g / |A^2 c|, q.n = K |A^2 c|
        v0, v1, v2 = AA0 * c0, AA1 * c1, AA2 * c2
        gradient = math.sqrt(v0 * v0 + v1 * v1 + v2 * v2)
        inverse = 1.0 / gradient
        normal_force = -t[G + i] * inverse
        spin = t[K + i] * gradient
        n0, n1, n2 = v0 * inverse, v1 * inverse, v2 * inverse
        t[N + i] = n0
        t[N + BLOCK + i] = n1
        t[N + 2 * BLOCK + i] = n2
        t[PUSH + i] = normal_force
        t[SPIN + i] = -t[SPIN + i] * normal_force if hard else spin
        bend = (AA0 * (1.0 - n0 * n0) + AA1 * (1.0 - n1 * n1) + AA2 * (1.0 - n2 * n2)) * inverse
        gauss = determinant * inverse * inverse
        bend = max(bend * bend - 2.0 * gauss * gauss, 0.0)
        root = math.sqrt(t[MODULUS_INVERSE + i])
        parts = gradient * root
        push, turn = normal_force * parts, abs(spin) * math.sqrt(bend) * parts
        some = min(turn, LARGEST_TURN)
        turned = max(math.sqrt(some * some + 2.0 * push * push), turn)
        lever = (m0 * m0 + m1 * m1 + m2 * m2) / (c0 * c0 + c1 * c1 + c2 * c2)
        size = f0 * f0 + f1 * f1 + f2 * f2 + lever
        t[KAPPA + i] = max(turned, 1.0) * parts * math.sqrt(size)

        exists = t[P_ + i] > 0.0 or (bounded and t[S + i] != 0.0)
        some_force = f0 != 0.0 or f1 != 0.0 or f2 != 0.0
        some_press = A0 * f0 != 0.0 or A1 * f1 != 0.0 or A2 * f2 != 0.0
        lost = some_press and max(aa, bb) < SMALLEST_SCALED * SMALLEST_SCALED
        code = OK if exists else NO_CONTACT
        code = code if some_force else NO_FORCE
        code = code if (t[FINITE + i] == 0.0 and not lost) else INVALID
        t[STATUS + i] = code


@njit(error_model="numpy", cache=True)
def solve_quadric(q, wrenches, hard, result, status):
    """Solve n wrenches on one quadric.

    Args:
        q: The surface's packed coefficients, see `palpate.surfaces.quadric.Packed`.
        wrenches: n of them, one after the other, shape (6 n,).
        hard: Whether to solve for hard fingers (wrench axis) instead of soft ones.
        result: Written, shape (15 s,), s >= n: centroids, normals, forces, tangential forces, each (s, 3), then
            normal forces, spin torques, conditions, each (s,); the last s - n of each are left alone.
        status: Written, shape (n,), int8.

    Returns:
        The scalars of the last one, see `last_scalars`.
    """
    t = np.empty(SCRATCH_SIZE)
    length_exponent = int(q[_LENGTH_EXPONENT])
    aligned = q[_ALIGNED] == 1.0
    total, stride = len(status), len(result) // 15
    streaming = can_stream(total, stride, result)
    for start in range(0, total, BLOCK):
        n = min(BLOCK, total - start)
        load(wrenches, start, n, t)
        if scale(n, length_exponent, t) > 0:
            settle_cancelled_dots(wrenches, start, n, length_exponent, t)
        if aligned and (hard or start == 0):
            clear_low_parts(n, t)
        if not aligned:
            to_surface_axes(q, n, t)
        if hard:
            remove_parallel_moment(n, t)
        square_of_w(q, n, t)
        if quick(q, n, t) > 0:
            keep_quick(n, t)
            root(n, t)
            centroid(q, n, t)
            restore_quick(n, t)
        derive(q, n, hard, t)
        if not aligned:
            to_sensor_axes(q, n, t)
        finish(n, length_exponent, t)
        store(t, start, n, stride, streaming, result, status)
    if streaming:
        fence()
    return last_scalars(result, status)
