"""How stiff the surface is along the path of a finger, from force and place where the force varied.

A contact point on a rigid surface moves across its normal: between two contacts the chord is square to the mean of
their normals, whatever the curvature (the next term is of third order in its length). What is left along the
normal is compression: with compliance C and normal force F the points sink by C dF. Summed along the path,

    D(s) = sum n . dp = a + b s - C F(s) + e(s),

where e is the noise of positions and the sum of the noise of normals along the path. Both are known to a model
(`SurfaceModel`, learned with the map), so C comes by generalised least squares over short windows, with a standard
deviation that needs no repetition: it is large where the force did not vary, and nothing is claimed there.
"""

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.spatial import KDTree

from palpate.errors import FloatArray, InvalidValueError, not_negative, numbers, positive
from palpate.mapping.layers import VertexLayer
from palpate.mapping.surface_map.model import SurfaceModel

KNOWN_SHARE = 0.3
"""A compliance is known where its standard deviation is below this share of it: then its inverse, the stiffness,
has a standard deviation too."""

GROUPS = 24
"""A window's contacts are averaged to at most so many."""

MIN_CONTACTS = 8
"""Contacts, after averaging, below which a window says nothing: three unknowns, and some to judge the fit by."""

MIN_FORCE_VARIATION = 2.0
"""Variation of the force over that of its noise, as the fit weighs both: below, what is known is noise."""

WHITE_SHARE = 0.3
"""Of the noise of positions, what does not keep along the path. It keeps the fit from weighing differences between
neighbours, which positions tell well and forces badly: with 0.1, a force noise of 0.01 N that is not there, or is
there and not given, is off by 7 % of a compliance of 0.5 mm/kN; with 0.3 by 2 %."""

REST_STEP = 0.1
"""Moves below this share of the noise's length are a finger at rest."""

NEAREST = 4
"""Number of windows from which the stiffness at a vertex is taken."""

LONGEST_PAUSE = 0.1
"""Between contacts of one window [s]: a longer one is a lift-off."""


@dataclass(frozen=True, slots=True, eq=False)
class LocalStiffness:
    """Compliance in n windows along a path.

    Attributes:
        position: Mean of the contacts, shape (n, 3) [m].
        compliance: Of the object, shape (n,) [m/N]; NaN where the force did not vary beyond its noise.
        compliance_sd: Standard deviation, shape (n,) [m/N]; NaN likewise.
    """

    position: FloatArray
    compliance: FloatArray
    compliance_sd: FloatArray

    def __len__(self) -> int:
        """Number of windows."""
        return len(self.compliance)

    @property
    def known(self) -> npt.NDArray[np.bool_]:
        """Where the stiffness is known, shape (n,): neither without a change of force, nor as good as rigid."""
        return _known(self.compliance, self.compliance_sd)

    @property
    def stiffness(self) -> FloatArray:
        """Force over compression, shape (n,) [N/m]; NaN where it is not known."""
        return _stiffness(self.compliance, self.compliance_sd)[0]

    @property
    def stiffness_sd(self) -> FloatArray:
        """Standard deviation of `stiffness`, to first order, shape (n,) [N/m]."""
        return _stiffness(self.compliance, self.compliance_sd)[1]

    @property
    def stiffness_at_least(self) -> FloatArray:
        """What the stiffness exceeds with 97.5 % probability, shape (n,) [N/m]; NaN where nothing is known."""
        return np.asarray(1.0 / np.maximum(self.compliance + 1.96 * self.compliance_sd, np.finfo(float).tiny))


def local_stiffness(
    time: FloatArray,
    position: FloatArray,
    normal: FloatArray,
    force: FloatArray,
    *,
    noise: SurfaceModel,
    window: float = 4e-3,
    force_noise: float = 0.01,
    known_compliance: float = 0.0,
) -> LocalStiffness:
    """Return the compliance of the surface along a path on which the force varied: a sine, a landing, a ramp.

    Args:
        time: Of n contacts in path order, shape (n,) [s].
        position: Points of the undeformed fingertip that touch, in the base frame, as sensed: nothing taken off
            for compression, shape (n, 3) [m].
        normal: The object's outward unit normals, shape (n, 3).
        force: Normal force, positive when pushing, shape (n,) [N].
        noise: How contacts err, such as the `model` of a learned map.
        window: Length of path that a value stands for [m]; a finger at rest fills one as well.
        force_noise: Standard deviation of the force's noise in one sample [N].
        known_compliance: Of tip and arm, if `position` includes their deflection [m/N]: taken off.

    Raises:
        InvalidValueError: Shapes do not fit, numbers are not finite, `window` or a noise is not positive.
    """
    window = positive("window", window, "m")
    force_noise = not_negative("force_noise", force_noise, "N")
    known_compliance = not_negative("known_compliance", known_compliance, "m/N")
    count = len(np.atleast_1d(np.asarray(time)))
    time, force = _checked("time", time, (count,)), _checked("force", force, (count,))
    position, normal = _checked("position", position, (count, 3)), _checked("normal", normal, (count, 3))
    if count < 2:
        return LocalStiffness(np.zeros((0, 3)), np.zeros(0), np.zeros(0))
    chord = np.diff(position, axis=0)
    middle = normal[1:] + normal[:-1]
    sunk = (chord * middle).sum(axis=1) / np.maximum(np.linalg.norm(middle, axis=1), 1e-9)
    depth = np.concatenate([[0.0], np.cumsum(sunk)])
    path = _path(position, normal, REST_STEP * noise.noise_length)
    found = []
    for i, j in _windows(time, position, path, window):
        value = _compliance(path[i:j] - path[i], depth[i:j], force[i:j], noise, force_noise)
        found.append((position[i:j].mean(axis=0), *value))
    places, values, deviations = zip(*found, strict=True) if found else ((), (), ())
    return LocalStiffness(
        np.array(places, np.float64).reshape(-1, 3),
        np.array(values, np.float64) - known_compliance,
        np.array(deviations, np.float64),
    )


def stiffness_layer(found: LocalStiffness, vertices: FloatArray, reach: float) -> VertexLayer:
    """Return the stiffness at the vertices of a mesh [N/m], NaN where it is not known.

    Compliances of the nearest windows are averaged by their precision; where they differ more than they should, as
    across the border of two materials, the deviation is widened (Birge, 1932).

    Args:
        found: Along the path.
        vertices: Shape (n, 3) [m].
        reach: Farthest a window is asked [m].
    """
    reach = positive("reach", reach, "m")
    known = np.isfinite(found.compliance_sd)
    unknown = np.full(len(vertices), np.nan)
    if not known.any() or not len(vertices):
        return VertexLayer("stiffness", unknown, unknown)
    asked = min(NEAREST, int(known.sum()))
    distance, index = KDTree(found.position[known]).query(vertices, asked, distance_upper_bound=reach)
    distance, index = np.reshape(distance, (-1, asked)), np.reshape(index, (-1, asked))
    near = np.isfinite(distance)
    index = np.where(near, index, 0)
    value, deviation = found.compliance[known][index], found.compliance_sd[known][index]
    weight = np.where(near, 1.0 / deviation**2, 0.0)
    total = weight.sum(axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        mean = (weight * value).sum(axis=1) / total
        spread = (weight * (value - mean[:, None]) ** 2).sum(axis=1) / np.maximum(near.sum(axis=1) - 1, 1)
        sd = np.sqrt(np.maximum(spread, 1.0) / total)
    return VertexLayer("stiffness", *_stiffness(mean, sd))


def _checked(name: str, value: object, shape: tuple[int, ...]) -> FloatArray:
    array = numbers(name, value)
    if array.shape != shape or not np.isfinite(array).all():
        raise InvalidValueError(
            f"{name} has shape {array.shape}: must be {shape} and finite, one row per contact; "
            "keep only contacts whose status is OK"
        )
    return array


def _known(compliance: FloatArray, sd: FloatArray) -> npt.NDArray[np.bool_]:
    return np.asarray(sd < KNOWN_SHARE * compliance)  # False for NaN


def _stiffness(compliance: FloatArray, sd: FloatArray) -> tuple[FloatArray, FloatArray]:
    known = _known(compliance, sd)
    safe = np.where(known, compliance, 1.0)
    return np.where(known, 1.0 / safe, np.nan), np.where(known, sd / safe**2, np.nan)


def _path(position: FloatArray, normal: FloatArray, least: float) -> FloatArray:
    """Return the arc length along the surface, in steps of at least `least`, as noise lengthens short ones."""
    found, so_far = [], 0.0
    points = position.tolist()
    anchor = points[0]
    for point, n in zip(points, normal.tolist(), strict=True):
        d = [point[k] - anchor[k] for k in range(3)]
        across = d[0] * n[0] + d[1] * n[1] + d[2] * n[2]
        away = math.sqrt(max(d[0] * d[0] + d[1] * d[1] + d[2] * d[2] - across * across, 0.0))
        if away >= least:
            so_far, anchor = so_far + away, point
        found.append(so_far)
    return np.array(found)


def _windows(time: FloatArray, position: FloatArray, path: FloatArray, window: float) -> list[tuple[int, int]]:
    """Return where windows begin and end: half overlapping, none across a lift-off or a jump."""
    jump = np.linalg.norm(np.diff(position, axis=0), axis=1) > window
    breaks = np.flatnonzero((np.diff(time) > LONGEST_PAUSE) | jump) + 1
    found = []
    for i, j in zip([0, *breaks], [*breaks, len(time)], strict=True):
        start = path[i]
        while True:
            a, b = np.searchsorted(path[i:j], [start, start + window], side="left") + i
            last = b >= j or path[j - 1] < start + 1.5 * window
            b = j if last else b
            if b - a >= MIN_CONTACTS:
                found.append((int(a), int(b)))
            if last:
                break
            start += 0.5 * window
    return found


def _compliance(
    path: FloatArray, depth: FloatArray, force: FloatArray, noise: SurfaceModel, force_noise: float
) -> tuple[float, float]:
    """Return the compliance of one window and its standard deviation; NaN where the force says nothing."""
    groups = min(GROUPS, len(path))
    starts = np.linspace(0, len(path), groups, endpoint=False).astype(int)
    size = np.diff(np.append(starts, len(path)))
    s, D, F = (np.add.reduceat(each, starts) / size for each in (path, depth, force))
    if groups < MIN_CONTACTS or not np.ptp(F):
        return math.nan, math.nan
    rest = np.column_stack([np.ones(groups), s - s.mean()])
    if s[-1] - s[0] < REST_STEP * noise.noise_length:
        rest = rest[:, :1]  # at rest there is no direction of motion
    whiten = np.linalg.inv(np.linalg.cholesky(_noise(s, noise)))
    Q = np.linalg.qr(whiten @ rest)[0]
    whiten -= Q @ (Q.T @ whiten)  # and leave out what offset and drift explain
    x, y = whiten @ F, whiten @ D
    # the force's own noise counts as variation, and would make the slope too small: its part is known
    own = force_noise**2 * float(((whiten**2).sum(axis=0) / size).sum())
    square = float(x @ x) - own
    if square <= MIN_FORCE_VARIATION * own:
        return math.nan, math.nan
    slope = float(x @ y) / square
    misfit = y - slope * x
    # wider where the model does not explain what is left, never narrower
    excess = max(1.0, float(misfit @ misfit) / (groups - rest.shape[1] - 1))
    return -slope, math.sqrt(float(x @ x) * excess) / square


def _noise(s: FloatArray, noise: SurfaceModel) -> FloatArray:
    """Return the covariance of sums of normal steps at places `s` along the path, shape (n, n) [m^2].

    Of positions, sigma^2 exp(-d / L); of normals, the double integral of the like from 0 to s and to t:
    tau^2 (2 L min(s, t) + L^2 (exp(-s/L) + exp(-t/L) - 1 - exp(-d/L))).
    """
    apart = np.abs(np.subtract.outer(s, s))
    V = noise.noise**2 * np.exp(-apart / noise.noise_length)
    L = noise.tilt_length
    decay = np.exp(-s / L)
    V += noise.tilt**2 * (
        2.0 * L * np.minimum.outer(s, s) + L * L * (np.add.outer(decay, decay) - 1.0 - np.exp(-apart / L))
    )
    V[np.diag_indices(len(s))] += (WHITE_SHARE * noise.noise) ** 2
    return V
