"""What a sensor shows without load: its average over a while at rest, and whether it stays.

Readings of a filtered sensor are alike from one to the next, so that the standard error of their mean is larger
than sd/sqrt(n). It is taken from the means of a few long batches instead (batch means; Law & Kelton), which are
independent once a batch is much longer than the filter's memory.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.special import stdtrit

from palpate.errors import FloatArray, InvalidValueError
from palpate.estimation import Assumption, BrokenAssumption, Verdict, white_in_time
from palpate.sensing.ft.arrays import AXES, finite_rows, positive_entries
from palpate.spatial import Wrench

BATCHES = 20
"""Enough that Student's t is near the normal law, few enough that each is long."""

MIN_READINGS = 5 * BATCHES
"""So that a batch holds five."""

STILL_FACTOR = 2.0
"""Standard deviation of readings at rest, in units of the noise; above, something moved."""

MOVED_FACTOR = 3.0
"""Change over the window that counts as motion, in units of the noise of one reading: from 100 readings on, white
noise makes a change of 0.35 of it, and less with more."""

CONFIDENCE = 0.95
"""Of the six intervals of a drift together."""


DEPENDENT = 1e-4
"""Probability of batches so much alike, below which they are held to depend on one another."""


@dataclass(frozen=True, slots=True)
class BiasEstimate:
    """The mean of readings at rest.

    Attributes:
        mean: Of the wrench [N, N m]; it includes the weight of a payload.
        standard_error: Of each entry [N, N m].
        sd: Of a single reading, per axis [N, N m]: the noise as seen.
        reading_count: Number of readings used.
        verdict: Whether the standard error can be relied on.
    """

    mean: Wrench
    standard_error: Wrench
    sd: Wrench
    reading_count: int
    verdict: Verdict


def average_bias(wrench: npt.ArrayLike, *, noise: npt.ArrayLike) -> BiasEstimate:
    """Return the mean of readings at rest.

    Args:
        wrench: Equally spaced readings without contact, the sensor at rest, shape (n, 6) [N, N m], n >= 100.
        noise: Standard deviation of one reading, as known of this sensor, shape (6,) [N, N m].

    Raises:
        InvalidValueError: Wrong shapes, not finite, too few, or the readings moved: their spread or a trend is
            more than noise explains (axis, value and limit are named).
    """
    rows = _enough(wrench)
    sd_known = positive_entries("noise", noise, 6, "N, N m")
    mean, sd = rows.mean(axis=0), rows.std(axis=0, ddof=1)
    worst = int(np.argmax(sd / sd_known))
    if sd[worst] > STILL_FACTOR * sd_known[worst]:
        raise InvalidValueError(
            f"the readings moved: {AXES[worst]} has a standard deviation of {sd[worst]:.3g}, more than "
            f"{STILL_FACTOR:g} times the noise of {sd_known[worst]:.3g}. Stop the arm, touch nothing, try again"
        )
    batches = _batch_means(rows)
    x = np.arange(float(BATCHES)) - 0.5 * (BATCHES - 1)
    change = BATCHES * _line(x, batches)[0]
    i = int(np.argmax(np.abs(change) / sd_known))
    if abs(change[i]) > MOVED_FACTOR * sd_known[i]:
        raise InvalidValueError(
            f"the readings moved: {AXES[i]} changed by {change[i]:.3g} over the {len(rows)} readings, more "
            f"than {MOVED_FACTOR:g} times the noise of {sd_known[i]:.3g}. Let the sensor warm up and the arm rest"
        )
    from_batches = batches.std(axis=0, ddof=1) / np.sqrt(BATCHES)
    return BiasEstimate(
        _wrench(mean), _wrench(from_batches), _wrench(sd), len(rows), Verdict(tuple(_dependent(batches)))
    )


@dataclass(frozen=True, slots=True, eq=False)
class Drift:
    """How fast the readings of an unloaded sensor change.

    Attributes:
        slope: Shape (6,) [N/s, N m/s].
        half_width: Of intervals that hold all six slopes with 95 % (Bonferroni), shape (6,).
        verdict: Against the limit that was given: beyond it, within it (OK), or not to be decided.
    """

    slope: FloatArray
    half_width: FloatArray
    verdict: Verdict


def estimate_drift(wrench: npt.ArrayLike, *, period: float, limit: npt.ArrayLike) -> Drift:
    """Return the drift of an unloaded sensor at rest.

    Args:
        wrench: Equally spaced readings, shape (n, 6) [N, N m], n >= 100.
        period: Between two readings [s].
        limit: What is tolerated, shape (6,) [N/s, N m/s].

    Raises:
        InvalidValueError: Wrong shapes, not finite, or too few.
    """
    rows = _enough(wrench)
    seconds = float(positive_entries("period", period, 1, "s")[0])
    most = positive_entries("limit", limit, 6, "N/s, N m/s")
    spacing = seconds * (len(rows) // BATCHES)
    x = spacing * (np.arange(float(BATCHES)) - 0.5 * (BATCHES - 1))
    slope, se = _line(x, _batch_means(rows))
    half = float(stdtrit(BATCHES - 2, 1.0 - 0.5 * (1.0 - CONFIDENCE) / 6)) * se
    return Drift(slope, half, Verdict(tuple(_drifting(slope, half, most))))


def _drifting(slope: FloatArray, half: FloatArray, most: FloatArray) -> Iterator[BrokenAssumption]:
    beyond = (np.abs(slope) - half) / most
    i = int(np.argmax(beyond))
    if beyond[i] > 1.0:
        yield BrokenAssumption(
            Assumption.WHITE_IN_TIME,
            f"{AXES[i]} drifts by {slope[i]:.2g} +- {half[i]:.1g} per second, at most {most[i]:.2g}",
            "let the sensor warm up",
        )
        return
    possible = (np.abs(slope) + half) / most
    i = int(np.argmax(possible))
    if possible[i] > 1.0:
        yield BrokenAssumption(
            Assumption.ENOUGH_DATA,
            f"{AXES[i]} may drift by {abs(slope[i]) + half[i]:.2g} per second, at most {most[i]:.2g}",
            "take readings for longer",
        )


def _dependent(batches: FloatArray) -> Iterator[BrokenAssumption]:
    rarity = white_in_time(batches)
    if rarity < DEPENDENT:
        yield BrokenAssumption(
            Assumption.WHITE_IN_TIME,
            f"means of {BATCHES} batches follow one another: probability {rarity:.0e}, at least {DEPENDENT:g}",
            "take readings for longer than the sensor's filter remembers, and let it warm up",
        )


def _enough(wrench: npt.ArrayLike) -> FloatArray:
    rows = finite_rows("wrench", wrench, 6, "N, N m")
    if len(rows) < MIN_READINGS:
        raise InvalidValueError(f"{len(rows)} readings: give {MIN_READINGS} or more")
    return rows


def _batch_means(rows: FloatArray) -> FloatArray:
    """Return the means of `BATCHES` equal batches, shape (BATCHES, 6); a remainder at the start is left out."""
    length = len(rows) // BATCHES
    return np.asarray(rows[len(rows) - BATCHES * length :].reshape(BATCHES, length, 6).mean(axis=1))


def _line(x: FloatArray, y: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Fit y = mean + slope x for x of mean zero; return slope and its standard error per column."""
    energy = float(x @ x)
    slope = x @ (y - y.mean(axis=0)) / energy
    left = y - y.mean(axis=0) - np.outer(x, slope)
    return slope, np.sqrt((left**2).sum(axis=0) / (len(x) - 2) / energy)


def _wrench(value: FloatArray) -> Wrench:
    a, b, c, d, e, f = value.tolist()
    return (a, b, c, d, e, f)
