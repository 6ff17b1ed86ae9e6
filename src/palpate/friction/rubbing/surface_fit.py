"""A whole limit surface from many slips: mu, c, the growth exponent gamma and the norm's exponent p.

At a normal force f_n and a slip (v, omega), v along the surface, the load lies where the limit surface's normal is
the slip (see `palpate.friction.limit_surface`): with a = v, b = e omega,

    (x, y) ~ (a, b)^(1/(p-1)),  |(x, y)|_p = 1,    f_t = mu f_n x,  tau = mu e f_n y,  e = c f_n^gamma.

Maximum likelihood over both components of every load (`palpate.friction.rubbing.slip_likelihood`), from several
starts; heavy tails (Lange, Little & Taylor 1989), a p above 2 and another mu along each of two axes only where the
likelihood asks for them. p is determined by two things: how far a load of both lies from the axes, and how
fast it turns as the slip does; so slips of both kinds and several ratios are wanted, see
`palpate.friction.rubbing.stroke_plan`.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize
from scipy.special import ndtri, stdtrit  # scipy.stats takes half a second to import

from palpate.errors import FloatArray
from palpate.estimation import HELD, Assumption, BrokenAssumption, Verdict
from palpate.friction.limit_surface import LARGEST_LOAD_EXPONENT, LARGEST_NORM_EXPONENT, LimitSurface
from palpate.friction.rubbing.slip_likelihood import TAIL, LoadErrors, SlipLoads
from palpate.friction.rubbing.slip_load import SlipLoad

MOST_SCATTER = 0.2
"""Of loads about their limit surface: real surfaces differ by some per cent from stroke to stroke."""

FAR = 5.0
"""In standard deviations, both components together: chance alone does that 4 times in a million loads."""

OFF = 0.1
"""Relative: what is off by less is what a sensor's zero and calibration make of light loads."""

FAR_INSIDE = 0.7
"""Of the load predicted for its slip: what is less, by `FAR_DEVIATIONS` of the scatter, had not slipped."""

FAR_DEVIATIONS = 3.0


@dataclass(frozen=True, slots=True, eq=False)
class FittedLoads:
    """Loads beside what a fit predicts of them, n of them.

    Attributes:
        scatter: Relative.
        distance: Of each from its prediction, in standard deviations, shape (n,).
        share: Its size over that predicted, shape (n,).
        at_bound: Names of parameters at a bound.
        axes: Largest and least mu by direction, if it differs; None else.
        off: How far it is from that predicted, over the size of that, shape (n,).
        sharpest: Whether p is at its largest.
    """

    scatter: float
    distance: FloatArray
    share: FloatArray
    at_bound: tuple[str, ...]
    axes: tuple[float, float] | None
    off: FloatArray
    sharpest: bool


def surface_verdict(loads: FittedLoads) -> Verdict:
    """Return which assumptions of a limit surface in slip do not hold for these loads."""
    return Verdict(tuple(_broken(loads)))


def _broken(loads: FittedLoads) -> Iterator[BrokenAssumption]:
    n = len(loads.distance)
    if loads.at_bound or loads.sharpest:
        names = ", ".join((*loads.at_bound, *(("p",) if loads.sharpest else ())))
        yield BrokenAssumption(
            Assumption.WITHIN_BOUNDS,
            f"{names} at the end of what is looked for",
            "no limit surface explains these loads; check units, and that the contact slipped in all of them",
        )
    if loads.scatter > MOST_SCATTER:
        yield BrokenAssumption(
            Assumption.NOISE_LEVEL,
            f"loads scatter by {100.0 * loads.scatter:.0f} % about it, at most {100.0 * MOST_SCATTER:.0f} %",
            "leave out loads of contacts that did not slip",
        )
    far = (loads.distance > FAR) & (loads.off > OFF)
    inside = loads.share < min(FAR_INSIDE, 1.0 - FAR_DEVIATIONS * min(loads.scatter, 0.1))
    if np.count_nonzero(inside) > max(1, 0.05 * n):
        yield BrokenAssumption(
            Assumption.NO_OUTLIERS,
            f"{np.count_nonzero(inside)} of {n} loads are less than {100.0 * FAR_INSIDE:.0f} % of what slip takes",
            "leave out loads of contacts that did not slip",
        )
    elif far.any():
        worst = int(np.argmax(loads.distance))
        yield BrokenAssumption(
            Assumption.NO_OUTLIERS,
            f"{np.count_nonzero(far)} of {n} loads are more than {FAR:g} deviations off, most number {worst}",
            "look at these, and measure them again",
        )
    if loads.axes is not None:
        largest, least = loads.axes
        yield BrokenAssumption(
            Assumption.WHITE_IN_DIRECTION,
            f"mu is {largest:.3g} along one direction, {least:.3g} across it",
            "take mu along both axes, or the smaller one for grasps",
        )


MIN_EXPONENT = 1.01
"""Of p while it is searched: at 1 the load jumps from corner to corner of the diamond."""

USUAL_EXPONENT = 2.0
"""Largest p that is looked for first: one patch of any round pressure lies below."""

SMALLEST_SCATTER, LARGEST_SCATTER = 0.003, 0.5
"""Between these it is looked for: less is not believed of any surface, more is no limit surface."""

PLACE_ERROR = 0.2e-3
"""How far beside the contact a finger that finds it by touch may turn [m]: the noise of the centroid, filtered.
Loads on the friction plant are off by what 0.06 mm does, but alike in slips that are alike, which counts as more:
with 0.1 mm p lay in its 95 % interval in 30 of 32 runs, with 0.2 mm in all (`benchmarks/friction.py`)."""

EVIDENCE = 10.0
"""By how much -2 log likelihood must fall, beside 2 for each parameter more, for a larger model: chance alone does
that in less than 1 of 300 fits."""

NEAR = 3.0
"""In standard deviations: where no load is farther off than that, and the scatter is below `MUCH`, tails are not
looked for."""

MUCH = 0.1
"""Scatter of loads that may hide tails."""

_STARTS = (1.15, 1.4, 1.8)
"""Values of p to begin with: near 1 the likelihood is flat where slips and axes are alike."""

_SCALE = np.array([0.1, 0.1, 0.1, 0.3, 0.1, 0.1, 1.0, 1.0])
"""How much of each parameter is about as much: theta, ln scatter and ln spread."""

_LARGEST_ANISOTROPY = 0.9
"""Of either part: mu along one axis is at most 4 times that along the other."""


@dataclass(frozen=True, slots=True)
class SlidingAxes:
    """Friction that differs by direction.

    Attributes:
        largest: mu along the axis of most friction.
        least: mu across it.
        heading: Of the axis of most friction, as the loads' headings are counted [rad].
    """

    largest: float
    least: float
    heading: float


@dataclass(frozen=True, slots=True, eq=False)
class LimitSurfaceFit:
    """A limit surface and how well it is known.

    Attributes:
        surface: The most likely one; mu is the quadratic mean over directions.
        covariance: Of (ln mu, ln c, gamma, p), shape (4, 4), such that 1.96 deviations hold 95 %. At an end of
            its range gamma or p is likelier within than this says.
        scatter: Of the loads about it, relative.
        loads: How many it rests on.
        axes: mu along two axes, where the loads ask for that; None if it is the same in all directions.
        verdict: Whether the loads are those of a limit surface in slip.
    """

    surface: LimitSurface
    covariance: FloatArray
    scatter: float
    loads: int
    axes: SlidingAxes | None = None
    verdict: Verdict = HELD

    @property
    def standard_deviations(self) -> tuple[float, float, float, float]:
        """Of mu, c [m], gamma and p."""
        mu, c, gamma, p = np.sqrt(np.diag(self.covariance)).tolist()
        return self.surface.friction * mu, self.surface.spin_length * c, gamma, p


def fit_limit_surface(
    loads: Sequence[SlipLoad],
    scatter: float | None = None,
    force_error: float = 1e-3,
    torque_error: float = 1e-5,
    place_error: float = 0.0,
) -> LimitSurfaceFit:
    """Return the most likely limit surface.

    Args:
        loads: At least four, of sliding, spinning and both; for gamma, at two normal forces or more.
        scatter: Standard deviation of a force or a torque from stroke to stroke, relative; found from the loads
            themselves if not given.
        force_error: The sensor's standard deviation of a mean force [N].
        torque_error: Likewise, of a torque [N m].
        place_error: By how much the finger may turn about another point than the contact, which slides it by
            `place_error` omega [m].

    Raises:
        InvalidValueError: Too few loads, or none of sliding or of spinning.
    """
    data = SlipLoads.of(loads)
    search = _Search(data, scatter, LoadErrors(force_error, torque_error, place_error))
    best = min((search.best(search.start(p)) for p in _STARTS), key=lambda one: one.unlikely)
    if scatter is None and (search.farthest(best) > NEAR or math.exp(best.x[6]) > MUCH):
        heavy = search.best(search.start(1.4), heavy=True), search.best(best.x, heavy=True)
        best = _asked_for(best, min(heavy, key=lambda one: one.unlikely), 0)
    if best.x[3] > USUAL_EXPONENT - 1e-3:
        best = _asked_for(best, search.best(best.x, heavy=best.heavy, exponent=LARGEST_NORM_EXPONENT), 0)
    if len(np.unique(np.round(np.mod(data.heading[data.speed > 0.0], math.pi), 2))) > 1:
        top = max(USUAL_EXPONENT, float(best.x[3]))
        best = _asked_for(best, search.best(best.x, heavy=best.heavy, exponent=top, axes=True), 2)
    return _fit(data, search, best, scatter is None)


@dataclass(frozen=True, slots=True, eq=False)
class _Found:
    x: FloatArray
    unlikely: float
    heavy: bool
    axes: bool = False


def _asked_for(small: _Found, large: _Found, more: int) -> _Found:
    return large if large.unlikely < small.unlikely - 2.0 * more - EVIDENCE else small


class _Search:
    """For the most likely parameters: theta, ln scatter, ln spread."""

    def __init__(self, data: SlipLoads, scatter: float | None, errors: LoadErrors) -> None:
        self.data, self.errors, self.given = data, errors, scatter
        self.gain = 1.0 if scatter is not None else data.measured.size / (data.measured.size - 5)

    def whitening(self, x: FloatArray) -> FloatArray:
        spread = 0.0 if self.given is not None else math.exp(x[7])
        return self.data.whitening(x[:6], math.exp(x[6]), spread, self.errors)

    def farthest(self, found: _Found) -> float:
        """Return how far the load that is farthest off is from its prediction, in standard deviations."""
        whitened = self.data.whitened(found.x[:6], self.whitening(found.x))
        return math.sqrt(float((whitened**2).sum(axis=0).max()))

    def start(self, p: float) -> FloatArray:
        """From medians, which loads that did not slip, or are wrong, do not carry away."""
        force, torque = self.data.measured / self.data.normal_force
        sliding, turning = self.data.speed > 0.0, self.data.spin > 0.0
        length = float(np.median(np.abs(torque[turning])) / max(float(np.median(np.abs(force[sliding]))), 1e-9))
        length = min(max(length, 1e-5), 0.5)
        mu = float(np.median(np.hypot(force, torque / length)))
        spread = 0.03 if self.given is None else max(self.given, SMALLEST_SCATTER)
        start = [math.log(max(mu, 1e-2)), math.log(length), 0.15, p, 0.0, 0.0, math.log(spread), math.log(1e-3)]
        return np.array(start)

    def best(
        self, start: FloatArray, *, heavy: bool = False, exponent: float = USUAL_EXPONENT, axes: bool = False
    ) -> _Found:
        low, high = _LOW.copy(), _HIGH.copy()
        high[3] = exponent
        if axes:
            low[4:6], high[4:6] = -_LARGEST_ANISOTROPY / math.sqrt(2.0), _LARGEST_ANISOTROPY / math.sqrt(2.0)
        if self.given is not None:
            low[6:], high[6:] = start[6:], start[6:]

        x = np.clip(start, low, high)
        free = np.flatnonzero(high > low)
        scale = _SCALE[free]

        def unlikely(scaled: FloatArray) -> float:
            x[free] = scaled * scale
            return self.data.unlikelihood(x[:6], self.whitening(x), heavy=heavy, gain=self.gain)

        def slopes(scaled: FloatArray) -> FloatArray:
            steps = _STEP * np.eye(len(free))
            return np.array([(unlikely(scaled + h) - unlikely(scaled - h)) / (2.0 * _STEP) for h in steps])

        bounds = list(zip(low[free] / scale, high[free] / scale, strict=True))
        result = minimize(
            unlikely,
            x[free] / scale,
            method="L-BFGS-B",
            jac=slopes,
            bounds=bounds,
            options={"ftol": 1e-11, "gtol": 1e-6, "maxiter": 200},
        )
        x[free] = np.asarray(result.x) * scale
        return _Found(x.copy(), float(result.fun), heavy, axes)


_STEP = 1e-5
"""For slopes, in units of `_SCALE`."""

_LOW = np.array([math.log(1e-3), math.log(1e-6), 0.0, MIN_EXPONENT, 0.0, 0.0, math.log(SMALLEST_SCATTER), -9.0])
_HIGH = np.array(
    [math.log(1e2), 0.0, LARGEST_LOAD_EXPONENT, USUAL_EXPONENT, 0.0, 0.0, math.log(LARGEST_SCATTER), -0.7]
)
_PRIOR = 12.0 / (_HIGH - _LOW)[:4] ** 2


def _fit(data: SlipLoads, search: _Search, found: _Found, scatter_found: bool) -> LimitSurfaceFit:
    theta, whitening = found.x[:6], search.whitening(found.x)
    squares = (data.whitened(theta, whitening) ** 2).sum(axis=0)
    weight = (TAIL + 2.0) / (TAIL + squares) if found.heavy else np.ones_like(squares)
    free = 6 if found.axes else 4
    jacobian = _jacobian(data, theta, whitening, free) * np.tile(np.sqrt(weight), 2)[:, None]
    # what the loads leave undetermined, a uniform prior over the range determines
    prior = np.concatenate([_PRIOR, np.full(free - 4, 3.0 / _LARGEST_ANISOTROPY**2)])
    covariance = np.linalg.inv(jacobian.T @ jacobian + np.diag(prior))[:4, :4]
    if scatter_found:
        # seen with few degrees of freedom: Student's quantile over the normal's, so that 1.96 deviations hold 95 %
        freedom = max(data.measured.size - free - 1, 2)
        covariance = covariance * (stdtrit(freedom, 0.975) / ndtri(0.975)) ** 2
    # from e at the middle force to c, that at 1 N
    to_one = np.eye(4)
    to_one[1, 2] = -math.log(data.middle_force)
    covariance = to_one @ covariance @ to_one.T
    mu, gamma, p = math.exp(theta[0]), float(theta[2]), float(theta[3])
    c = math.exp(theta[1]) * data.middle_force**-gamma
    axes = None
    if found.axes:
        size = math.hypot(theta[4], theta[5])
        heading = 0.5 * math.atan2(theta[5], theta[4])
        axes = SlidingAxes(mu * math.sqrt(1.0 + size), mu * math.sqrt(max(1.0 - size, 0.0)), heading)
    size = math.exp(found.x[6])
    names = ("mu", "spin length", "scatter")
    at_bound = tuple(
        name
        for name, k in zip(names, (0, 1, 6), strict=True)
        if scatter_found and (found.x[k] > _HIGH[k] - 1e-3 or (k < 2 and found.x[k] < _LOW[k] + 1e-3))
    )
    share, off = _beside(data, theta)
    fitted = FittedLoads(
        math.hypot(size, math.exp(found.x[7])) if scatter_found else size,
        np.sqrt(squares),
        share,
        at_bound,
        None if axes is None else (axes.largest, axes.least),
        off,
        p > LARGEST_NORM_EXPONENT - 1e-3,
    )
    return LimitSurfaceFit(
        LimitSurface(mu, c, gamma, p), covariance, size, len(squares), axes, surface_verdict(fitted)
    )


def _beside(data: SlipLoads, theta: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the size of each load over that predicted for its slip, and how far they differ over that."""
    e = np.exp(theta[1]) * (data.normal_force / data.middle_force) ** float(theta[2])
    force, torque = data.measured
    full_force, full_torque = data.predicted(theta)
    size = np.hypot(full_force, full_torque / e)
    off = np.hypot(force - full_force, (torque - full_torque) / e)
    return np.hypot(force, torque / e) / size, off / size


def _jacobian(data: SlipLoads, theta: FloatArray, whitening: FloatArray, free: int) -> FloatArray:
    columns = []
    for k in range(free):
        step = np.zeros(6)
        step[k] = 1e-5 * _SCALE[k]
        both = [data.whitened(theta + sign * step, whitening) for sign in (1.0, -1.0)]
        columns.append(((both[0] - both[1]) / (2.0 * step[k])).ravel())
    return np.column_stack(columns)
