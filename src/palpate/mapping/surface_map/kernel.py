"""Inner loops of patches, compiled: numba, no Python objects.

Where there are many exponentials they come in from outside: numpy takes eight at a time.
"""

import math

import numpy as np

from palpate.compiling import njit


@njit(cache=True, error_model="numpy")
def fill_covariance(K, ar, decay, xy, scales, heights, slopes, height_correlation, slope_correlation):
    """Write the covariance of a patch's heights and slopes, and of what errs in them, into a triangle of K.

    Args:
        K: Shape (3 n, 3 n); its upper triangle is written, which is the lower one of its transpose.
        ar: Distances times a go into its upper triangle, shape (n, n).
        decay: exp(-ar) likewise.
        xy: Shape (n, 2) [m].
        scales: a, the variances of the process, of the plane's height and of its slope, and by which part of
            itself the diagonal grows.
        heights: Standard deviations of errors of heights, shape (n,) [m].
        slopes: Square roots of the covariances of those of slopes, shape (n, 2, 2).
        height_correlation: Of errors of heights, its upper triangle, shape (n, n).
        slope_correlation: Likewise.
    """
    a, s2, h2, p2, jitter = scales
    n = len(xy)
    for i in range(n):
        x, y = xy[i]
        S = slopes[i]
        for j in range(i, n):
            u, v = xy[j]
            dx, dy = x - u, y - v
            r = a * math.sqrt(dx * dx + dy * dy)
            e = math.exp(-r)
            ar[i, j], decay[i, j] = r, e
            A2 = a * a / 3.0 * s2 * e
            A1 = A2 * (1.0 + r)
            A2 *= a * a
            T, c = slopes[j], slope_correlation[i, j]
            k = s2 * (1.0 + r + r * r / 3.0) * e + h2 + p2 * (x * u + y * v)
            K[i, j] = k + heights[i] * heights[j] * height_correlation[i, j]
            K[i, n + j], K[i, 2 * n + j] = A1 * dx + p2 * x, A1 * dy + p2 * y
            K[j, n + i], K[j, 2 * n + i] = p2 * u - A1 * dx, p2 * v - A1 * dy
            K[n + i, n + j] = A1 - A2 * dx * dx + p2 + (S[0, 0] * T[0, 0] + S[0, 1] * T[0, 1]) * c
            K[2 * n + i, 2 * n + j] = A1 - A2 * dy * dy + p2 + (S[1, 0] * T[1, 0] + S[1, 1] * T[1, 1]) * c
            K[n + i, 2 * n + j] = -A2 * dx * dy + (S[0, 0] * T[1, 0] + S[0, 1] * T[1, 1]) * c
            K[n + j, 2 * n + i] = -A2 * dx * dy + (S[1, 0] * T[0, 0] + S[1, 1] * T[0, 1]) * c
    for i in range(3 * n):
        K[i, i] *= 1.0 + jitter


@njit(cache=True, error_model="numpy")
def correlate(path, extent, length):
    """Return `covariance.path_correlation` and how it grows with the logarithm of `length`.

    Returns:
        The correlation, shape (n, n); what ends of stretches add to the relative growth of a covariance with
        another stretch, beside the distance between them over `length`, shape (n,); and the growth of a stretch's
        own variance, shape (n,).
    """
    n = len(path)
    C, ends, own = np.empty((n, n)), np.empty(n), np.empty(n)
    half, g = np.empty(n), np.empty(n)
    for i in range(n):
        t = extent[i] / length
        half[i] = 0.5 * t
        # sinh(t/2) exp(-d/L) with the exponentials taken together: one alone leaves float64 for long stretches
        gone = math.expm1(-t)
        g[i] = -gone / t if t > 1e-6 else 1.0
        # the logarithm of g grows by 1 - exp(-t) / g, t / 2 of it where t is small
        ends[i] = 1.0 - math.exp(-t) * t / -gone if t > 1e-6 else half[i]
        if t < 1e-3:  # the series of what follows, whose difference cancels there
            C[i, i], own[i] = 1.0 - t / 3.0, t / 3.0
        else:
            C[i, i] = 2.0 / t * (1.0 + gone / t)
            own[i] = (2.0 + 2.0 * math.exp(-t)) / t + 4.0 * gone / (t * t)
        for j in range(i):
            apart = abs(path[i] - path[j]) / length - half[i] - half[j]
            C[i, j] = C[j, i] = g[i] * g[j] * math.exp(-max(apart, 0.0))
    return C, ends, own


@njit(cache=True, error_model="numpy")
def distances(xy, other, a):
    """Return distances between points of a plane, (n, 2) and (m, 2), times a, shape (n, m)."""
    found = np.empty((len(xy), len(other)))
    for i in range(len(xy)):
        for j in range(len(other)):
            dx, dy = xy[i, 0] - other[j, 0], xy[i, 1] - other[j, 1]
            found[i, j] = a * math.sqrt(dx * dx + dy * dy)
    return found


@njit(cache=True, error_model="numpy")
def fill_heights(K, xy, xy_at, ar, decay, scales):
    """Write `covariance.height_covariance` into K.

    Args:
        K: Shape (3 n, m).
        xy: Shape (n, 2) [m].
        xy_at: Shape (m, 2) [m].
        ar: Distances times a, shape (n, m).
        decay: exp(-ar), shape (n, m).
        scales: a and the variances of the process, of the plane's height and of its slope.
    """
    a, s2, h2, p2 = scales
    n, m = ar.shape
    for i in range(n):
        x, y = xy[i]
        for at in range(m):
            u, v = xy_at[at]
            r, e = ar[i, at], s2 * decay[i, at]
            A1 = a * a / 3.0 * e * (1.0 + r)
            K[i, at] = e * (1.0 + r + r * r / 3.0) + h2 + p2 * (x * u + y * v)
            K[n + i, at] = p2 * u - A1 * (x - u)
            K[2 * n + i, at] = p2 * v - A1 * (y - v)


@njit(cache=True, error_model="numpy", fastmath={"reassoc", "contract"})
def sum_surface(sums, xy_at, xy, weights, ar, decay, scales):
    """Write `covariance.weighted_sums` of the process alone into sums, shape (3, m).

    Args:
        sums: Rows are heights and slopes.
        xy_at: Where, shape (m, 2) [m].
        xy: Of the weights, shape (n, 2) [m].
        weights: Shape (3 n,).
        ar: Distances times a, shape (m, n).
        decay: exp(-ar), shape (m, n).
        scales: a^2 and the variance of the process.
    """
    a2, s2 = scales
    m, n = ar.shape
    for i in range(m):
        x, y = xy_at[i]
        h = hx = hy = 0.0
        for j in range(n):
            dx, dy, r, e = x - xy[j, 0], y - xy[j, 1], ar[i, j], s2 * decay[i, j]
            w, u, v = weights[j], weights[n + j], weights[2 * n + j]
            along = dx * u + dy * v
            A2 = a2 / 3.0 * e
            A1 = A2 * (1.0 + r)
            bend = A1 * w + a2 * A2 * along
            h += e * (1.0 + r + r * r / 3.0) * w + A1 * along
            hx += A1 * u - bend * dx
            hy += A1 * v - bend * dy
        sums[0, i], sums[1, i], sums[2, i] = h, hx, hy


@njit(cache=True, error_model="numpy")
def judge(heights, offset, sheet, axes, reach, flat_cos, steep_cos, sheet_cos):
    """Return cosines (k,), normals (k, 3) and weights (k,) of one patch's estimates; see `blend`.

    Args:
        heights: And slopes in its frame, shape (3, k).
        offset: Of the points from its centre, base frame, shape (k, 3) [m].
        sheet: Normals that tell sheets apart, shape (k, 3).
        axes: Of its frame, rows.
        reach: Where its weight ends [m].
        flat_cos: As `blend.FLAT_COS`.
        steep_cos: As `blend.STEEP_COS`.
        sheet_cos: As `blend.SAME_SHEET_COS`.
    """
    n = len(offset)
    cos, normal, weight = np.empty(n), np.empty((n, 3)), np.empty(n)
    for i in range(n):
        hx, hy = heights[1, i], heights[2, i]
        c = 1.0 / math.sqrt(1.0 + hx * hx + hy * hy)
        square = same = 0.0
        for k in range(3):
            square += offset[i, k] * offset[i, k]
            normal[i, k] = c * (axes[2, k] - hx * axes[0, k] - hy * axes[1, k])
            same += normal[i, k] * sheet[i, k]
        r = min(math.sqrt(square) / reach, 1.0)
        ramp = min(max((c - steep_cos) / (flat_cos - steep_cos), 0.0), 1.0)
        near = (1.0 - r) ** 4 * (4.0 * r + 1.0)
        cos[i], weight[i] = c, near * ramp * ramp * (3.0 - 2.0 * ramp) if same > sheet_cos else 0.0
    return cos, normal, weight


@njit(cache=True, error_model="numpy")
def fill_bends(K, xy, xy_at, ar, decay, scales):
    """Write `covariance.bend_covariance` into K.

    Args:
        K: Shape (3, n, 3, m).
        xy: Shape (n, 2) [m].
        xy_at: Shape (m, 2) [m].
        ar: Distances times a, shape (n, m).
        decay: exp(-ar), shape (n, m).
        scales: a and the variance of the process.
    """
    a, s2 = scales
    n, m = ar.shape
    for i in range(n):
        for at in range(m):
            x, y, r = xy_at[at, 0] - xy[i, 0], xy_at[at, 1] - xy[i, 1], ar[i, at]
            A2 = s2 * a * a / 3.0 * decay[i, at]
            A1 = A2 * (1.0 + r)
            A2 *= a * a
            steep = a * a * A2 / r if r > 0.0 else 0.0  # times products of x and y: 0 where they are
            xx, yy = steep * x * x - A2, steep * y * y - A2
            K[0, i, 0, at], K[0, i, 1, at], K[0, i, 2, at] = A2 * x * x - A1, A2 * x * y, A2 * y * y - A1
            K[1, i, 0, at], K[1, i, 1, at], K[1, i, 2, at] = (xx - 2.0 * A2) * x, xx * y, yy * x
            K[2, i, 0, at], K[2, i, 1, at], K[2, i, 2, at] = xx * y, yy * x, (yy - 2.0 * A2) * y


@njit(cache=True, error_model="numpy")
def sharpest_turn(values, path, extent):
    """Return the largest angle between normals of stretches that follow one another [rad]; 0 without such.

    Args:
        values: Heights, slopes along x and slopes along y, shape (3 n,).
        path: Where stretches lie along the path, increasing, shape (n,) [m].
        extent: How long they are, shape (n,) [m].
    """
    n, least = len(path), 1.0
    for i in range(n - 1):
        if path[i + 1] - path[i] <= extent[i] + extent[i + 1]:
            u, v, p, q = values[n + i], values[2 * n + i], values[n + i + 1], values[2 * n + i + 1]
            both = (1.0 + u * u + v * v) * (1.0 + p * p + q * q)
            least = min(least, (1.0 + u * p + v * q) / math.sqrt(both))
    return math.acos(least)


@njit(cache=True, error_model="numpy")
def squares(white):
    """Return the products of columns (k, i, m) and (k, j, m), summed over k, shape (m, 3, 3)."""
    n, _, m = white.shape
    found = np.zeros((3, 3, m))
    for k in range(n):
        for i in range(3):
            for j in range(i + 1):
                for at in range(m):
                    found[i, j, at] += white[k, i, at] * white[k, j, at]
    for i in range(3):
        for j in range(i):
            found[j, i] = found[i, j]
    return found.transpose(2, 0, 1).copy()


@njit(cache=True, error_model="numpy")
def evidence_slopes(inverse, weights, xy, ar, decay, scales, heights, slopes, path, noise, tilt):
    """Return tr((w w' - K^-1) dK/dt) for the logarithms of the six numbers of a model, in their order.

    Heights of the process grow with length^4, A1 with its square, A2 not: s^2 does with length^4. A covariance of
    noise grows with the logarithm of the path over which it keeps by its ends and by how far it lies apart.

    Args:
        inverse: Of the covariance K of the data; its lower triangle is read, shape (3 n, 3 n).
        weights: Inverse times the data, shape (3 n,).
        xy: Shape (n, 2) [m].
        ar: As `fill_covariance` leaves it.
        decay: Likewise.
        scales: As in `fill_covariance`.
        heights: Likewise.
        slopes: Likewise.
        path: Where stretches are along the path, shape (n,) [m].
        noise: Of heights: what `correlate` returns, half extents (n,) [m] and length [m].
        tilt: Likewise of slopes.
    """
    a, s2, _, _, jitter = scales
    a2 = a * a
    n = len(path)
    w = weights
    found = np.zeros(6)
    for j in range(n):
        for i in range(j, n):
            dx, dy, r = xy[i, 0] - xy[j, 0], xy[i, 1] - xy[j, 1], ar[j, i]
            W00 = w[i] * w[j] - inverse[i, j]
            W11 = w[n + i] * w[n + j] - inverse[n + i, n + j]
            W22 = w[2 * n + i] * w[2 * n + j] - inverse[2 * n + i, 2 * n + j]
            if i == j:
                W00, W11, W22 = (1.0 + jitter) * W00, (1.0 + jitter) * W11, (1.0 + jitter) * W22
            # block k, q at i, j less (slopes with heights) or also (both slopes) that at j, i
            W01 = w[i] * w[n + j] - inverse[n + j, i] - (w[j] * w[n + i] - inverse[n + i, j])
            W02 = w[i] * w[2 * n + j] - inverse[2 * n + j, i] - (w[j] * w[2 * n + i] - inverse[2 * n + i, j])
            W12 = w[n + i] * w[2 * n + j] - inverse[2 * n + j, n + i]
            W21 = w[2 * n + i] * w[n + j] - inverse[2 * n + i, n + j]
            straight = a2 / 3.0 * (W01 * dx + W02 * dy + W11 + W22)
            bent = a2 * a2 / 3.0 * (W11 * dx * dx + W22 * dy * dy + (W12 + W21) * dx * dy)
            A1 = 1.0 + r
            k = A1 + r * r / 3.0
            twice = 1.0 if i == j else 2.0
            size = twice * s2 * decay[j, i]
            found[0] += size * (W00 * (4.0 * k + r * r / 3.0 * A1) + straight * (2.0 * A1 + r * r) - bent * r)
            found[1] += size * 2.0 * (W00 * k + straight * A1 - bent)
            by_heights = twice * W00 * heights[i] * heights[j]
            found[2] += 2.0 * by_heights * noise[0][i, j]
            found[3] += by_heights * _growth(i, j, path, noise)
            S, T = slopes[i], slopes[j]
            by_slopes = W11 * (S[0, 0] * T[0, 0] + S[0, 1] * T[0, 1]) + W22 * (
                S[1, 0] * T[1, 0] + S[1, 1] * T[1, 1]
            )
            by_slopes += W12 * (S[0, 0] * T[1, 0] + S[0, 1] * T[1, 1]) + W21 * (
                S[1, 0] * T[0, 0] + S[1, 1] * T[0, 1]
            )
            by_slopes *= twice
            found[4] += 2.0 * by_slopes * tilt[0][i, j]
            found[5] += by_slopes * _growth(i, j, path, tilt)
    return found


@njit(error_model="numpy")
def _growth(i, j, path, noise):
    """How one entry of a correlation grows with the logarithm of its length."""
    correlation, ends, own, half, length = noise
    if i == j:
        return own[i]
    apart = (abs(path[i] - path[j]) - half[i] - half[j]) / length
    return correlation[i, j] * (ends[i] + ends[j] + max(apart, 0.0))
