"""Whether the model of a calibration by touches holds, tested on the touches.

Most are score tests: a few more unknowns (a tip that moved at some touch, a target softer than the others, a skin
that takes another share, deviations from the shape) must not explain the touches better than chance makes them.
None of them needs another fit.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.special import chdtrc  # scipy.stats takes half a second to import

from palpate.errors import FloatArray
from palpate.estimation import Assumption, BrokenAssumption, Verdict
from palpate.sensing.tip_calibration.equations import Solved, TouchEquations
from palpate.surfaces.near_sphere import COUNTS

CHANCE = 1e-4
"""Probability of each test that a sound calibration fails it."""

LEAST_FREE = 6.0
"""Degrees of freedom that must be left, so that the residuals tell something."""

SCATTER = 5.0
"""Times the arm's own that touches may scatter: beyond, something else moves or deviates."""


@dataclass(frozen=True, slots=True, eq=False)
class WeightedFit:
    """What the tests need of a fit.

    Attributes:
        equations: Of the touches.
        solved: At the values found.
        whitening: Makes the noise of each touch's residuals white, shape (n, 3, 3).
        jacobian: Of whitened residuals, then of what is known beforehand, shape (3 n + q, q).
        weighted: Those residuals, shape (3 n + q,).
        leverage: Of the touches' residuals, shape (n, 3).
        spread: Inverse of J'J, shape (q, q).
        told: Which unknowns the touches tell.
        scatter: Scatter found [m].
        converged: Whether the iteration did.
        values: Of the unknowns.
    """

    equations: TouchEquations
    solved: Solved
    whitening: FloatArray
    jacobian: FloatArray
    weighted: FloatArray
    leverage: FloatArray
    spread: FloatArray
    told: npt.NDArray[np.bool_]
    scatter: float
    converged: bool
    values: FloatArray

    @property
    def each(self) -> FloatArray:
        """Whitened residuals of the touches, shape (n, 3)."""
        n = len(self.whitening)
        return self.weighted[: 3 * n].reshape(n, 3)

    def standard_error(self, column: FloatArray) -> float:
        """Return the standard error of one more unknown, by whose derivatives (n, 3, 1) residuals change."""
        return 1.0 / max(float(np.linalg.norm(self._free(column)[0])), 1e-12)

    def gain(self, columns: FloatArray) -> float:
        """Return by how much chi square falls with more unknowns.

        Args:
            columns: Derivatives of the residuals by them, shape (n, 3, k).
        """
        free, whole = self._free(columns)
        scale = np.linalg.norm(free, axis=0)
        seen = scale > 1e-6 * np.maximum(whole, 1e-300)
        if not seen.any():
            return 0.0
        q, r = np.linalg.qr(free[:, seen] / scale[seen])
        sound = np.abs(np.diag(r)) > 1e-6
        return float(np.sum((q[:, sound].T @ self.weighted) ** 2))

    def _free(self, columns: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Whitened columns (n, 3, k) less what the fit explains, and the norms of the whole, (k,)."""
        white = (self.whitening @ columns).reshape(3 * len(columns), -1)
        padded = np.concatenate([white, np.zeros((len(self.weighted) - len(white), white.shape[1]))])
        return padded - self.jacobian @ (self.spread @ (self.jacobian.T @ padded)), np.linalg.norm(padded, axis=0)


def verdict_of(fit: WeightedFit) -> Verdict:
    """Return what of the model does not hold."""
    found = (
        *_converged(fit),
        *_enough(fit),
        *_told(fit),
        *_moved(fit),
        *_soft_target(fit),
        *_soft_share(fit),
        *_off_shape(fit),
        *_outliers(fit),
        *_noise(fit),
    )
    return Verdict(found)


def _converged(fit: WeightedFit) -> Iterator[BrokenAssumption]:
    if not fit.converged:
        yield BrokenAssumption(
            Assumption.CONVERGED, "least squares did not converge", "type a tip that is closer to the real one"
        )


def _enough(fit: WeightedFit) -> Iterator[BrokenAssumption]:
    free = float(np.sum(1.0 - fit.leverage))
    if free < LEAST_FREE:
        yield BrokenAssumption(
            Assumption.ENOUGH_DATA,
            f"{len(fit.solved.gap)} touches leave {free:.1f} degrees of freedom, at least {LEAST_FREE:g}",
            "add touches",
        )


def _told(fit: WeightedFit) -> Iterator[BrokenAssumption]:
    unknowns = fit.equations.unknowns
    wanted = [
        *range(len(unknowns.each))[unknowns.blocks["size"]],
        *range(len(unknowns.each))[unknowns.blocks["center"]],
    ]
    missing = [
        unknowns.each[i].name for i in wanted if not fit.told[i] and not unknowns.each[i].name.startswith("length")
    ]
    if missing:
        normals = fit.solved.normal
        mean = np.linalg.norm(normals.mean(axis=0))
        near = "; all touch the same side of the tip" if mean > NEARLY_ONE_SIDE else ""
        yield BrokenAssumption(
            Assumption.CONDITIONED,
            f"the touches do not tell {', '.join(missing)}{near}",
            "touch with other sides of the tip, and a point or an edge besides plates; --plan says which",
        )


NEARLY_ONE_SIDE = 0.97
"""Length of the mean of the normals: within 14 degrees of one another."""


def _moved(fit: WeightedFit) -> Iterator[BrokenAssumption]:
    unknowns = fit.equations.unknowns
    columns = fit.equations.jacobian(fit.values)[:, :, unknowns.blocks["center"]]
    order = np.argsort(fit.equations.touches.time, kind="stable")
    best, place, tests = 0.0, 0, 0
    for k in range(LEAST_BESIDE, len(order) - LEAST_BESIDE + 1):
        after = np.zeros(len(order))
        after[order[k:]] = 1.0
        gain = fit.gain(after[:, None, None] * columns)
        tests += 1
        if gain > best:
            best, place = gain, k
    if tests and chdtrc(3, best) * tests < CHANCE:
        time = float(fit.equations.touches.time[order[place]])
        yield BrokenAssumption(
            Assumption.WHITE_IN_TIME,
            f"from touch {order[place]} (t = {time:.1f} s) on the tip sits elsewhere: chi square falls "
            f"by {best:.0f}",
            "fasten tip, sensor and targets, and touch again",
        )


LEAST_BESIDE = 3
"""Touches before and after a move, for it to be told from bad ones."""


def _soft_target(fit: WeightedFit) -> Iterator[BrokenAssumption]:
    equations = fit.equations
    at, targets = equations.touches.target, equations.unknowns.targets
    there = np.unique(at)
    if len(there) < 2:
        return
    column = equations.by_softness(fit.solved)
    gains = [(fit.gain((column * (at == j)[:, None])[:, :, None]), int(j)) for j in there]
    gain, j = max(gains)
    if chdtrc(1, gain) * len(gains) < CHANCE:
        yield BrokenAssumption(
            Assumption.CONSISTENT,
            f"the skin looks of another stiffness on {targets[j].name} than on the others, chi square falls by "
            f"{gain:.0f}",
            f"is {targets[j].name} soft, or loose? Touch something hard that is fixed",
        )


def _soft_share(fit: WeightedFit) -> Iterator[BrokenAssumption]:
    columns = fit.equations.by_share(fit.solved)[:, :, None]
    # without friction the forces' noise alone moves contacts with the share: nothing is told then
    if fit.standard_error(columns) > SHARE_TOLD:
        return
    gain = fit.gain(columns)
    if chdtrc(1, gain) < CHANCE:
        yield BrokenAssumption(
            Assumption.CONSISTENT,
            f"contacts lie elsewhere than where a skin on hard targets has them, chi square falls by {gain:.0f}",
            "are the targets soft? Touch hard ones, or press less",
        )


SHARE_TOLD = 0.2
"""Standard error of the share below which it is told: a soft target takes a half."""


def _off_shape(fit: WeightedFit) -> Iterator[BrokenAssumption]:
    unknowns = fit.equations.unknowns
    if len(unknowns.of("deviations", fit.values)):
        return
    columns = fit.equations.by_deviations(fit.values, fit.solved, COUNTS[2])
    gain = fit.gain(columns)
    if chdtrc(COUNTS[2], gain) < CHANCE:
        yield BrokenAssumption(
            Assumption.WHITE_IN_DIRECTION,
            f"the tip is no {unknowns.tip.shape.kind}: a field of second order lowers chi square by {gain:.0f}",
            "give another --shape, or a field of deviations (--deviations 2)",
        )


def _outliers(fit: WeightedFit) -> Iterator[BrokenAssumption]:
    free = np.maximum(1.0 - fit.leverage, 1e-3)
    studentised = np.abs(fit.each) / np.sqrt(free)
    worst = int(np.argmax(studentised.max(axis=1)))
    size = float(studentised[worst].max())
    if chdtrc(1, size**2) * studentised.size < CHANCE:
        name = fit.equations.unknowns.targets[fit.equations.touches.target[worst]].name
        yield BrokenAssumption(
            Assumption.NO_OUTLIERS,
            f"touch {worst}, of {name}, is {size:.1f} standard deviations off",
            "leave it out, if something slipped or was hit there",
        )


def _noise(fit: WeightedFit) -> Iterator[BrokenAssumption]:
    levers = fit.each[:, 1:]
    free = float(np.sum(1.0 - fit.leverage[:, 1:]))
    square = float(np.sum(levers**2))
    if free > 1.0 and chdtrc(free, square) < CHANCE:
        yield BrokenAssumption(
            Assumption.NOISE_LEVEL,
            f"moments are {np.sqrt(square / free):.1f} times as far off as their noise explains",
            "is the sensor calibrated, its accuracy typed, and did nothing else touch the finger?",
        )
    if fit.scatter > SCATTER * fit.equations.instrument.position_sd:
        yield BrokenAssumption(
            Assumption.NOISE_LEVEL,
            f"touches scatter by {1e6 * fit.scatter:.0f} um where the arm repeats to "
            f"{1e6 * fit.equations.instrument.position_sd:.0f} um",
            "are targets and tip fixed and hard, is the shape right, and the arm's place measured at rest?",
        )
