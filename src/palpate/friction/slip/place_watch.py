"""Whether a place that should stand still has moved: a sequential test with a stated rate of false alarms.

A Kalman filter follows the place, which may wander slowly, as zeros of sensors drift. What each sample tells of it
that was not foreseen has, while nothing moves, mean zero and a known covariance, and is independent of what came
before. Whitened, its sum over the last w samples is compared with w: |sum|^2 / w is the generalised likelihood
ratio of a mean that jumped w samples ago by whatever (Willsky & Jones 1976; windows in powers of two lose at most
a factor of two in delay). While nothing moves it is chi-squared, so that alarms in a period are no more probable
than the sum over all windows, and false ones no more frequent than that.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from scipy.special import chdtri

from palpate.errors import InvalidValueError, check_not_negative, check_positive, positive
from palpate.sensing.held.felt_place import STILL
from palpate.spatial import IDENTITY, ZERO, Matrix, Vector, add_scaled, dot, rotate

ORTHONORMAL = 1e-6
"""By how much directions may miss being unit vectors at right angles."""


@dataclass(frozen=True, slots=True)
class StandingPlace:
    """How well a place stands still that stands still.

    Attributes:
        false_alarm_time: Mean time from one false alarm to the next, at least [s].
        jitter: Standard deviation along every axis that its covariance does not count, independent from sample to
            sample: of the arm's position, of what yields [m].
        wander: Of its random walk, after one second [m/sqrt(s)].
        alike: Time for which its noise is alike, as after a filter of that time constant [s].
        longest: Window [s]: a slower jump is told as it goes on.

    Raises:
        InvalidValueError: One of them cannot be.
    """

    false_alarm_time: float = 3600.0
    jitter: float = 2e-5
    wander: float = 3e-5
    alike: float = 0.0
    longest: float = 0.25

    def __post_init__(self) -> None:
        check_positive(self, false_alarm_time="s", jitter="m", longest="s")
        check_not_negative(self, wander="m/sqrt(s)", alike="s")


class PlaceWatch:
    """Tells when a place has moved. One call of `step` per period: 13 us for one direction, 36 for three.

    Attributes:
        alarm: Whether it has moved since `start`.
        moved: How far it had when the alarm was raised: the mean over the window that raised it [m].
    """

    def __init__(self, period: float, standing: StandingPlace | None = None) -> None:
        """Take the period [s], and how well the place stands still.

        Raises:
            InvalidValueError: The period is not above 0, or false alarms are to be so rare that no limit is.
        """
        own = StandingPlace() if standing is None else standing
        period = positive("period", period, "s")
        self._period = period
        count = max(1, 1 + math.floor(math.log2(max(own.longest / period, 1.0))))
        self._windows = tuple(2**k for k in range(count))
        self._chance = period / (own.false_alarm_time * count)
        self._alike = 1.0 + 2.0 * own.alike / period
        self._jitter, self._walk = own.jitter**2, own.wander**2 * period
        self._length = 2 * self._windows[-1]
        self.start()

    def start(self, directions: Sequence[Vector] = IDENTITY) -> None:
        """Begin anew: something is touched, from now on.

        Args:
            directions: Along which it stands still, one to three unit vectors at right angles: all three of a
                point, two across an edge, the normal of a plate.

        Raises:
            InvalidValueError: They are not.
        """
        for i, one in enumerate(directions):
            if any(abs(dot(one, other) - (i == j)) > ORTHONORMAL for j, other in enumerate(directions)):
                raise InvalidValueError(f"directions = {directions!r}: must be unit vectors at right angles")
        if not 1 <= len(directions) <= 3:
            raise InvalidValueError(f"directions = {directions!r}: must be one to three")
        self._directions, self._axes = tuple(directions), range(len(directions))
        self._limit = float(chdtri(len(directions), self._chance))
        zeros = [0.0] * len(directions)
        # the last sums of white surprises, and the surprises as they were [m]
        self._sums, self._surprises = [zeros] * self._length, [zeros] * self._length
        self._seen = 0
        self._place: list[float] = []
        self._covariance: list[list[float]] = []
        self.alarm, self.moved = False, ZERO

    def step(self, place: Vector, covariance: Matrix, drift: Matrix = STILL) -> bool:
        """Take one sample; return `alarm`. A place that is not finite says nothing.

        Args:
            place: Where it is felt [m].
            covariance: Of that, shape (3, 3) [m^2].
            drift: Covariance of the random walk by zeros that drift, besides `StandingPlace.wander`, shape (3, 3)
                [m^2/s].
        """
        axes = self._axes
        y = [dot(each, place) for each in self._directions]
        spread = [rotate(covariance, each) for each in self._directions]
        noise = [[self._alike * dot(a, b) for b in self._directions] for a in spread]
        walks = [rotate(drift, each) for each in self._directions] if drift is not STILL else []
        if self.alarm or not math.isfinite(sum(y) + sum(map(sum, noise))):
            return self.alarm
        for i in axes:
            noise[i][i] += self._jitter
        if not self._place:
            self._place, self._covariance = y, noise
            return False
        foreseen = self._covariance
        for i in axes:
            foreseen[i][i] += self._walk
            for j in axes if walks else ():
                foreseen[i][j] += self._period * dot(walks[i], self._directions[j])
        surprise = [y[i] - self._place[i] for i in axes]
        # by the root L of the surprise's covariance: white = L^-1 surprise, gain = L^-1 foreseen
        root: list[list[float]] = []
        white: list[float] = []
        gain: list[list[float]] = []
        for i in axes:
            row: list[float] = []
            for j in range(i):
                row.append((foreseen[i][j] + noise[i][j] - _sum(row, root[j], j)) / root[j][j])
            pivot = math.sqrt(foreseen[i][i] + noise[i][i] - _sum(row, row, i))
            white.append((surprise[i] - _sum(row, white, i)) / pivot)
            gain.append([(foreseen[i][k] - sum(row[j] * gain[j][k] for j in range(i))) / pivot for k in axes])
            root.append([*row, pivot])
        for a in axes:
            self._place[a] += sum(gain[i][a] * white[i] for i in axes)
            for b in axes:
                foreseen[a][b] -= sum(gain[i][a] * gain[i][b] for i in axes)
        return self._judge(white, surprise)

    def _judge(self, white: list[float], surprise: list[float]) -> bool:
        last, now = self._sums[(self._seen - 1) % self._length], self._seen % self._length
        self._sums[now] = sums = [before + new for before, new in zip(last, white, strict=True)]
        self._surprises[now] = surprise
        self._seen += 1
        best, most = 0, self._limit
        for window in self._windows:
            if window >= self._seen:
                break
            then = self._sums[(now - window) % self._length]
            ratio = sum((a - b) * (a - b) for a, b in zip(sums, then, strict=True)) / window
            if ratio > most:
                best, most = window, ratio
        if best:
            rows = [self._surprises[(now - k) % self._length] for k in range(best)]
            for i, direction in enumerate(self._directions):
                self.moved = add_scaled(self.moved, math.fsum(row[i] for row in rows) / best, direction)
            self.alarm = True
        return self.alarm


def _sum(a: list[float], b: list[float], count: int) -> float:
    return sum(a[k] * b[k] for k in range(count))
