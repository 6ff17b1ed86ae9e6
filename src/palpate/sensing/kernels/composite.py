"""The contact centroid on a tip made of patches, compiled."""

import math

import numpy as np

from palpate.compiling import njit
from palpate.sensing.contact import ContactStatus
from palpate.sensing.kernels.block import BLOCK
from palpate.sensing.kernels.contact_rows import clear_contact, last_scalars
from palpate.sensing.kernels.implicit import MIN_PUSH
from palpate.sensing.kernels.quadric import solve_quadric

_OK = int(ContactStatus.OK)
_AMBIGUOUS = int(ContactStatus.AMBIGUOUS)
_OUTSIDE = int(ContactStatus.OUTSIDE)


@njit(error_model="numpy")
def _violation(x, y, z, domain):
    """Return by how much a point lies outside a domain; negative inside."""
    worst = -math.inf
    for row in range(len(domain)):
        if domain[row, 0] != 0.0 or domain[row, 1] != 0.0 or domain[row, 2] != 0.0:
            excess = domain[row, 0] * x + domain[row, 1] * y + domain[row, 2] * z - domain[row, 3]
            worst = max(worst, excess)
    return worst


@njit(error_model="numpy")
def _relative_size(w, c, center):
    """Return |(|f|, |m| / |c|)|, moment and centroid about a center: what a condition number is relative to."""
    x, y, z = c[0] - center[0], c[1] - center[1], c[2] - center[2]
    mx = w[3] - (center[1] * w[2] - center[2] * w[1])
    my = w[4] - (center[2] * w[0] - center[0] * w[2])
    mz = w[5] - (center[0] * w[1] - center[1] * w[0])
    moment = math.sqrt(mx * mx + my * my + mz * mz) / math.sqrt(x * x + y * y + z * z)
    return math.hypot(math.sqrt(w[0] * w[0] + w[1] * w[1] + w[2] * w[2]), moment)


@njit(error_model="numpy", cache=True)
def solve_composite(packed, domains, centers, tolerance, wrenches, hard, result, status):
    """Solve n wrenches on every patch of a tip and keep, for each, the patch least outside its domain.

    Args:
        packed: Coefficients of the patches, shape (p, Packed.SIZE).
        domains: Half spaces (a, b) of the patches, a.x <= b, shape (p, k, 4); rows of zeros hold everywhere.
        centers: Of the patches, and last the tip's, which the condition is about, shape (p + 1, 3) [m].
        tolerance: Largest violation of a contact on the tip [m].
        wrenches: As in `solve_quadric`.
        hard: As in `solve_quadric`.
        result: Written, as in `solve_quadric`.
        status: Written, as in `solve_quadric`.

    Returns:
        As `solve_quadric`.
    """
    total, stride = len(status), len(result) // 15
    found = np.empty(15 * BLOCK)
    code = np.empty(BLOCK, np.int8)
    best = np.empty(BLOCK)
    chosen = np.zeros(BLOCK, np.int64)
    middle = centers[len(packed)]
    for start in range(0, total, BLOCK):
        n = min(BLOCK, total - start)
        for patch in range(len(packed)):
            solve_quadric(packed[patch], wrenches[6 * start : 6 * (start + n)], hard, found[: 15 * n], code[:n])
            for i in range(n):
                violation = math.inf
                if code[i] == _OK:
                    violation = _violation(found[3 * i], found[3 * i + 1], found[3 * i + 2], domains[patch])
                if patch == 0 or violation < best[i]:
                    best[i] = violation
                    chosen[i] = patch
                    status[start + i] = code[i]
                    for field in range(4):
                        for c in range(3):
                            result[3 * (field * stride + start + i) + c] = found[3 * (field * n + i) + c]
                    for field in range(3):
                        result[(12 + field) * stride + start + i] = found[(12 + field) * n + i]
        for i in range(n):
            own, w = centers[chosen[i]], wrenches[6 * (start + i) : 6 * (start + i) + 6]
            if status[start + i] == _OK and (own[0] != middle[0] or own[1] != middle[1] or own[2] != middle[2]):
                c = result[3 * (start + i) : 3 * (start + i) + 3]
                result[14 * stride + start + i] *= _relative_size(w, c, middle) / _relative_size(w, c, own)
            if status[start + i] == _OK and best[i] > tolerance:
                status[start + i] = _OUTSIDE
            push = result[12 * stride + start + i]
            # where rounding decides whether another patch is touched, its own solution has next to no normal force
            if (
                len(packed) > 1
                and status[start + i] == _OK
                and push * push < MIN_PUSH**2 * (w[0] * w[0] + w[1] * w[1] + w[2] * w[2])
            ):
                status[start + i] = _AMBIGUOUS
            if status[start + i] == _OUTSIDE or status[start + i] == _AMBIGUOUS:
                clear_contact(result, stride, start + i)
    return last_scalars(result, status)
