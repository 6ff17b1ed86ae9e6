"""Direct regression of the wrench on the channels, with terms beyond a line where loads that were left out ask.

What is fitted is what is used,
    wrench = c + A s + D p(s, T) + noise,
s the channels, p products of two of them, the temperature T (a zero that drifts with it), or products of a channel
and T (a sensitivity that does). Noise of the channels shrinks A, which is why the sensor itself is the model to
beat (`palpate.sensing.ft.calibration`); but with a good sensor it shrinks by 1e-6, channels that err alike are
weighted by how they do, and curvature needs no inverse.

Terms are found one by one. Every candidate is tried, and judged by the errors of loads that the fit never saw, all
rows of one load at once (leave-group-out; closed form, so that nothing is refitted). The one whose gain is most
standard errors enters, if these are `BETTER` or more. A term that is not there loses on loads that it never saw:
of 21 candidates one entered in 1 of 600 sets of 48 and 60 loads of a linear sensor.
"""

import itertools
from dataclasses import dataclass

import numpy as np

from palpate.errors import FloatArray, InvalidValueError
from palpate.sensing.ft.arrays import AXES
from palpate.sensing.ft.calibration import SMALLEST_NOISE, CalibrationFit
from palpate.sensing.ft.calibration_checks import LOADS_PER_UNKNOWN, FittedCalibration, calibration_verdict
from palpate.sensing.ft.calibration_map import CalibrationMap
from palpate.sensing.ft.left_out import Groups, left_out_residuals

BETTER = 2.0
"""Standard errors of the gain by which a model must predict loads better that it never saw."""

BLIND = 1e-6
"""Of its own length: a term with no more left beside the others says nothing."""

NEWTON = 50
"""Iterations to the readings without load; five are the rule."""

Term = tuple[int, ...]
"""Columns of (channels, temperature) that are multiplied."""


@dataclass(frozen=True, slots=True, eq=False)
class Readings:
    """What a sensor showed under known loads.

    Attributes:
        raw: Shape (n, k) [raw unit].
        loads: Shape (n, 6) [N, N m].
        ranges: Of the sensor, shape (6,) [N, N m].
        groups: Rows that are left out together.
        temperature: Of the sensor, shape (n,) [degrees Celsius]; None: not measured.
        used_at: Temperature at which the calibration is to hold, likewise.
    """

    raw: FloatArray
    loads: FloatArray
    ranges: FloatArray
    groups: Groups
    temperature: FloatArray | None = None
    used_at: float | None = None

    @property
    def channels(self) -> int:
        """Number of raw channels k."""
        return int(self.raw.shape[1])

    @property
    def columns(self) -> FloatArray:
        """Channels, and the temperature if it was measured, shape (n, k) or (n, k + 1)."""
        return self.raw if self.temperature is None else np.column_stack([self.raw, self.temperature])

    @property
    def candidates(self) -> tuple[Term, ...]:
        """What may be more than a line."""
        k = self.channels
        products = itertools.combinations_with_replacement(range(k), 2)
        thermal = ((k,), *((j, k) for j in range(k))) if self.temperature is not None else ()
        return (*products, *thermal)


def direct_regression(readings: Readings, sensor: CalibrationFit, terms: tuple[Term, ...] = ()) -> CalibrationFit:
    """Return the regression of known loads on what the sensor showed.

    Args:
        readings: The data.
        sensor: The sensor model of the same data.
        terms: Beyond a line.

    Raises:
        InvalidValueError: Too few loads for so many terms, or terms that bend so much that the sensor shows the
            same under different loads.
    """
    features = _Features.of(readings, terms)
    X = features.at(readings.columns)
    n, p = X.shape
    if n <= p:
        raise InvalidValueError(f"{n} loads for {p} unknowns per axis: load more")
    target = readings.loads / readings.ranges
    q, r = np.linalg.qr(X)
    inverse = np.linalg.inv(r)
    coefficients = inverse @ (q.T @ target)
    predicted = X @ coefficients
    left_out = left_out_residuals(q, predicted - target, readings.groups) * readings.ranges
    if not np.isfinite(left_out).all():
        raise InvalidValueError("rows of one load determine the regression alone: load more directions")
    covariance = (target - predicted).T @ (target - predicted) / (n - p)
    spread = inverse @ inverse.T
    found, to_map = features.map(coefficients * readings.ranges, np.array(sensor.map.offset), readings.used_at)

    def leverage(wrench: FloatArray) -> float:
        shown = np.append(sensor.sensitivity @ wrench + sensor.map.offset, features.thermal(readings.used_at))
        (x,) = features.at(shown[None])
        return float(x @ spread @ x)

    others = tuple(term for term in readings.candidates if term not in terms)
    bends = _Features.of(readings, others).at(readings.columns)[:, 1 + readings.channels :]
    sd = np.sqrt(np.diag(covariance))
    full = np.array([leverage(sign * load) for load in np.diag(readings.ranges) for sign in (1.0, -1.0)])
    doubt = sd * np.sqrt(full.reshape(6, 2).max(axis=1))
    tested = FittedCalibration(
        loads=readings.loads,
        ranges=readings.ranges,
        raw=readings.raw,
        linear=readings.loads @ sensor.sensitivity.T + sensor.map.offset,
        basis=q,
        root=np.ones((n, 1)),
        expected=predicted,
        residual=target - predicted,
        names=AXES,
        bends=bends,
        bend_names=tuple(_words((term,), readings.channels) for term in others),
        noisy=sd > SMALLEST_NOISE,
        matched=np.eye(6),
        left_out=left_out,
        doubt=doubt,
        condition=sensor.condition,
        felt=sensor.felt,
    )
    return CalibrationFit(
        model="direct regression" + (f" with {_words(terms, readings.channels)}" if terms else ""),
        map=found,
        sensitivity=sensor.sensitivity,
        condition=sensor.condition,
        felt=sensor.felt,
        load_condition=sensor.load_condition,
        loads=readings.loads,
        residual=(predicted - target) * readings.ranges,
        left_out=left_out,
        matrix_sd=np.outer(sd * readings.ranges, np.sqrt(np.diag(to_map @ spread @ to_map.T))),
        noise=covariance * np.outer(readings.ranges, readings.ranges),
        leverage=leverage,
        doubt=doubt,
        verdict=calibration_verdict(tested),
    )


def terms_asked_for(readings: Readings) -> tuple[Term, ...]:
    """Return the terms that make loads better predicted that the fit never saw, in the order in which they enter.

    What enters is one term, the squares of all channels, or the dependence of all on the temperature.
    """
    features = _Features.of(readings, readings.candidates)
    X = features.at(readings.columns)
    first, k = 1 + readings.channels, readings.channels
    basis = np.linalg.qr(X[:, :first])[0]
    target = readings.loads / readings.ranges
    most = len(readings.groups) // LOADS_PER_UNKNOWN
    squares = [i for i, term in enumerate(features.terms) if len(term) == 2 and term[0] == term[1]]
    thermal = [i for i, term in enumerate(features.terms) if len(term) == 2 and term[1] == k]
    steps = [[i] for i in range(len(features.terms))] + [squares, thermal]
    chosen: list[int] = []
    while True:
        before = _errors(basis, target, readings.groups)
        best, wider = BETTER, basis
        entering: list[int] = []
        for step in steps:
            more = [i for i in step if i not in chosen]
            if more and basis.shape[1] + len(more) <= most:
                tried = _widened(basis, X[:, [first + i for i in more]])
                sure = surely_better(before, _errors(tried, target, readings.groups))
                if sure >= best:
                    best, entering, wider = sure, more, tried
        if not entering:
            return tuple(features.terms[i] for i in chosen)
        chosen += entering
        basis = wider


def errors_by_group(errors: FloatArray, groups: Groups) -> FloatArray:
    """Return the mean square errors of each group, shape (groups, 6)."""
    return np.array([(errors[group] ** 2).mean(axis=0) for group in groups])


def surely_better(before: FloatArray, after: FloatArray) -> float:
    """Return by how many of its standard errors the mean square error of groups gets less, shape (groups, 6) both.

    Each axis counts in units of what it was, so that one that is worse than others does not drown them.
    """
    gain = ((before - after) / np.maximum(before.mean(axis=0), 1e-300)).sum(axis=1)
    error = float(gain.std(ddof=1)) / np.sqrt(len(gain))
    sure = float(gain.mean()) / max(error, 1e-300)
    return sure if np.isfinite(sure) else -np.inf


def _errors(basis: FloatArray, target: FloatArray, groups: Groups) -> FloatArray:
    left = target - basis @ (basis.T @ target)
    return errors_by_group(left_out_residuals(basis, left, groups), groups)


def _widened(basis: FloatArray, columns: FloatArray) -> FloatArray:
    """Return an orthonormal basis that spans more columns, too; what it spans already adds nothing."""
    left = columns - basis @ (basis.T @ columns)
    left -= basis @ (basis.T @ left)
    u, singular, _ = np.linalg.svd(left / np.linalg.norm(columns, axis=0), full_matrices=False)
    return np.hstack([basis, u[:, singular > BLIND]])


@dataclass(frozen=True, slots=True, eq=False)
class _Features:
    """(1, channels, terms), channels and temperature in units of their spread about their mean.

    Attributes:
        channels: Number of raw channels k.
        mean: Of the channels, and of the temperature if there is one, shape (k,) or (k + 1,).
        spread: Likewise.
        terms: Beyond a line.
    """

    channels: int
    mean: FloatArray
    spread: FloatArray
    terms: tuple[Term, ...]

    @classmethod
    def of(cls, readings: Readings, terms: tuple[Term, ...]) -> "_Features":
        """Return those of a set of readings."""
        columns = readings.columns
        spread = columns.std(axis=0)
        return cls(readings.channels, columns.mean(axis=0), np.where(spread > 0.0, spread, 1.0), terms)

    def at(self, columns: FloatArray) -> FloatArray:
        """Return the features of channels and temperature, shape (n, p)."""
        scaled = (columns - self.mean) / self.spread
        products = [scaled[:, list(term)].prod(axis=1) for term in self.terms]
        return np.column_stack([np.ones(len(scaled)), scaled[:, : self.channels], *products])

    def thermal(self, temperature: float | None) -> FloatArray:
        """Return a temperature as a further column, if there is one, shape (1,) or (0,)."""
        if len(self.mean) == self.channels:
            return np.empty(0)
        return np.array([self.mean[-1] if temperature is None else temperature])

    def map(
        self, coefficients: FloatArray, near: FloatArray, temperature: float | None
    ) -> tuple[CalibrationMap, FloatArray]:
        """Return the map at a temperature, and what of the coefficients its columns are made of.

        Args:
            coefficients: Of the features, shape (p, 6) [N, N m].
            near: Readings without load, about, shape (k,) [raw unit].
            temperature: [degrees Celsius]; None: the mean.
        """
        k = self.channels
        columns = np.concatenate([near, self.thermal(temperature)])
        for _ in range(NEWTON):
            # readings without load: the nearest to those of the sensor model
            slope = self._slope(columns) @ coefficients
            step = np.linalg.lstsq(slope.T, self.at(columns[None])[0] @ coefficients)[0]
            columns[:k] -= step
            if np.linalg.norm(step / self.spread[:k]) < 1e-13:
                break
        else:
            raise InvalidValueError(
                "terms beyond a line leave no readings without load: load less far, or more evenly"
            )
        bent = [(i, term) for i, term in enumerate(self.terms) if max(term) < k]
        products = np.zeros((len(bent), len(coefficients)))
        for row, (i, term) in enumerate(bent):
            products[row, 1 + k + i] = 1.0 / self.spread[list(term)].prod()
        to_map = np.vstack([self._slope(columns), products])
        matrix = (to_map @ coefficients).T
        pairs = tuple((term[0], term[-1]) for _, term in bent)
        offset = tuple(columns[:k].tolist())
        return CalibrationMap(tuple(map(tuple, matrix.tolist())), offset, pairs), to_map

    def _slope(self, columns: FloatArray) -> FloatArray:
        """Return the derivatives of the features by each channel, shape (k, p)."""
        scaled = (columns - self.mean) / self.spread
        slope = np.zeros((self.channels, 1 + self.channels + len(self.terms)))
        slope[:, 1 : 1 + self.channels] = np.eye(self.channels)
        for i, term in enumerate(self.terms):
            for place, channel in enumerate(term):
                if channel < self.channels:
                    others = [other for at, other in enumerate(term) if at != place]
                    slope[channel, 1 + self.channels + i] += scaled[others].prod()
        return np.asarray(slope / self.spread[: self.channels, None])


def _words(terms: tuple[Term, ...], channels: int) -> str:
    """Name terms by their channels, counted from 0."""
    names = [*(f"raw_{j}" for j in range(channels)), "temperature"]
    return ", ".join(" x ".join(names[column] for column in term) for term in terms)
