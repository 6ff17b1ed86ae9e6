"""Input of wrenches and output of contacts in blocks, compiled.

A block goes through stages that are plain loops over a scratch array that stays in the first-level cache. The
loops have no branches and constant strides, so that the compiler turns them into vector instructions. Here are
the stages that every quadric shares: load and scale, turn into the surface's axes, turn back, store.
"""

import math

import numpy as np

from palpate.compiling import njit
from palpate.sensing.contact import ContactStatus
from palpate.sensing.kernels.double_double import (
    add,
    bits,
    fast_two_sum,
    fma,
    multiply,
    power_of_two,
    two_product,
    two_sum,
)
from palpate.sensing.kernels.interleave import LANES, load_wrenches, store_vectors, stream_row, stream_vectors
from palpate.surfaces.quadric import Packed

BLOCK = 64
"""Wrenches per block: 64 x 56 rows x 8 bytes = 29 kB of scratch stay in a 32 kB first-level cache."""

# Rows of the scratch array, as offsets. A vector takes three rows; the low part of a double-double stands as
# many rows behind its high part as it has components.
C = 0 * BLOCK
N = 3 * BLOCK
TANGENTIAL = 6 * BLOCK
PUSH = 9 * BLOCK
SPIN = 10 * BLOCK
KAPPA = 11 * BLOCK
STATUS = 12 * BLOCK
F = 15 * BLOCK
F_LOW = 18 * BLOCK
M = 21 * BLOCK
M_LOW = 24 * BLOCK
S = 27 * BLOCK
S_LOW = 28 * BLOCK
S_SIZE = 29 * BLOCK
EXPONENT = 30 * BLOCK
FINITE = 31 * BLOCK
P_ = 32 * BLOCK
P_LOW = 33 * BLOCK
Q_ = 34 * BLOCK
Q_LOW = 35 * BLOCK
AA = 36 * BLOCK
BB = 37 * BLOCK
G = 38 * BLOCK
G_LOW = 39 * BLOCK
K = 40 * BLOCK
K_LOW = 41 * BLOCK
LARGER_INVERSE = 42 * BLOCK
MODULUS_INVERSE = 43 * BLOCK
WRENCH = 44 * BLOCK
CANCELLED = 50 * BLOCK
KEPT = 51 * BLOCK
SCRATCH_SIZE = 56 * BLOCK

OK = float(ContactStatus.OK)
NO_CONTACT = float(ContactStatus.NO_CONTACT)
NO_FORCE = float(ContactStatus.NO_FORCE)
INVALID = float(ContactStatus.INVALID)

_CENTER = int(Packed.CENTER)
_ROTATION = int(Packed.ROTATION)

_MIN_STREAMED = 16_384
"""Contacts from which results (2 MB) no longer stay in a second-level cache, and are written past it."""

_NEVER = -(1 << 20)  # an exponent below any other
_EXACT_DOT_BOUND = 2.0**-52
"""Below this share of its terms' size double-double leaves a dot product fewer digits than float64 holds."""

_SCALED_EXPONENT = 200
"""The larger of force and moment is scaled to about 2^200: squares stay far from overflow, and what is 1e-200
times smaller, subnormal input included, is still a normal number."""

SMALLEST_SCALED = 2.0**-480
"""Scaled quantities below this lose digits when squared."""

_SMALLEST_FORCE = 2.0**-960
"""A force scaled to less than this has lost digits beside its moment."""

_WIDE_RANGE = 2.0**-200
"""Products of scaled force and moment below this may have lost terms to underflow."""

_SMALLEST_DOT = 2.0**-1000
"""A scaled f.m nearer to zero is replaced by this: a spin or normal force of less than 1e-300 of the rest."""

SMALLEST_NORMAL = 2.0**-1022


@njit(error_model="numpy")
def load(wrenches, start, n, t):
    """Copy a block of wrenches, component by component."""
    whole = n - n % LANES
    for i in range(0, whole, LANES):
        load_wrenches(wrenches, 6 * (start + i), t, WRENCH + i, BLOCK)
    for i in range(whole, n):
        for component in range(6):
            t[WRENCH + component * BLOCK + i] = wrenches[6 * (start + i) + component]


@njit(error_model="numpy")
def scale(n, length_exponent, t):
    """Scale to |f|, |m| of about 2^200 or less, lengths in the surface's unit, exactly; and take f.m.

    Returns how many of the f.m cancel so far that they need more digits.
    """
    doubtful = 0
    for i in range(n):
        f0, f1, f2 = t[WRENCH + i], t[WRENCH + BLOCK + i], t[WRENCH + 2 * BLOCK + i]
        m0, m1, m2 = t[WRENCH + 3 * BLOCK + i], t[WRENCH + 4 * BLOCK + i], t[WRENCH + 5 * BLOCK + i]
        # x - x is 0 for finite numbers only
        finite = (f0 - f0) + (f1 - f1) + (f2 - f2) + (m0 - m0) + (m1 - m1) + (m2 - m2)
        f_max = max(max(abs(f0), abs(f1)), abs(f2))
        m_max = max(max(abs(m0), abs(m1)), abs(m2))
        f_exponent = (bits(f_max) >> 52) - 1023
        m_exponent = (bits(m_max) >> 52) - 1023 - length_exponent
        m_exponent = m_exponent if m_max > 0.0 else _NEVER
        # the powers themselves must be normal numbers
        exponent = max(f_exponent, m_exponent) - _SCALED_EXPONENT
        exponent = max(exponent, max(-1022, -1022 - length_exponent))
        f_scale = power_of_two(-exponent)
        m_scale = power_of_two(-exponent - length_exponent)
        f0, f1, f2 = f0 * f_scale, f1 * f_scale, f2 * f_scale
        m0, m1, m2 = m0 * m_scale, m1 * m_scale, m2 * m_scale
        t[F + i] = f0
        t[F + BLOCK + i] = f1
        t[F + 2 * BLOCK + i] = f2
        t[M + i] = m0
        t[M + BLOCK + i] = m1
        t[M + 2 * BLOCK + i] = m2
        t[EXPONENT + i] = float(exponent)
        # so much moment per force that the force is lost beside it counts as not finite too
        scaled_max = max(max(abs(f0), abs(f1)), abs(f2))
        beyond = max(exponent, exponent + length_exponent) > 1023
        t[FINITE + i] = 1.0 if (f_max > 0.0 and scaled_max < _SMALLEST_FORCE) or beyond else finite
        h, low = dot3(f0, 0.0, f1, 0.0, f2, 0.0, m0, 0.0, m1, 0.0, m2, 0.0)
        t[S + i] = h
        t[S_LOW + i] = low
        size = abs(f0 * m0) + abs(f1 * m1) + abs(f2 * m2)
        t[S_SIZE + i] = size
        cancelled = abs(h) <= _EXACT_DOT_BOUND * size or size < _WIDE_RANGE
        doubtful += 1 if cancelled and f_max > 0.0 and m_max > 0.0 else 0
    return doubtful


@njit(error_model="numpy")
def clear_low_parts(n, t):
    """Forget the low parts that another block left."""
    for row in range(3):
        for i in range(n):
            t[F_LOW + row * BLOCK + i] = 0.0
            t[M_LOW + row * BLOCK + i] = 0.0


@njit(error_model="numpy")
def dot3(x0, x0l, x1, x1l, x2, x2l, y0, y0l, y1, y1l, y2, y2l):
    """Return x.y of double-double vectors as a double-double."""
    p0, e0 = multiply(x0, x0l, y0, y0l)
    p1, e1 = multiply(x1, x1l, y1, y1l)
    p2, e2 = multiply(x2, x2l, y2, y2l)
    h, low = add(p0, e0, p1, e1)
    h, low = add(h, low, p2, e2)
    return fast_two_sum(h, low)


@njit(error_model="numpy")
def settle_cancelled_dots(wrenches, start, n, length_exponent, t):
    """Where f.m cancels beyond what double-double holds, or its terms underflow, take it exactly.

    The solution is discontinuous at f.m = 0 where the wrench axis misses, so this zero has to be a true one.
    The products are aligned with the largest one here. Six terms (three exact products) are distilled until
    nothing changes (Ogita, Rump & Oishi, VecSum).
    """
    terms = np.empty(6)
    exponents = np.empty(3, np.int64)
    for i in range(n):
        size = t[S_SIZE + i]
        if not (abs(t[S + i]) <= _EXACT_DOT_BOUND * size or size < _WIDE_RANGE):
            continue
        highest = _NEVER
        for j in range(3):
            f, f_exponent = math.frexp(wrenches[6 * (start + i) + j])
            m, m_exponent = math.frexp(wrenches[6 * (start + i) + j + 3])
            exponents[j] = f_exponent + m_exponent if f != 0.0 and m != 0.0 else _NEVER
            terms[2 * j], terms[2 * j + 1] = two_product(f, m)
            highest = max(highest, exponents[j])
        if t[FINITE + i] != 0.0 or highest == _NEVER:
            continue
        for j in range(3):
            terms[2 * j] = math.ldexp(terms[2 * j], exponents[j] - highest)
            terms[2 * j + 1] = math.ldexp(terms[2 * j + 1], exponents[j] - highest)
        changed = True
        while changed:
            changed = False
            for j in range(1, 6):
                total, rest = two_sum(terms[j], terms[j - 1])
                changed |= rest != terms[j - 1]
                terms[j], terms[j - 1] = total, rest
        back = highest - 2 * int(t[EXPONENT + i]) - length_exponent
        s = math.ldexp(terms[5], back)
        low = math.ldexp(terms[4], back)
        if terms[5] != 0.0 and abs(s) < _SMALLEST_DOT:  # its sign decides in which sense the finger spins
            s, low = math.copysign(_SMALLEST_DOT, terms[5]), 0.0
        t[S + i] = s
        t[S_LOW + i] = low


@njit(error_model="numpy")
def to_surface_axes(q, n, t):
    """Shift the moment to the surface's centre and turn force and moment into its axes, in double-double."""
    o0, o1, o2 = q[_CENTER], q[_CENTER + 1], q[_CENTER + 2]
    r = q[_ROTATION : _ROTATION + 9]
    r00, r01, r02, r10, r11, r12, r20, r21, r22 = r[0], r[1], r[2], r[3], r[4], r[5], r[6], r[7], r[8]
    for i in range(n):
        f0 = t[F + i]
        f1 = t[F + BLOCK + i]
        f2 = t[F + 2 * BLOCK + i]
        # m - o x f
        m0, m0l = dot3(t[M + i], 0.0, -o1, 0.0, o2, 0.0, 1.0, 0.0, f2, 0.0, f1, 0.0)
        m1, m1l = dot3(t[M + BLOCK + i], 0.0, -o2, 0.0, o0, 0.0, 1.0, 0.0, f0, 0.0, f2, 0.0)
        m2, m2l = dot3(t[M + 2 * BLOCK + i], 0.0, -o0, 0.0, o1, 0.0, 1.0, 0.0, f1, 0.0, f0, 0.0)
        fx, fxl = dot3(r00, 0.0, r10, 0.0, r20, 0.0, f0, 0.0, f1, 0.0, f2, 0.0)
        fy, fyl = dot3(r01, 0.0, r11, 0.0, r21, 0.0, f0, 0.0, f1, 0.0, f2, 0.0)
        fz, fzl = dot3(r02, 0.0, r12, 0.0, r22, 0.0, f0, 0.0, f1, 0.0, f2, 0.0)
        mx, mxl = dot3(r00, 0.0, r10, 0.0, r20, 0.0, m0, m0l, m1, m1l, m2, m2l)
        my, myl = dot3(r01, 0.0, r11, 0.0, r21, 0.0, m0, m0l, m1, m1l, m2, m2l)
        mz, mzl = dot3(r02, 0.0, r12, 0.0, r22, 0.0, m0, m0l, m1, m1l, m2, m2l)
        t[F + i] = fx
        t[F + BLOCK + i] = fy
        t[F + 2 * BLOCK + i] = fz
        t[F_LOW + i] = fxl
        t[F_LOW + BLOCK + i] = fyl
        t[F_LOW + 2 * BLOCK + i] = fzl
        t[M + i] = mx
        t[M + BLOCK + i] = my
        t[M + 2 * BLOCK + i] = mz
        t[M_LOW + i] = mxl
        t[M_LOW + BLOCK + i] = myl
        t[M_LOW + 2 * BLOCK + i] = mzl
        # f.m does not depend on the frame, but a rotation is orthonormal to rounding only: take it from the
        # numbers that the solution will use, except that an exact zero stays one
        s, sl = dot3(fx, fxl, fy, fyl, fz, fzl, mx, mxl, my, myl, mz, mzl)
        zero = t[S + i] == 0.0
        t[S + i] = 0.0 if zero else s
        t[S_LOW + i] = 0.0 if zero else sl


@njit(error_model="numpy")
def remove_parallel_moment(n, t):
    """Hard finger: keep only the part of the moment normal to the force (eq. 8), m - (f.m/|f|^2) f."""
    for i in range(n):
        f0, f0l = t[F + i], t[F_LOW + i]
        f1, f1l = t[F + BLOCK + i], t[F_LOW + BLOCK + i]
        f2, f2l = t[F + 2 * BLOCK + i], t[F_LOW + 2 * BLOCK + i]
        s, sl = t[S + i], t[S_LOW + i]
        ff, ffl = dot3(f0, f0l, f1, f1l, f2, f2l, f0, f0l, f1, f1l, f2, f2l)
        p = s / ff
        pl = (fma(-p, ff, s) + (sl - p * ffl)) / ff
        h, low = multiply(-p, -pl, f0, f0l)
        h, low = add(t[M + i], t[M_LOW + i], h, low)
        t[M + i], t[M_LOW + i] = fast_two_sum(h, low)
        h, low = multiply(-p, -pl, f1, f1l)
        h, low = add(t[M + BLOCK + i], t[M_LOW + BLOCK + i], h, low)
        t[M + BLOCK + i], t[M_LOW + BLOCK + i] = fast_two_sum(h, low)
        h, low = multiply(-p, -pl, f2, f2l)
        h, low = add(t[M + 2 * BLOCK + i], t[M_LOW + 2 * BLOCK + i], h, low)
        t[M + 2 * BLOCK + i], t[M_LOW + 2 * BLOCK + i] = fast_two_sum(h, low)
        t[S + i] = 0.0
        t[S_LOW + i] = 0.0
        t[SPIN + i] = p


@njit(error_model="numpy")
def to_sensor_axes(q, n, t):
    """Turn centroid and normal back into the sensor frame."""
    o0, o1, o2 = q[_CENTER], q[_CENTER + 1], q[_CENTER + 2]
    r = q[_ROTATION : _ROTATION + 9]
    r00, r01, r02, r10, r11, r12, r20, r21, r22 = r[0], r[1], r[2], r[3], r[4], r[5], r[6], r[7], r[8]
    for i in range(n):
        x, y, z = t[C + i], t[C + BLOCK + i], t[C + 2 * BLOCK + i]
        t[C + i] = fma(r00, x, fma(r01, y, fma(r02, z, o0)))
        t[C + BLOCK + i] = fma(r10, x, fma(r11, y, fma(r12, z, o1)))
        t[C + 2 * BLOCK + i] = fma(r20, x, fma(r21, y, fma(r22, z, o2)))
        x, y, z = t[N + i], t[N + BLOCK + i], t[N + 2 * BLOCK + i]
        t[N + i] = fma(r00, x, fma(r01, y, r02 * z))
        t[N + BLOCK + i] = fma(r10, x, fma(r11, y, r12 * z))
        t[N + 2 * BLOCK + i] = fma(r20, x, fma(r21, y, r22 * z))


@njit(error_model="numpy")
def finish(n, length_exponent, t):
    """Undo the scaling, take the tangential force, and let nothing pass as a contact that is not finite."""
    length = power_of_two(length_exponent)
    for i in range(n):
        exponent = int(t[EXPONENT + i])
        push = t[PUSH + i] * power_of_two(exponent)
        spin = t[SPIN + i] * power_of_two(exponent + length_exponent)
        c0, c1, c2 = t[C + i] * length, t[C + BLOCK + i] * length, t[C + 2 * BLOCK + i] * length
        n0, n1, n2 = t[N + i], t[N + BLOCK + i], t[N + 2 * BLOCK + i]
        t0 = fma(push, n0, t[WRENCH + i])
        t1 = fma(push, n1, t[WRENCH + BLOCK + i])
        t2 = fma(push, n2, t[WRENCH + 2 * BLOCK + i])
        condition = t[KAPPA + i]
        code = t[STATUS + i]
        defect = (c0 - c0) + (c1 - c1) + (c2 - c2) + (n0 - n0) + (n1 - n1) + (n2 - n2)
        defect += (t0 - t0) + (t1 - t1) + (t2 - t2) + (push - push) + (spin - spin)
        code = INVALID if (code == OK and defect != 0.0) else code
        found = code == OK
        t[C + i] = c0 if found else np.nan
        t[C + BLOCK + i] = c1 if found else np.nan
        t[C + 2 * BLOCK + i] = c2 if found else np.nan
        t[N + i] = n0 if found else np.nan
        t[N + BLOCK + i] = n1 if found else np.nan
        t[N + 2 * BLOCK + i] = n2 if found else np.nan
        t[TANGENTIAL + i] = t0 if found else np.nan
        t[TANGENTIAL + BLOCK + i] = t1 if found else np.nan
        t[TANGENTIAL + 2 * BLOCK + i] = t2 if found else np.nan
        t[PUSH + i] = push if found else np.nan
        t[SPIN + i] = spin if found else np.nan
        t[KAPPA + i] = condition if found else np.inf
        t[STATUS + i] = code


@njit(error_model="numpy")
def _store_vectors(t, row, n, result, offset):
    whole = n - n % LANES
    for i in range(0, whole, LANES):
        store_vectors(result, offset + 3 * i, t, row + i, BLOCK)
    for i in range(whole, n):
        result[offset + 3 * i] = t[row + i]
        result[offset + 3 * i + 1] = t[row + BLOCK + i]
        result[offset + 3 * i + 2] = t[row + 2 * BLOCK + i]


@njit(error_model="numpy")
def _store_scalars(t, row, n, result, offset):
    for i in range(n):
        result[offset + i] = t[row + i]


@njit(error_model="numpy")
def _stream_vectors(t, row, whole, result, offset):
    for i in range(0, whole, LANES):
        stream_vectors(result, offset + 3 * i, t, row + i, BLOCK)


@njit(error_model="numpy")
def _stream_scalars(t, row, whole, result, offset):
    for i in range(0, whole, LANES):
        stream_row(result, offset + i, t, row + i)


@njit(error_model="numpy")
def can_stream(total, stride, result):
    """Whether results are large enough, and aligned, to be written past the caches."""
    return total >= _MIN_STREAMED and stride % LANES == 0 and result.ctypes.data % 64 == 0


@njit(error_model="numpy")
def store(t, start, n, stride, streaming, result, status):
    """Write a block of contacts out, field by field; fields begin `stride` contacts apart."""
    if streaming and n % LANES == 0:
        _stream_vectors(t, C, n, result, 3 * start)
        _stream_vectors(t, N, n, result, 3 * (stride + start))
        _stream_vectors(t, WRENCH, n, result, 3 * (2 * stride + start))
        _stream_vectors(t, TANGENTIAL, n, result, 3 * (3 * stride + start))
        _stream_scalars(t, PUSH, n, result, 12 * stride + start)
        _stream_scalars(t, SPIN, n, result, 13 * stride + start)
        _stream_scalars(t, KAPPA, n, result, 14 * stride + start)
    else:
        _store_vectors(t, C, n, result, 3 * start)
        _store_vectors(t, N, n, result, 3 * (stride + start))
        _store_vectors(t, WRENCH, n, result, 3 * (2 * stride + start))
        _store_vectors(t, TANGENTIAL, n, result, 3 * (3 * stride + start))
        _store_scalars(t, PUSH, n, result, 12 * stride + start)
        _store_scalars(t, SPIN, n, result, 13 * stride + start)
        _store_scalars(t, KAPPA, n, result, 14 * stride + start)
    for i in range(n):
        status[start + i] = np.int8(t[STATUS + i])
