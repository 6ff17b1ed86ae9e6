"""A fingertip found by touching: least squares over all touches, with what is known beforehand.

The unknowns are found with weights from the noise of the readings, the errors that all touches share (the sensor's
matrix, `accuracy`), how wrong typed values may be, and the arm's scatter, which is estimated from the touches
(scaled inverse chi square, `GAP_WEIGHT` touches' worth of what is typed). Then the model is tested
(`palpate.sensing.tip_calibration.checks`).
"""

from dataclasses import dataclass
from typing import NamedTuple, cast

import numpy as np
import numpy.typing as npt
from scipy.optimize import least_squares
from scipy.special import stdtrit  # scipy.stats takes half a second to import

from palpate.errors import FloatArray, InvalidValueError
from palpate.estimation import Verdict
from palpate.sensing.solver import Surface
from palpate.sensing.tip_calibration.checks import WeightedFit, verdict_of
from palpate.sensing.tip_calibration.equations import Solved, TouchEquations
from palpate.sensing.tip_calibration.instrument import Instrument
from palpate.sensing.tip_calibration.targets import TouchTarget
from palpate.sensing.tip_calibration.touches import Touches
from palpate.sensing.tip_calibration.unknowns import TypedTip, Unknowns
from palpate.surfaces import CompliantTip

TOLD = 0.3
"""Of the typed deviation: where touches leave more of it, they do not tell. What they tell is drawn to the typed
value by at most its square, 9 %."""

GAP_WEIGHT = 4.0
"""Touches that the typed scatter of the arm is worth."""

ROUNDS = 4
"""In which weights are found anew; the scatter settles in two or three."""


@dataclass(frozen=True, slots=True, eq=False)
class TipFit:
    """A tip that was found.

    Attributes:
        unknowns: What was to be found, as typed.
        touches: From which.
        values: As found, shape (P,).
        covariance: Of them, shape (P, P).
        told: Which the touches tell, shape (P,): the others remain as typed.
        scatter: Scatter of the arm and of what no model has [m].
        degrees: Degrees of freedom of `scatter`.
        residuals: Gap and lever of every touch, shape (n, 3) [m].
        expected: Standard deviations of them, shape (n, 3) [m].
        solved: The touches at the values found.
        verdict: Whether the model holds.
    """

    unknowns: Unknowns
    touches: Touches
    values: FloatArray
    covariance: FloatArray
    told: npt.NDArray[np.bool_]
    scatter: float
    degrees: float
    residuals: FloatArray
    expected: FloatArray
    solved: Solved
    verdict: Verdict

    @property
    def sd(self) -> FloatArray:
        """Standard deviations of the values, shape (P,)."""
        return np.sqrt(np.diag(self.covariance))

    def half_widths(self, level: float = 0.95) -> FloatArray:
        """Return the half-widths of confidence intervals, shape (P,)."""
        return np.asarray(self.sd * stdtrit(max(self.degrees, 1.0), 0.5 + 0.5 * level))

    @property
    def center(self) -> FloatArray:
        """Of the tip, sensor frame, shape (3,) [m]."""
        return self.unknowns.of("center", self.values)

    @property
    def rotation(self) -> FloatArray:
        """Columns are the tip's axes in sensor coordinates, shape (3, 3)."""
        return self.unknowns.rotation(self.values)

    @property
    def sizes(self) -> FloatArray:
        """As the shape names them."""
        return self.unknowns.of("size", self.values)

    def rigid_surface(self) -> Surface:
        """Return the tip without its skin's law."""
        deviations = self.unknowns.of("deviations", self.values)
        deviated = self.unknowns.tip.shape.deviated
        if len(deviations) and deviated is not None:
            return deviated(self.sizes, deviations, self.center, self.rotation)
        return self.unknowns.tip.shape.made(self.sizes, self.center, self.rotation)

    def surface(self) -> Surface:
        """Return the tip with its skin, where a skin can be on such a tip.

        Raises:
            InvalidValueError: The tip is open, as a capsule is.
        """
        stiffness, exponent = map(float, self.unknowns.skin(self.values))
        rigid: object = self.rigid_surface()
        return CompliantTip(rigid, stiffness, min(exponent, 1.0))  # type: ignore[arg-type]  # it says what it takes

    def model_covariance(self) -> FloatArray:
        """Return the covariance of place (3), turn about sensor axes (3), size and relative stiffness, (8, 8).

        As `palpate.sensing.tip_uncertainty` takes it; sizes of several lengths count by their mean.
        """
        unknowns = self.unknowns
        linear = np.zeros((8, len(self.values)))
        linear[:3, unknowns.blocks["center"]] = np.eye(3)
        turned = [i for i in range(3) if i not in unknowns.tip.shape.round_about]
        linear[3:6, unknowns.blocks["rotation"]] = self.rotation[:, turned]
        lengths = [name.endswith("_m") and not name.startswith("length") for name in unknowns.tip.shape.names]
        linear[6, unknowns.blocks["size"]] = np.array(lengths) / max(sum(lengths), 1)
        linear[7, unknowns.blocks["stiffness"]] = 1.0
        return np.asarray(linear @ self.covariance @ linear.T)


def fit_tip(
    touches: Touches, targets: tuple[TouchTarget, ...], tip: TypedTip, instrument: Instrument | None = None
) -> TipFit:
    """Return the fingertip that explains touches.

    Args:
        touches: At rest, of at least one target.
        targets: What was touched, about where they are.
        tip: As typed, and how wrong that may be.
        instrument: What measures; exact to 10 um without it.

    Raises:
        InvalidValueError: No touches, or one that cannot be: it pulls, or names no target.
    """
    if not len(touches):
        raise InvalidValueError("no touches: give some of a plate, an edge or a point, from many directions")
    instrument = instrument or Instrument()
    unknowns = Unknowns(tip, targets)
    equations = TouchEquations(unknowns, touches, instrument)
    errors = np.zeros(36 if instrument.accuracy > 0.0 else 0)
    scatter = max(instrument.position_sd, START_SD)
    found = _weighted_fit(equations, unknowns.typed, errors, scatter)
    for _ in range(ROUNDS - 1):
        before = found
        found = _weighted_fit(equations, before.values, before.errors, before.scatter)
        moved = np.abs((found.values - before.values) / unknowns.sd).max()
        if abs(found.scatter / before.scatter - 1.0) < 0.01 and moved < 0.01:
            break
    count, sd = len(unknowns.each), unknowns.sd
    values, scatter = found.values, found.scatter
    solved = equations.solved(values, found.errors)
    covariance = sd[:, None] * found.spread[:count, :count] * sd
    told = np.sqrt(np.diag(covariance)) < TOLD * sd
    fit = WeightedFit(
        equations,
        solved,
        found.whitening,
        found.jacobian,
        found.weighted,
        found.leverage,
        found.spread,
        told,
        scatter,
        found.converged,
        values,
    )
    noise = equations.noise(solved, equations.by_place(values, found.errors), scatter)
    return TipFit(
        unknowns=unknowns,
        touches=touches,
        values=values,
        covariance=covariance,
        told=told,
        scatter=scatter,
        degrees=GAP_WEIGHT + found.degrees,
        residuals=solved.residuals,
        expected=np.sqrt(np.diagonal(noise, axis1=1, axis2=2)),
        solved=solved,
        verdict=verdict_of(fit),
    )


class _Round(NamedTuple):
    """Least squares with weights from the round before; see `WeightedFit`."""

    values: FloatArray
    errors: FloatArray
    whitening: FloatArray
    jacobian: FloatArray
    weighted: FloatArray
    leverage: FloatArray
    spread: FloatArray
    degrees: float
    scatter: float
    converged: bool


def _weighted_fit(equations: TouchEquations, values: FloatArray, errors: FloatArray, scatter: float) -> _Round:
    unknowns = equations.unknowns
    typed, sd, count, n = unknowns.typed, unknowns.sd, len(unknowns.each), len(equations.touches)
    solved = equations.solved(values, errors)
    noise = equations.noise(solved, equations.by_place(values, errors), scatter)
    whitening = cast(FloatArray, np.linalg.inv(np.linalg.cholesky(noise)))
    shared = equations.shared(solved)

    def residuals(z: FloatArray) -> FloatArray:
        raw = equations.solved(typed + sd * z[:count], z[count:]).residuals
        return np.concatenate([np.einsum("nij,nj->ni", whitening, raw).ravel(), z])

    def derivatives(z: FloatArray) -> FloatArray:
        raw = np.concatenate([equations.jacobian(typed + sd * z[:count], z[count:]), shared], axis=2)
        return np.concatenate([(whitening @ raw).reshape(3 * n, -1), np.eye(len(z))])

    start = np.concatenate([(values - typed) / sd, errors])
    best = least_squares(residuals, start, derivatives, x_scale=1.0, xtol=1e-7, ftol=1e-10, gtol=1e-6, max_nfev=60)
    z, jacobian, r = best.x, derivatives(best.x), best.fun
    spread = cast(FloatArray, np.linalg.inv(jacobian.T @ jacobian))
    leverage = np.einsum("ij,ij->i", jacobian @ spread, jacobian)[: 3 * n].reshape(n, 3)
    gaps = r[: 3 * n].reshape(n, 3)[:, 0] * scatter  # up to what the forces' noise adds
    degrees = max(float(np.sum(1.0 - leverage[:, 0])), 0.0)
    expected = GAP_WEIGHT * equations.instrument.position_sd**2 + float(gaps @ gaps)
    return _Round(
        typed + sd * z[:count],
        z[count:],
        whitening,
        jacobian,
        r,
        leverage,
        spread,
        degrees,
        float(np.sqrt(expected / (GAP_WEIGHT + degrees))),
        bool(best.status > 0),
    )


START_SD = 5e-5
"""[m] of scatter in the first round: so far off may touches be before the tip is known."""
