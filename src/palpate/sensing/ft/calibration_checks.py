"""Whether known loads and readings keep to what a calibration assumes.

A reading that is linear in the load leaves residuals that nothing else explains. So everything that could be wrong
is put as one more regressor, which least squares had none for: one load alone, the zero from some load on, the
load before, squares of loads. Each must explain no more of any channel, or of any axis of the wrench, than chance.

What is tested has a limit below which it stays unnoticed. By how much that may move the matrix is the external
reliability of Baarda (1968, "A testing procedure for use in geodetic networks"): loads of which one, or a drift of
the zero, could move it by more than `LARGEST_SHIFT` are no proof.
"""

import itertools
import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.special import fdtrc, stdtr, stdtrit

from palpate.errors import FloatArray
from palpate.estimation import Assumption, BrokenAssumption, Verdict, ill_conditioned, white_in_time
from palpate.sensing.ft.arrays import AXES, OTHER_MOMENT_UNIT, named_axes
from palpate.sensing.ft.calibration_map import CalibrationMap

UNKNOWNS = 7
"""Per channel of a linear sensor: its sensitivity to six loads, and its offset."""

LOADS_PER_UNKNOWN = 2
"""From which on every unknown has a load that checks it."""

TESTED_PER_UNKNOWN = 4
"""Loads from which on residuals are independent enough for a test of their correlations."""

LARGEST_CONDITION = 100.0
"""Of a useful sensor: a channel error of 1 % then is one of the whole range in the worst direction."""

SURE = 5.0
"""Standard errors by which the response of a sensor to the weakest direction must differ from none."""

LARGEST_ERROR = 0.02
"""Root mean square error of loads left out, in units of the range; makers of such sensors claim 1 to 2 %."""

LARGEST_DOUBT = 0.01
"""Standard deviation by which the calibration may be off at full range, in units of the range: 2 % at 95 %."""

LARGEST_LOAD = 2.0
"""In units of the range: sensors bear more, but nobody calibrates there."""

CHANCE = 1e-3
"""Probability under noise alone below which a test counts as failed; there are four."""

BENT = 5e-3
"""The same for each of six tests of lines, which move the matrix before they are plain."""

LARGEST_SHIFT = 7.0
"""Standard deviations by which what stays unnoticed may move the matrix."""

FEW = 3
"""Loads that must not carry an estimate."""

CARRIED = 0.8
"""Of what is known of an axis may come from these."""

SAME_SHOWN = 0.02
"""Of a channel's span: loads that should show so different readings cannot show the same one."""

RIGHT_ANGLE = 0.02
"""Cosine between force and moment of a weight on a lever, known to a hundredth."""

ON_LEVERS = 0.9
"""Of the loads, from which on they count as weights on levers."""

OTHER_UNIT = 30.0
"""Factor between forces and moments that no change of a sensor makes: mN m are 1000."""


@dataclass(frozen=True, slots=True, eq=False)
class FittedCalibration:
    """What is tested; n loads, k channels. What is predicted are readings from loads, or loads from readings.

    Attributes:
        loads: As they are known, shape (n, 6) [N, N m].
        ranges: Of the sensor, shape (6,) [N, N m].
        raw: Readings, shape (n, k).
        linear: What a linear sensor would show, likewise.
        basis: Orthonormal columns that span what predicts, times the roots of the weights, shape (n, p).
        root: Roots of the weights, shape (n, 1).
        expected: What is predicted, shape (n, q).
        residual: Of that, times the roots, shape (n, q).
        names: Of these q, for messages.
        bends: What they could further depend on, if not on a line, shape (n, m).
        bend_names: Of these m.
        noisy: Those whose residuals are more than rounding, shape (q,).
        matched: What a load of each axis changes in them, over their variances, shape (q, 6).
        left_out: Error of each load by a calibration from the others, shape (n, 6) [N, N m].
        doubt: Standard deviation by which the calibration is off at full range, in units of the range, shape (6,).
        condition: Of the sensor.
        felt: Standard errors by which the response to the weakest direction of load differs from none.
    """

    loads: FloatArray
    ranges: FloatArray
    raw: FloatArray
    linear: FloatArray
    basis: FloatArray
    root: FloatArray
    expected: FloatArray
    residual: FloatArray
    names: tuple[str, ...]
    bends: FloatArray
    bend_names: tuple[str, ...]
    noisy: npt.NDArray[np.bool_]
    matched: FloatArray
    left_out: FloatArray
    doubt: FloatArray
    condition: float
    felt: float

    @property
    def unknowns(self) -> int:
        """Per channel, or per axis."""
        return int(self.basis.shape[1])


def calibration_verdict(fit: FittedCalibration) -> Verdict:
    """Return what the loads contradict, worst first."""
    tests = (_units, _saturation, _levers, _size, _residuals, _conditioning)
    return Verdict(tuple(broken for test in tests for broken in test(fit)))


def contradicted_axes(
    previous: CalibrationMap, raw: FloatArray, loads: FloatArray, ranges: FloatArray
) -> Iterator[BrokenAssumption]:
    """Return whether loads are known in other axes or units than the sensor had by the calibration before."""
    if previous.channels != raw.shape[1]:
        return
    shown = previous.apply(raw) / ranges
    turn = np.linalg.lstsq(shown - shown.mean(axis=0), (loads - loads.mean(axis=0)) / ranges)[0].T
    remedy = "correct the loads, or start from a sensor file without a matrix, if its frame or cable is another"
    near = np.argmax(np.abs(turn), axis=1)
    size = turn[np.arange(6), near]
    if (near != np.arange(6)).any() or (size < 0.0).any():
        names = ", ".join(f"{'-' if s < 0.0 else ''}{AXES[i]}" for i, s in zip(near, size, strict=True))
        yield BrokenAssumption(
            Assumption.CONSISTENT, f"by the matrix before, the loads' axes are ({names})", remedy
        )
    factor = float(np.median(np.abs(size[3:])) / np.median(np.abs(size[:3])))
    if not 1.0 / OTHER_UNIT <= factor <= OTHER_UNIT:
        yield BrokenAssumption(
            Assumption.PLAUSIBLE,
            f"by the matrix before, moments are {factor:.3g} times as large beside forces",
            OTHER_MOMENT_UNIT,
        )


def _units(fit: FittedCalibration) -> Iterator[BrokenAssumption]:
    size = np.abs(fit.loads) / fit.ranges
    if size.max() > LARGEST_LOAD:
        i, j = np.unravel_index(int(np.argmax(size)), size.shape)
        yield BrokenAssumption(
            Assumption.PLAUSIBLE,
            f"{AXES[j]} of load {i} is {size[i, j]:.3g} times the range, at most {LARGEST_LOAD:g}",
            f"{OTHER_MOMENT_UNIT}, or correct the sensor's range",
        )


def _saturation(fit: FittedCalibration) -> Iterator[BrokenAssumption]:
    for j, (shown, linear) in enumerate(zip(fit.raw.T, fit.linear.T, strict=True)):
        for bound in (shown.max(), shown.min()):
            there = np.flatnonzero(shown == bound)
            spread = np.ptp(linear[there])
            if len(there) > 1 and spread > SAME_SHOWN * np.ptp(shown):
                yield BrokenAssumption(
                    Assumption.WITHIN_BOUNDS,
                    f"channel {j} shows {bound:g} under loads {', '.join(map(str, there[:4]))}, for which a line "
                    f"has up to {spread:.2g} between: it is saturated",
                    "load less there, or lower the amplification",
                )
                return


def _levers(fit: FittedCalibration) -> Iterator[BrokenAssumption]:
    """A weight on a lever makes a moment at right angles to its force; find axes in which all loads do."""
    force, moment = fit.loads[:, :3], fit.loads[:, 3:]
    sizes = np.linalg.norm(force, axis=1), np.linalg.norm(moment, axis=1)
    both = (sizes[0] > 1e-3 * fit.ranges[:3].max()) & (sizes[1] > 1e-3 * fit.ranges[3:].max())
    if np.count_nonzero(both) < LOADS_PER_UNKNOWN * UNKNOWNS:
        return
    product = (force[both] / sizes[0][both, None])[:, :, None] * (moment[both] / sizes[1][both, None])[:, None]

    def at_right_angles(turn: FloatArray) -> float:
        return float(np.mean(np.abs(np.einsum("nij,ji->n", product, turn)) < RIGHT_ANGLE))

    signs = [np.diag([1.0, a, b]) for a in (1.0, -1.0) for b in (1.0, -1.0)]
    turns = [np.eye(3)[list(order)] @ sign for order in itertools.permutations(range(3)) for sign in signs]
    best = max(turns, key=at_right_angles)
    if at_right_angles(np.eye(3)) < ON_LEVERS <= at_right_angles(best):
        yield BrokenAssumption(
            Assumption.UNIQUE,
            f"with {named_axes(best)} for the axes of the forces, each is at right angles to its moment, as of "
            f"weights on levers; as given, in {at_right_angles(np.eye(3)):.0%} of loads",
            "check axes and signs of forces and moments",
        )


def _size(fit: FittedCalibration) -> Iterator[BrokenAssumption]:
    relative = fit.left_out / fit.ranges
    rms = np.sqrt((relative**2).mean(axis=0))
    worst = int(np.argmax(rms))
    if rms[worst] > LARGEST_ERROR:
        yield BrokenAssumption(
            Assumption.NOISE_LEVEL,
            f"loads that were left out are missed by {rms[worst]:.1%} of the range of {AXES[worst]}, at most "
            f"{LARGEST_ERROR:.0%}; load {int(np.argmax(np.abs(relative[:, worst])))} the most",
            "check the loads, their order and signs; else the sensor is not linear, or has hysteresis",
        )


def _residuals(fit: FittedCalibration) -> Iterator[BrokenAssumption]:
    n = len(fit.loads)
    if not fit.noisy.any():
        # what is exact to rounding has each spare load as a proof
        return
    if n < (fewest := LOADS_PER_UNKNOWN * fit.unknowns):
        yield BrokenAssumption(
            Assumption.ENOUGH_DATA,
            f"{n} loads, at least {fewest} to test {fit.unknowns} unknowns each",
            "load more, in all directions and of both signs",
        )
        return
    left = fit.residual[:, fit.noisy]
    shown = np.column_stack([left, fit.residual @ fit.matched])
    lengths = np.linalg.norm(shown, axis=0)
    shown = shown / np.where(lengths > 0.0, lengths, 1.0)
    scaled = (fit.loads - fit.loads.mean(axis=0)) / fit.ranges

    at = _Explained.of(fit, np.eye(n), shown)
    if at.rarity < CHANCE:
        yield _bad_load(fit, at)
    after = np.tril(np.ones((n, n)))[:, 1:]
    order = np.linspace(-1.0, 1.0, n)
    drift = np.column_stack([np.polynomial.Legendre.basis(k)(order) for k in (1, 2, 3)])
    before = np.vstack([np.zeros(6), scaled[:-1]])
    timed = _Explained.of(fit, np.hstack([drift, after, before, order[:, None] * scaled]), shown)
    yield from _timed(timed, n)
    if n >= TESTED_PER_UNKNOWN * fit.unknowns and timed.rarity >= CHANCE:
        rarity = white_in_time(_independent(fit))
        if rarity < CHANCE:
            yield BrokenAssumption(
                Assumption.WHITE_IN_TIME,
                f"residuals follow one another: probability {rarity:.0e}, at least {CHANCE:g}",
                "let the sensor warm up, and load in random order",
            )
    yield from _linear(fit, scaled, shown)
    yield from _even_noise(fit, scaled)
    yield from _few(fit, scaled)
    yield from _influence(fit, np.column_stack([np.eye(n), order]), shown.shape[1])


@dataclass(frozen=True, slots=True, eq=False)
class _Explained:
    """What one more regressor would explain; m regressors, p residuals.

    Attributes:
        worst: Regressor that explains most, of the residual it explains most of.
        rarity: Probability that chance explains as much by any of them.
    """

    worst: int
    rarity: float

    @classmethod
    def of(cls, fit: FittedCalibration, regressors: FloatArray, shown: FloatArray) -> "_Explained":
        """Return what regressors (n, m) explain of residuals of length 1, shape (n, p), and of all channels."""
        spare = len(shown) - fit.unknowns - 1
        Z = fit.root * regressors
        left = Z - fit.basis @ (fit.basis.T @ Z)
        length = np.linalg.norm(left, axis=0)
        used = length > 1e-3 * np.linalg.norm(Z, axis=0)
        r = np.where(used[:, None], left.T @ shown, 0.0) / np.where(used, length, 1.0)[:, None]
        square = np.minimum(r**2, 1.0 - 1e-12)
        chance = 2.0 * np.asarray(stdtr(spare, -np.sqrt(spare * square / (1.0 - square))))
        # Hotelling's T^2 of one regressor
        channels = _independent(fit)
        k = channels.shape[1]
        if (free := spare + 1 - k) > 0:
            whole = np.minimum(((left / np.where(used, length, 1.0)).T @ channels * used[:, None]) ** 2, 1.0).sum(
                axis=1
            )
            of_all = np.asarray(
                fdtrc(k, free, np.minimum(whole, 1.0) / k / np.maximum((1.0 - whole) / free, 1e-12))
            )
            chance = np.column_stack([chance, of_all])
        worst = int(np.argmin(chance.min(axis=1)))
        return cls(worst, float(chance.min()) * np.count_nonzero(used) * chance.shape[1])


def _independent(fit: FittedCalibration) -> FloatArray:
    """Return residuals of noisy channels as orthonormal columns."""
    left = fit.residual[:, fit.noisy]
    u, singular, _ = np.linalg.svd(left / np.linalg.norm(left, axis=0), full_matrices=False)
    return np.asarray(u[:, singular > 1e-6 * singular[0]])


def _bad_load(fit: FittedCalibration, at: _Explained) -> BrokenAssumption:
    load, error = fit.loads[at.worst] / fit.ranges, fit.left_out[at.worst] / fit.ranges
    axis = int(np.argmax(np.abs(error)))
    factor = 1.0 + float(load @ error) / float(load @ load)
    remedy = "check it, or take it again"
    if np.linalg.norm(load + error - factor * load) < 0.2 * np.linalg.norm(error):
        remedy = f"it seems to be {factor:.3g} times what is given: " + remedy
    return BrokenAssumption(
        Assumption.NO_OUTLIERS,
        f"load {at.worst} shows {fit.left_out[at.worst, axis]:+.3g} {'N' if axis < 3 else 'N m'} too much of "
        f"{AXES[axis]} by a calibration from the others: probability {at.rarity:.0e}, at least {CHANCE:g}",
        remedy,
    )


def _timed(timed: _Explained, n: int) -> Iterator[BrokenAssumption]:
    if timed.rarity >= CHANCE:
        return
    remedy = "let the sensor warm up, and load in random order"
    k = timed.worst - 3
    if k < 0:
        what = "the zero drifts"
    elif k < n - 1:
        what = f"the zero is another from load {k + 1} on"
        remedy = "check what was changed there, and take the loads before or after it again"
    elif k < n + 5:
        what = f"readings depend on {AXES[k - n + 1]} of the load before"
        remedy = "wait longer after each load, and load in random order: the sensor creeps, or has hysteresis"
    else:
        what = f"the sensitivity to {AXES[k - n - 5]} drifts"
    yield BrokenAssumption(
        Assumption.WHITE_IN_TIME, f"{what}: probability {timed.rarity:.0e}, at least {CHANCE:g}", remedy
    )


def _linear(fit: FittedCalibration, scaled: FloatArray, shown: FloatArray) -> Iterator[BrokenAssumption]:
    pairs = list(itertools.combinations_with_replacement(range(6), 2))
    products = np.column_stack([scaled[:, a] * scaled[:, b] for a, b in pairs])
    weight = np.linalg.norm(fit.loads[:, :3] / fit.ranges[:3].max(), axis=1, keepdims=True)
    expected = (fit.expected - fit.expected.mean(axis=0)) / np.ptp(fit.expected, axis=0)
    curved = np.hstack([products, scaled * np.abs(scaled), np.abs(scaled), expected**2, expected**3, fit.bends])
    curved = np.hstack([curved, _of_one_weight(weight, scaled)])
    found = _Explained.of(fit, curved, shown)
    if found.rarity >= CHANCE:
        yield from _lines(fit, scaled, expected)
        return
    names = [" ".join(dict.fromkeys((AXES[a], AXES[b]))) for a, b in pairs] + 2 * list(AXES)
    names += 2 * list(fit.names) + list(fit.bend_names)
    remedy = "load less, if it saturates; else the sensor is not linear there, or its loads are not known"
    if found.worst < len(names):
        what = f"residuals depend on {names[found.worst]} beyond a line"
    else:
        group = _groups(weight)[(found.worst - len(names)) // 6]
        what = f"loads {', '.join(map(str, np.flatnonzero(group)[:6]))}, all of one weight, are off alike"
        remedy = "weigh that one"
    yield BrokenAssumption(
        Assumption.WHITE_IN_DIRECTION, f"{what}: probability {found.rarity:.0e}, at least {CHANCE:g}", remedy
    )


def _lines(fit: FittedCalibration, scaled: FloatArray, expected: FloatArray) -> Iterator[BrokenAssumption]:
    """Few tests, so that each finds less: axes beyond a line by what they show, channels by what they do."""
    spare = len(scaled) - fit.unknowns
    names, chances = [], []
    for what, curved in (("differs by sign", np.abs(scaled)), ("is not linear", scaled * np.abs(scaled))):
        pull = _pull(fit, curved, fit.residual @ fit.matched)[0]
        chances += (6.0 * _two_sided(pull, spare)).tolist()
        names += [f"the sensitivity to {axis} {what}" for axis in AXES]
    k = np.count_nonzero(fit.noisy)
    for power in (2, 3):
        pull, together = _pull(fit, expected[:, fit.noisy] ** power, fit.residual[:, fit.noisy])
        chances.append(float(_two_sided(pull.sum() / math.sqrt(max(together.sum(), 1e-6 * k)), spare)))
        names.append(f"all that is predicted bends alike, with its power {power}")
        chances += (k * _two_sided(pull, spare)).tolist()
        noisy = [name for name, is_noisy in zip(fit.names, fit.noisy, strict=True) if is_noisy]
        names += [f"{name} bends with the power {power} of what it shows" for name in noisy]
    worst = int(np.argmin(chances))
    if (rarity := chances[worst]) < BENT:
        yield BrokenAssumption(
            Assumption.WHITE_IN_DIRECTION,
            f"{names[worst]}: probability {rarity:.0e}, at least {BENT:g}",
            "load less, if it saturates; else the sensor is not linear",
        )


def _two_sided(pull: FloatArray | float, spare: int) -> FloatArray:
    """Return the probability of so many standard deviations, if these have so many degrees of freedom."""
    share = np.asarray(pull) ** 2 / spare
    return np.asarray(2.0 * stdtr(spare - 1, -np.sqrt((spare - 1) * share / np.maximum(1.0 - share, 1e-12))))


def _pull(fit: FittedCalibration, regressors: FloatArray, shown: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return by how many standard deviations regressors (n, m) explain their own residuals, and correlations."""
    Z = fit.root * regressors
    Z = Z - fit.basis @ (fit.basis.T @ Z)
    Z = Z / np.linalg.norm(Z, axis=0)
    shown = shown / np.linalg.norm(shown, axis=0)
    return (Z * shown).sum(axis=0) * math.sqrt(len(Z) - fit.unknowns), (Z.T @ Z) * (shown.T @ shown)


def _even_noise(fit: FittedCalibration, scaled: FloatArray) -> Iterator[BrokenAssumption]:
    """Spearman's rank correlation of the sizes of residuals and loads."""
    n = len(scaled)
    size = (_independent(fit) ** 2).sum(axis=1) / np.maximum(1.0 - (fit.basis**2).sum(axis=1), 1e-12)
    ranks = [np.argsort(np.argsort(each)) for each in (size, np.linalg.norm(scaled, axis=1))]
    r = float(np.asarray(np.corrcoef(ranks))[0, 1])
    rarity = float(stdtr(n - 2, -r * math.sqrt((n - 2) / max(1.0 - r * r, 1e-12))))
    if rarity < CHANCE:
        yield BrokenAssumption(
            Assumption.NOISE_LEVEL,
            f"residuals grow with the load: probability {rarity:.0e}, at least {CHANCE:g}",
            "loads are not known well enough, or readings swing: fix levers, wait until weights hang still",
        )


def _groups(weight: FloatArray) -> list[FloatArray]:
    """Return which loads are of one weight, for each weight that is there more than once, but not throughout."""
    rounded = np.round(weight[:, 0] / max(float(weight.max()), 1e-12), 4)
    values, counts = np.unique(rounded, return_counts=True)
    return [rounded == value for value, count in zip(values, counts, strict=True) if 1 < count < len(rounded)]


def _of_one_weight(weight: FloatArray, scaled: FloatArray) -> FloatArray:
    """Return the loads of each weight, and zero for others, six columns for each."""
    return np.hstack([scaled[:, :0], *(each[:, None] * scaled for each in _groups(weight))])


def _few(fit: FittedCalibration, scaled: FloatArray) -> Iterator[BrokenAssumption]:
    share = np.linalg.pinv(fit.root * np.column_stack([scaled, np.ones(len(scaled))]))[:6] ** 2
    share /= share.sum(axis=1, keepdims=True)
    carried = np.sort(share, axis=1)[:, -FEW:].sum(axis=1)
    worst = int(np.argmax(carried))
    if carried[worst] > CARRIED:
        few = ", ".join(map(str, sorted(np.argsort(share[worst])[-FEW:].tolist())))
        yield BrokenAssumption(
            Assumption.EVEN_INFLUENCE,
            f"{carried[worst]:.0%} of what is known of {AXES[worst]} come from loads {few}, at most {CARRIED:.0%}",
            f"load {AXES[worst]} more often, and of both signs",
        )


def _influence(fit: FittedCalibration, regressors: FloatArray, residuals: int) -> Iterator[BrokenAssumption]:
    """By how much the smallest error of each kind that would be noticed may move an estimate."""
    n = len(fit.loads)
    Z = fit.root * regressors
    constant = fit.root / np.linalg.norm(fit.root)
    centred = Z - constant @ (constant.T @ Z)
    share = ((fit.basis.T @ centred) ** 2).sum(axis=0) / (centred**2).sum(axis=0)
    spare = n - fit.unknowns - 1
    noticed = -float(stdtrit(spare, 0.5 * CHANCE / (n * residuals)))
    inflated = math.sqrt((spare + noticed**2) / (spare + 1))
    shift = noticed * np.sqrt(share / np.maximum(1.0 - share, 1e-12)) / inflated
    worst = int(np.argmax(shift[:n]))
    if shift[worst] > LARGEST_SHIFT:
        yield BrokenAssumption(
            Assumption.EVEN_INFLUENCE,
            f"an error of load {worst} that nobody would notice moves the matrix by {shift[worst]:.2g} standard "
            f"deviations, at most {LARGEST_SHIFT:g}",
            "load that direction more often, and of both signs",
        )
    if shift[n] > LARGEST_SHIFT:
        yield BrokenAssumption(
            Assumption.UNIQUE,
            f"a drift of the zero looks like the loads: unnoticed, it moves the matrix by {shift[n]:.2g} standard "
            f"deviations, at most {LARGEST_SHIFT:g}",
            "load in random order",
        )


def _conditioning(fit: FittedCalibration) -> Iterator[BrokenAssumption]:
    remedy = "the sensor hardly feels some direction: check its channels for one that is dead or doubled"
    yield from ill_conditioned(fit.condition, LARGEST_CONDITION, remedy)
    if fit.felt < SURE:
        yield BrokenAssumption(
            Assumption.CONDITIONED,
            f"the response to the weakest direction of load is {fit.felt:.2g} standard errors from none, at least "
            f"{SURE:g}",
            remedy,
        )
    worst = int(np.argmax(fit.doubt))
    if fit.doubt[worst] > LARGEST_DOUBT:
        yield BrokenAssumption(
            Assumption.CONDITIONED,
            f"at full range {AXES[worst]} is uncertain by {fit.doubt[worst]:.1%} of it, at most "
            f"{LARGEST_DOUBT:.1%}",
            "load more, and nearer to the range",
        )
